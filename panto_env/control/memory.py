"""What a pantograph read and did at the places just ahead of it, one span ago and more.

Droppers, supports and sag repeat from span to span, and so does much of the contact force: what was felt at
the same share of earlier spans, and what was done there, foretells what comes. Place and contact force, as
read, and actions are kept for each control step and looked up by the place. Before a line's start the force
is that at rest and there are no actions.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..backend import inlined
from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.alignment import Alignment
from ..plant.sensors import READING
from ..plant.state import ROW
from .state import NOW, NOW_ROWS, TASK_ROW

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
    times: tuple[float, ...],
    spans: int,
    alignment: Alignment,
    shape: tuple[int, int],
    speeds: tuple[float, float],
    interval: float,
) -> MemoryArrays:
    """Arrays for rows with actions, ``shape``; times: until the places (s); speeds: lowest, highest (m/s).

    Raises InputError where the fastest train covers more than the shortest span until a place.
    """
    rows, actions = shape
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
