"""A run drawn in the terminal as it goes: the contact force over the last span, and numbers."""

from __future__ import annotations

from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.text import Text

from ..base.arrays import Array
from ..control import Task
from .moment import Moment, moment_of

ROWS, COLUMNS = 12, 72
"""Of the chart, in letters."""
EIGHTHS = " ▁▂▃▄▅▆▇█"
EVERY = 5
"""Control steps between two drawings: twenty a second at 10 ms, were it to run in real time."""


class Strip:
    """Draws lane 0 of a task, call after call; within a ``with``, at whose end the terminal is as before."""

    def __init__(self, console: Console) -> None:
        """console: where to draw."""
        self._live = Live(console=console, transient=True, refresh_per_second=20)
        self._steps = 0

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def __call__(self, task: Task) -> None:
        """Draw what the task is doing now, every few steps."""
        self._steps += 1
        if self._steps % EVERY == 1:
            self._live.update(strip(moment_of(task, 0, "", {})))


def strip(moment: Moment) -> Text:
    """The force as bars, low-passed, the latest at the right; below it the wire's height and numbers."""
    force = binned(moment.places, moment.filtered, moment.position, moment.span_length)
    text = Text()
    filled = np.nan_to_num(np.clip(force / moment.largest_force, 0.0, 1.0)) * ROWS
    for row in reversed(range(ROWS)):
        level = moment.largest_force * (row + 1) / ROWS
        bars = "".join(EIGHTHS[round(8 * min(max(each - row, 0.0), 1.0))] for each in filled)
        text.append(f"{level:5.0f} N ", style="dim")
        text.append(f"{bars}\n", style="blue")
    marks = "".join("!" if each <= 0 else " " for each in np.nan_to_num(force, nan=1.0))
    text.append(f"        {marks}  ! no contact\n", style="red" if "!" in marks else "dim")
    now = moment.filtered[-1] if moment.filtered.size else moment.nominal_force
    text.append(
        f"{moment.position:7.0f} m, {moment.time:6.2f} s   contact force {now:4.0f} N   "
        f"wire {1e3 * moment.wire:+4.0f} mm   "
        + "   ".join(f"{place.name.lower()} {value:+4.0f} N" for place, value in moment.actuators.items())
    )
    return text


def binned(places: Array, values: Array, position: float, span_length: float) -> Array:
    """Values at places up to ``position`` (m) in bins over the last span: means, nan where none."""
    edges = np.linspace(position - span_length, position, COLUMNS + 1)
    which = np.digitize(places, edges) - 1
    inside = (which >= 0) & (which < COLUMNS)
    count = np.bincount(which[inside], minlength=COLUMNS)
    total = np.bincount(which[inside], weights=values[inside], minlength=COLUMNS)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / count)
