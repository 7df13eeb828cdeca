"""What the pantograph in front measured at places ahead of a controlled one, as a train's data bus tells it.

The contact force that the sensors of the one in front read, with their delay and noise, is kept for each
control step until the one behind has come to the place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..backend import NOT_NEGATIVE, inlined
from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.sensors import READING, Reading
from ..plant.state import ROW, PerCollector, per_collector
from ..plant.train import Train


class FrontArrays(NamedTuple):
    """Readings of the pantographs in front; arrays without columns where nothing of them is observed."""

    ahead: Array  # (places,): distances ahead of a controlled pantograph (m)
    behind: Array  # (agents,): its distance behind the one in front (m); 0 where there is none
    collector: PerCollector  # that in front of each agent; its own where there is none
    reading: Array  # (rows, readings): of the one in front, where it is not controlled itself
    kept: Array  # (rows, times): its contact force after each control step (N), time n in column n % times


def front_arrays(places: tuple[float, ...], train: Train, lanes: int, slowest: float) -> FrontArrays:
    """Arrays for the agents of all lanes; slowest: distance that a train covers in a control step (m).

    Raises InputError where a place lies beyond the pantograph in front, or no controlled one has any.
    """
    collectors, driven = train.collectors, train.driven
    behind = np.array(
        [
            collectors[number].distance - collectors[number - 1].distance if number else 0.0
            for number in driven
        ]
    )
    if places and not behind.any():
        raise InputError(
            "front is what a pantograph in front measured, and no controlled one has any in front of it; "
            "leave out front, or control another one."
        )
    if places and places[-1] > behind[behind > 0].min():
        raise InputError(
            f"front must be at most the {behind[behind > 0].min():g} m to the pantograph in front, not "
            f"{places[-1]:g} m."
        )
    rows = lanes * len(driven)
    times = math.ceil(behind.max() / slowest) + 2 if places else 0
    return FrontArrays(
        ahead=np.array(places, dtype=float),
        behind=behind,
        collector=per_collector((max(number - 1, 0) for number in driven), int, len(collectors)),
        reading=np.zeros((rows, len(Reading) if places else 0)),
        kept=np.zeros((rows, times)),
    )


@inlined
def keep_front(episode, sensors, run, reading, agent, lane, row):
    """Keep the contact force that the one in front has read in a control step; reading: its readings."""
    c, kept = episode.front.collector[agent], episode.front.kept[row]
    force = reading[READING.CONTACT_FORCE]
    if sensors.noise.shape[2] > 0:
        force += sensors.noise[lane, c, sensors.noise_used[lane] & NOT_NEGATIVE, READING.CONTACT_FORCE]
    kept[int(run.table[c, lane, ROW.STEP]) // episode.control_steps % kept.size] = force


@inlined
def force_in_front(episode, own, agent, row, place):
    """Contact force (N) that the one in front measured at a place ahead: between the nearest two readings."""
    front, kept = episode.front, episode.front.kept[row]
    stride = own[ROW.STRIDE] * episode.control_steps
    ago = max(front.behind[agent] - front.ahead[place], 0.0) / stride
    time, times, whole = int(own[ROW.STEP]) // episode.control_steps, kept.size, int(ago)
    later = kept[(time - whole + times * times) % times]
    earlier = kept[(time - whole - 1 + times * times) % times]
    return later + (ago - whole) * (earlier - later)
