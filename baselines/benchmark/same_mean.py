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

    arguments: those of ``simulate`` that the run was made with, except its policy.
    """
    mean = run.summary(spans).mean
    if not mean > 0:
        return NONE
    try:
        passive = simulate(**arguments, mean_force=mean, evaluated=spans)
    except InputError:  # no static force gives this mean
        return NONE
    if passive.terminated:
        return NONE
    figures = passive.summary(spans)
    return PassiveFigures(figures.std, figures.cost_function)
