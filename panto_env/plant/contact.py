"""The contact law between any pantograph and any catenary."""

from __future__ import annotations

from ..backend import inlined


@inlined
def contact_force(compliance, gap, change, damping, gap_yield, change_yield, lowest):
    """Mean contact force over one step (N), implicit and without sub-iteration.

    ``gap`` is head height minus wire height (m, positive in contact), its mean over the step, and ``change``
    its growth over the step (m), both without this force, which reduces them by ``gap_yield`` and
    ``change_yield`` per newton (m/N). The force is the gap over the contact's ``compliance`` (m/N) plus
    ``damping`` (N s/m divided by the step, so N/m) times its change.

    ``lowest`` is 0 for a contact that can only push, -inf for papers that let it pull.
    """
    damped = compliance * damping
    force = (gap + damped * change) / (compliance + gap_yield + damped * change_yield)
    return max(force, lowest)


@inlined
def shared_forces(first, second, through_head):
    """Mean contact forces (N) of one head with two wires, neither of which pulls.

    first, second: of each wire, the numerator and the denominator of ``contact_force`` (m, m/N).
    through_head: by how much a newton on one wire takes the head from the other (m/N), as the denominators
    count it.
    """
    one, other = max(first[0] / first[1], 0.0), max(second[0] / second[1], 0.0)
    if one > 0.0 and other > 0.0:
        both = first[1] * second[1] - through_head * through_head
        with_other = (first[0] * second[1] - through_head * second[0]) / both
        with_one = (second[0] * first[1] - through_head * first[0]) / both
        if with_other < 0.0:
            one = 0.0
        elif with_one < 0.0:
            other = 0.0
        else:
            one, other = with_other, with_one
    return one, other
