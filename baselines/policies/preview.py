"""Contact force on a line as designed: the passive force along the span, and the response to commands.

A policy that knows the design may compute both beforehand; it sees nothing of the actual line.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.base.arrays import to_kmh
from panto_env.base.checksums import remembered
from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.context import Context
from panto_env.control.settings import run_settings
from panto_env.plant.actuators.lagged import LaggedActuator
from panto_env.plant.catenary import CatenaryData
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.state import Place

Array = NDArray[np.float64]
SETTLED = 9
"""Spans after which the force nearly repeats with the span."""
CLEAR = 8
"""Spans of the line beyond those run, so that its end has no effect."""
PULSE = 20.0
"""Test force (N): small beside the contact force, large beside rounding."""


class Preview(NamedTuple):
    """Preview at steps through a span, one control interval apart; the first is ``start`` past a support."""

    start: float  # m
    stride: float  # of a step (m)
    passive: Array  # (steps,): contact force of the passive run, from its mean (N)
    response: Array  # (steps, length): contact force 1, 2, ... steps after a command of one step there (N/N)

    def step(self, position: Array) -> NDArray[np.int64]:
        """Index of the step nearest to each distance past a support (m), (lanes,)."""
        return np.rint((position - self.start) / self.stride).astype(np.int64) % len(self.passive)


def preview(context: Context, length: int, delay: float, lag: float) -> Preview:
    """Preview for an episode. length: steps of the responses; delay, lag: of the actuator (s)."""
    place = Place(context.channels[0]).name.lower()
    speed, interval = context.speed, context.control_interval
    return _preview(context.catenary, context.pantograph, place, speed, interval, length, delay, lag)


@remembered
def _preview(
    catenary: CatenaryData,
    pantograph: PantographData,
    place: str,
    speed: float,
    interval: float,
    length: int,
    delay: float,
    lag: float,
) -> Preview:
    stride, alignment = speed * interval, catenary.alignment()
    first = math.ceil(alignment.support(SETTLED) / stride)
    steps = max(1, round(alignment.mean_length / stride))
    last = first + steps + length
    spans = math.ceil(alignment.in_spans(last * stride))
    settings = run_settings(
        {
            "catenary": catenary,
            "pantograph": pantograph,
            "speed_kmh": to_kmh(speed),
            "actuator": LaggedActuator(place=place, delay=delay, lag=lag, force_limit=PULSE),
            "accuracy": "fast",
            "distance": alignment.support(spans),
            "spans": spans + CLEAR,
            "control_interval": interval,
        }
    )
    task = Task(settings, lanes=1 + steps, keep_samples=False)  # lane 0 runs passively
    task.reset(np.arange(1 + steps), np.random.default_rng(0))
    entry = task.layout.index("contact force")
    scale = task.layout.entries[entry].scale
    force = np.zeros((last + 1, 1 + steps))
    for k in range(last + 1):
        if task.results.terminated.any():
            raise InputError(f"On '{catenary.name}' as designed a pass ends early: {task.ending(0)}")
        force[k] = scale * task.results.observation[:, entry]
        action = np.zeros((1 + steps, len(task.actuator.places)))
        if first <= k < first + steps:
            action[1 + k - first, 0] = 1.0
        if k < last:
            task.step(action)
    passive = force[first : first + steps, 0]
    response = np.array(
        [
            force[first + i + 1 : first + i + 1 + length, 1 + i]
            - force[first + i + 1 : first + i + 1 + length, 0]
            for i in range(steps)
        ]
    )
    start = first * stride - alignment.support(SETTLED)
    return Preview(start, stride, passive - passive.mean(), response / PULSE)
