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
