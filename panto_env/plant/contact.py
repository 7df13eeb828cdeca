"""The one law that joins any pantograph to any catenary."""

from __future__ import annotations

from ..backend import inlined


@inlined
def contact_force(stiffness, gap, change, damping, yields, compliance, lowest):
    """Mean contact force over one step (N), implicit and without sub-iteration.

    ``gap`` (head height minus wire height, positive when pressed together, m) is its mean over the step and
    ``change`` the way that it closes in the step (m), both as they were without this force, which makes
    them smaller by ``yields`` and ``compliance`` times itself (m/N). The contact yields ``stiffness`` (N/m)
    times the gap plus ``damping`` (N s/m divided by the step, so N/m) times its change.

    ``lowest`` is 0 for a contact that can only push, -inf for papers that let it pull.
    """
    force = (stiffness * gap + damping * change) / (1.0 + stiffness * yields + damping * compliance)
    return max(force, lowest)
