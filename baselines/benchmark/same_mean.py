"""The passive pantograph that a policy is compared with: one at the policy's own mean contact force."""

from __future__ import annotations

from typing import Any, NamedTuple

from panto_env import Trajectory, simulate
from panto_env.base.errors import InputError


class PassiveFigures(NamedTuple):
    """Figures of the passive pantograph at a policy's mean force; nan if it can't reach that mean."""

    std: float  # sigma (N)
    cost_function: float  # CF (N m)


NONE = PassiveFigures(float("nan"), float("nan"))


def passive_at_mean_of(run: Trajectory, spans: tuple[int, int], arguments: dict[str, Any]) -> PassiveFigures:
    """Run the passive pantograph on the same line, with a static force that gives the mean force of ``run``.

    Of a train each has the mean force that it had, and the figures are those of the controlled one
    whose sigma is largest. arguments: those of ``simulate`` that the run was made with, except its
    policy.
    """
    means = [own.summary(spans).mean for own in run.train]
    if not min(means) > 0:
        return NONE
    try:
        mean = means if len(means) > 1 else means[0]
        passive = simulate(**arguments, mean_force=mean, trimmed_over=spans)
    except InputError:  # no static force gives this mean
        return NONE
    if passive.terminated:
        return NONE
    worst = passive.worst_controlled(spans).summary(spans)
    return PassiveFigures(worst.std, worst.cost_function)
