"""The one law that joins any pantograph to any catenary."""

from __future__ import annotations

from ..backend import inlined


@inlined
def contact_force(stiffness_0, gap_0, stiffness_1, gap_free, damping, compliance, lowest):
    """Mean contact force over one step (N), implicit and without sub-iteration.

    Over the step the gap (head height minus wire height, positive when pressed together, m) goes
    from ``gap_0`` to ``gap_free - compliance * F``: each side is linear but for this force, which
    moves head and wire apart by ``compliance`` (m/N) together. The contact yields the mean of its
    spring forces at both ends of the step (so the law is of second order and adds no damping of its
    own) plus ``damping`` (N s/m divided by the step, so N/m). Stiffness (N/m) may differ at the two
    ends: a line may itself be a massless spring (paper 3).

    ``lowest`` is 0 for a contact that can only push, -inf for papers that let it pull.
    """
    mean_gap = 0.5 * (stiffness_0 * gap_0 + stiffness_1 * gap_free)
    force = (mean_gap + damping * (gap_free - gap_0)) / (1.0 + (0.5 * stiffness_1 + damping) * compliance)
    return max(force, lowest)
