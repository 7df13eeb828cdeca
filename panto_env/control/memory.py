"""What was measured earlier at the places ahead of a pantograph, by the one in front of it and by itself.

The contact force that the sensors of the one in front read, with their delay and noise, is kept for each
control step until the one behind has come to the place, as a train's data bus tells it.

Droppers, supports and sag repeat from span to span, and so does much of the contact force: what was felt and
done at the same share of earlier spans foretells what comes. It is kept for each control step and looked up
by the place. Before a line's start the force is that at rest and there are no actions.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..backend import NOT_NEGATIVE, inlined
from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.alignment import Alignment
from ..plant.sensors import READING, Reading
from ..plant.speed import DRIFT_ROWS
from ..plant.state import ROW, PerCollector, per_collector
from ..plant.train import Train, position
from .state import NOW, NOW_ROWS, TASK_ROW


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
    gaps = np.diff([own.distance for own in collectors], prepend=collectors[0].distance)
    behind = gaps[list(driven)]
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
def force_in_front(episode, run, own, agent, lane, row, place):
    """Contact force (N) that the one in front measured at a place ahead: between the nearest two readings."""
    front, kept = episode.front, episode.front.kept[row]
    stride = own[ROW.STRIDE] * episode.control_steps
    since = max(front.behind[agent] - front.ahead[place], 0.0)  # distance since then
    ago = since / stride
    if run.drift.shape[1] > DRIFT_ROWS:  # a profile: the time is that of the train's own way
        here = position(run, 0, lane, own[ROW.STEP])
        for _ in range(8):
            then = own[ROW.STEP] - ago * episode.control_steps
            ago += (since - (here - position(run, 0, lane, then))) / stride
            ago = min(max(ago, 0.0), kept.size - 2.0)
    time, times, whole = int(own[ROW.STEP]) // episode.control_steps, kept.size, int(ago)
    later = kept[(time - whole + times * times) % times]
    earlier = kept[(time - whole - 1 + times * times) % times]
    return later + (ago - whole) * (earlier - later)


BEFORE = -1e9
"""Place (spans) of what has not been kept yet: before every place that is looked up."""
LONGER = 1.1
"""Steps kept, relative to those in which the slowest train covers the longest spans: odometers err."""


class MemoryArrays(NamedTuple):
    """What is kept of earlier spans; arrays without columns where nothing of them is observed."""

    ahead: Array  # (times,): control steps until a controlled pantograph comes to each place
    spans: int  # number of earlier spans
    kept: Array  # (rows, steps, 2 + actions): place (spans), contact force (N), actions; step n in n % steps


def memory_arrays(
    layout: Any, alignment: Alignment, shape: tuple[int, int], speeds: tuple[float, float], interval: float
) -> MemoryArrays:
    """Arrays for rows with actions, ``shape``, as a ``Layout`` asks for; speeds: lowest, highest (m/s).

    Raises InputError where the fastest train covers more than the shortest span until a place.
    """
    (rows, actions), times, spans = shape, layout.memory, layout.memory_spans
    if not times:
        return MemoryArrays(np.zeros(0), 0, np.zeros((rows, 0, 2 + actions)))
    shortest, longest = float(alignment.lengths.min()), float(alignment.lengths.max())
    if times[-1] * speeds[1] > shortest:
        raise InputError(
            f"memory must be at most {shortest / speeds[1]:.3g} s: in {times[-1]:g} s the fastest train "
            f"covers more than the shortest span, {shortest:g} m."
        )
    steps = math.ceil(LONGER * spans * longest / (speeds[0] * interval)) + 2
    return MemoryArrays(np.array(times) / interval, spans, np.zeros((rows, steps, 2 + actions)))


def forget(memory: MemoryArrays, rows: Any, force: Array) -> None:
    """Begin at a line's start with the contact force at rest, (n,), in these rows."""
    memory.kept[rows] = 0.0
    memory.kept[rows, :, 0] = BEFORE
    memory.kept[rows, :, 1] = force[:, None]


@inlined
def keep_and_recall(episode, own, task, now, row):
    """Keep what is read and was done last; write what was, at places ahead, in earlier spans.

    A place looked up lies between those of two steps; the force and the actions between theirs.
    """
    memory, kept, first = episode.memory, episode.memory.kept[row], NOW_ROWS + episode.front.ahead.size
    steps, time = kept.shape[0], int(own[ROW.STEP]) // episode.control_steps
    kept[time % steps, 0] = now[NOW.SPANS]
    kept[time % steps, 1] = now[NOW.READING + READING.CONTACT_FORCE]
    for a in range(episode.places.size):
        kept[time % steps, 2 + a] = task[TASK_ROW.ACTION + a]
    per_step = now[NOW.SPEED] * episode.time_step * episode.control_steps / episode.alignment.mean_length
    for span in range(memory.spans):
        # The farthest place first: from there to the nearest the search goes back only.
        ago = 0
        for place in range(memory.ahead.size - 1, -1, -1):
            sought = now[NOW.SPANS] + per_step * memory.ahead[place] - (span + 1.0)
            while ago < steps - 2 and kept[(time - ago + steps) % steps, 0] > sought:
                ago += 1
            later = kept[(time - max(ago - 1, 0) + steps) % steps]
            earlier = kept[(time - ago + steps) % steps]
            way = later[0] - earlier[0]
            share = min(max((later[0] - sought) / way, 0.0), 1.0) if 0.0 < way < 1.0 else 0.0
            for k in range(1, kept.shape[1]):
                number = ((k - 1) * memory.spans + span) * memory.ahead.size + place
                now[first + number] = later[k] + share * (earlier[k] - later[k])
