"""The one law that joins any pantograph to any catenary."""

from __future__ import annotations

from ..backend import inlined


@inlined
def contact_force(compliance, gap, change, damping, gap_yield, change_yield, lowest):
    """Mean contact force over one step (N), implicit and without sub-iteration.

    ``gap`` (head height minus wire height, positive when pressed together, m) is its mean over the step and
    ``change`` the way that it closes in the step (m), both as they were without this force, which makes
    them smaller by ``gap_yield`` and ``change_yield`` times itself (m/N). The force is the gap over the
    contact's ``compliance`` (m/N) plus ``damping`` (N s/m divided by the step, so N/m) times its change.

    ``lowest`` is 0 for a contact that can only push, -inf for papers that let it pull.
    """
    damped = compliance * damping
    force = (gap + damped * change) / (compliance + gap_yield + damped * change_yield)
    return max(force, lowest)
