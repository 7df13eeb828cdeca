"""Observation normalised by a passive run, so that entries have a mean near 0 and a spread near 1.

The mean of a reading depends on the speed, nearly linearly, as the uplift does: so the centre of an entry is
linear in the speed. The scale is the same at all speeds, so that a swing twice as large reads twice as much.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.errors import InputError
from .entries import CENTRES, READING_ENTRIES, Entry, present
from .observation import Layout
from .passive_run import PassiveRun

_ROWS = {name: row for row, (name, _, _) in enumerate(READING_ENTRIES)}
_ROWS["remembered force"] = _ROWS["contact force"]


def normalised(layout: Layout, run: PassiveRun, speed_kmh: tuple[float, float]) -> Layout:
    """The layout with speed and readings, present and earlier, normalised by a passive run.

    speed_kmh: the given range of speeds (km/h). Raises InputError where a reading has no spread.
    """
    entries = tuple(_normalised(entry, run) for entry in layout.entries)
    return replace(layout, entries=entries, normalise=speed_kmh)


def _normalised(entry: Entry, run: PassiveRun) -> Entry:
    if entry.name == "speed":
        half = 0.5 * float(run.speeds[-1] - run.speeds[0])
        return entry._replace(centre=float(run.speeds.mean()), scale=half or CENTRES["speed"][1])
    row = _ROWS.get(present(entry))
    if row is None:
        return entry
    scale = float(np.sqrt(np.mean(run.spreads(row) ** 2)))
    if scale == 0.0:
        raise InputError(
            f"The {present(entry)} does not change in a passive run, so it cannot be scaled by its spread; "
            "leave out normalise."
        )
    means, several = run.means(row), len(run.speeds) > 1
    slope, centre = np.polyfit(run.speeds, means, 1) if several else (0.0, means[0])
    return entry._replace(centre=float(centre), slope=float(slope), scale=scale)
