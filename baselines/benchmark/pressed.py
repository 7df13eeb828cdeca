"""What a policy is held against: a passive pantograph that presses as hard as the policy does."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from panto_env import Trajectory, simulate
from panto_env.base.errors import InputError


class Pressed(NamedTuple):
    """Figures of the passive pantograph at a policy's mean force; nan where it cannot be pressed so."""

    std: float  # sigma (N)
    cost_function: float  # CF (N m)


NONE = Pressed(float("nan"), float("nan"))


def pressed_passive(run: Trajectory, spans: tuple[int, int], arguments: dict[str, Any]) -> Pressed:
    """The passive pantograph on the same line, its static force set so that its mean is that of ``run``.

    arguments: those of ``simulate`` that the run was made with, but for its policy.
    """
    mean = run.summary(spans).mean
    if not mean > 0:
        return NONE
    try:
        passive = simulate(**arguments, mean_force=mean, evaluated=spans)
    except InputError:  # a mean that no static force gives
        return NONE
    if passive.terminated:
        return NONE
    figures = passive.summary(spans)
    return Pressed(figures.std, figures.cost_function)


def power(run: Trajectory, spans: tuple[int, int]) -> float:
    """Mechanical power (W) that actuators give and take, mean of its magnitude over the spans.

    That of the frame moves with the frame; that of the head presses head and frame apart.
    """
    inside = run.inside(spans)
    on_frame = run.frame_force * run.frame_velocity
    on_head = run.head_force * (run.head_velocity - run.frame_velocity)
    return float(np.mean(np.abs(on_frame) + np.abs(on_head), where=inside))
