"""The contact as text for a terminal: force and height of the head along the last spans."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, ConsoleOptions, RenderResult
from rich.live import Live
from rich.text import Text

from ..base.arrays import Array, to_kmh
from ..control import Task
from ..metrics import compliance as en50367
from ..plant.state import Row
from .moment import Rider, felt, position_of, shown_collector, train_of

SPANS = 3.0  # length of the shown part of the line (spans)
FORCE_ROWS, HEIGHT_ROWS = 10, 6
WIDE = 120  # maximum number of columns
AXIS = 9  # columns for the numbers next to a chart
EMPTY = "\u2800"
DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bits of the dots in a character of Unicode's Braille patterns: four rows of two."""


class Strip:
    """Contact force and head height of a task's first lane, drawn as wide as the terminal."""

    def __init__(self, task: Task, policy: str) -> None:
        """policy: its name. The task must keep its samples."""
        plant = task.plant
        lane, collector = shown_collector(task, 0)
        which = f"pantograph {collector + 1} of " if len(plant.train.collectors) > 1 else ""
        where = f"{which}{task.settings.names} on {plant.catenary.name} at {to_kmh(task.speed[0]):.4g} km/h"
        self._title = f"{where}, policy {policy}"
        self._share = plant.of(0, Row.STEP) / task.end(0)
        self._felt, self._position = felt(task, lane, SPANS, collector), position_of(task, lane, collector)
        train = train_of(task, lane, collector)
        self._riders = () if train is None else train.riders
        self._alignment = plant.alignment
        self._time = plant.of(0, Row.STEP) * plant.time_step
        self._standard = en50367.maximum_source(plant.catenary.system)
        self._limit = en50367.maximum_limit(float(task.speed[0]), plant.catenary.system)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        width = min(options.max_width, WIDE)
        columns = width - AXIS
        seen, length = self._felt, SPANS * self._alignment.mean_length
        begin = max(0.0, self._position - length)
        across = (seen.places - begin) / length * columns  # columns from the left
        yield Text(self._title, style="bold", no_wrap=True, overflow="ellipsis")
        done = round(self._share * width)
        yield Text.assemble(("━" * done, "bright_blue"), ("━" * (width - done), "dim"))
        limit = f"╌ limit of {self._standard}"
        yield Text(f"contact force (N), low-passed at 20 Hz; {limit}; x contact lost", style="dim")
        yield from self._force_chart(across, columns)
        yield Text("height of the head (mm); 0: contact wire without sag", style="dim")
        yield from chart(across, 1e3 * seen.head, _round(1e3 * seen.head), HEIGHT_ROWS, columns)
        ends = f"{begin:.0f} m", f"{begin + length:.0f} m"
        yield Text(" " * AXIS + ends[0] + ends[1].rjust(columns - len(ends[0])), style="dim")
        yield Text(self._in_words())
        if self._riders:
            yield Text("  ".join(map(_rider_in_words, range(1, len(self._riders) + 1), self._riders)))

    def _in_words(self) -> str:
        name = self._alignment.span_name
        where, force = f"{self._time:.2f} s  {self._position:.0f} m", self._felt.filtered
        if not force.size:
            return where
        return (
            f"{where}, span {name(self._alignment.span_of(self._felt.places[-1]))}  force {force[-1]:.0f} N  "
            f"shown part: mean {force.mean():.0f} N, σ {force.std():.0f} N"
        )

    def _force_chart(self, across: Array, columns: int) -> list[Text]:
        seen = self._felt
        highest = max(self._limit, float(seen.filtered.max(initial=0.0)))
        lines = chart(across, seen.filtered, (0.0, 1.1 * highest), FORCE_ROWS, columns, self._limit)
        marks = np.full(columns, " ")
        marks[_column(across[seen.force <= 0], columns)] = "x"
        return [*lines, Text.assemble(" " * AXIS, ("".join(marks), "bold red"))]


def _rider_in_words(number: int, rider: Rider) -> str:
    if rider.filtered.size < 2:
        return f"{number}: {rider.position:.0f} m"
    near = rider.filtered[-1]
    return f"{number} {rider.name}: {rider.position:.0f} m, {near:.0f} N, σ {rider.filtered.std():.0f} N"


def chart(
    across: Array,
    values: Array,
    extent: tuple[float, float],
    rows: int,
    columns: int,
    line: float | None = None,
) -> list[Text]:
    """A curve in Braille, as rows of text, labelled with the ends of its extent.

    across: (n,), increasing, in columns from the left. values: (n,). extent: minimum and maximum drawn value;
    others are drawn at the edge. line: value of a level line.
    """
    low, high = extent
    dots = np.zeros((4 * rows, 2 * columns), dtype=bool)
    up = np.clip((values - low) / (high - low), 0.0, 1.0) * (4 * rows - 1)
    place = _column(2 * across, 2 * columns)
    level = 4 * rows - 1 - np.round(up).astype(int)
    # A curve's neighbours are joined, so that it has no gaps where it is steep.
    for k in range(len(place)):
        first, last = sorted((level[k], level[max(0, k - 1)]))
        dots[first : last + 1, place[k]] = True
    beside = {0: f"{high:.0f}", rows - 1: f"{low:.0f}"}
    lined = None
    if line is not None:
        lined = round((high - line) / (high - low) * (rows - 1))
        beside[lined] = f"{line:.0f}"
    texts = []
    for row, characters in enumerate(_characters(dots)):
        text = Text.assemble((f"{beside.get(row, ''):>{AXIS - 2}} │", "dim"), no_wrap=True, overflow="crop")
        curve = "".join(characters)
        text.append(curve.replace(EMPTY, "╌") if row == lined else curve, style="bright_blue")
        if row == lined:
            text.highlight_regex("╌+", style="red")
        texts.append(text)
    return texts


def _characters(dots: NDArray[np.bool_]) -> NDArray[np.str_]:
    """Braille characters, (rows, columns), of dots, (4 rows, 2 columns)."""
    rows, columns = dots.shape[0] // 4, dots.shape[1] // 2
    cells = dots.reshape(rows, 4, columns, 2).transpose(0, 2, 1, 3)
    codes = ord(EMPTY) + (cells * DOTS).sum(axis=(2, 3))
    return np.array([[chr(code) for code in row] for row in codes.tolist()])


def _column(across: Array, columns: int) -> NDArray[np.intp]:
    return np.asarray(np.clip(across.astype(int), 0, columns - 1))


def _round(heights: Array) -> tuple[float, float]:
    """Extent of heights (mm), in tens of millimetres."""
    if not heights.size:
        return 0.0, 10.0
    low, high = 10 * np.floor(heights.min() / 10), 10 * np.ceil(heights.max() / 10)
    return float(low), float(max(high, low + 10))


INTERVAL = 0.1  # time (s) between two pictures


@contextmanager
def live(console: Console, policy: str) -> Iterator[Callable[[Task], None]]:
    """Show a task's first lane on a terminal while the body runs; yields a function of the task.

    policy: its name. The last picture stays. The cursor is restored in any case.
    """
    with Live(Text("preparing the line"), console=console, auto_refresh=False) as shown:
        latest: list[Task] = []
        drawn = 0.0

        def watch(task: Task) -> None:
            nonlocal drawn
            latest[:] = [task]
            now = time.monotonic()
            if now >= drawn + INTERVAL:
                shown.update(Strip(task, policy), refresh=True)
                drawn = now

        yield watch
        if latest:
            shown.update(Strip(latest[0], policy), refresh=True)
