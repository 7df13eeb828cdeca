"""Tables of a benchmark for people."""

from __future__ import annotations

from itertools import groupby

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from panto_env.metrics.labels import LABELS, Label
from panto_env.terminal import number

from .run import Benchmark
from .statistics import Cell

WIDTH = 120
"""Columns that a table needs; in a narrower terminal the policies' names are folded."""
FIGURES = {  # and their decimals
    "cost_function": 0,
    "contact_loss": 2,
    "mean": 1,
    "std": 2,
    "max": 0,
    "min": 0,
    "max_uplift": 0,
    "effort": 1,
    "action_rate": 0,
}
ACTION_RATE = Label("rate of the commanded force, rms", "rate", "N/s")
SIGMA = "std"
LEGEND = (
    "Interquartile means over the seeds; Δσ against passive, pass by pass, with its 95 % bootstrap "
    "interval. F_m, σ, max and min of the force low-passed at 20 Hz. Ranked by CF for each line and "
    "speed, but only policies whose mean force lies within its range."
)


def tables(outcome: Benchmark) -> RenderableType:
    """One table per line, and a legend."""
    parts: list[RenderableType] = []
    cells = groupby(outcome.cells, key=lambda cell: (cell.catenary, cell.pantograph))
    for (names, cells_of_line), (first, last) in zip(cells, outcome.spans, strict=True):
        title = f"{' on '.join(reversed(names))}, spans {first}–{last}"
        parts += [*_table_of_line(list(cells_of_line), title), ""]
    return Group(*parts, Text(LEGEND, style="dim"))


def _table_of_line(cells: list[Cell], title: str) -> list[RenderableType]:
    """The table, and a sentence for each policy that is disqualified."""
    title += f", {cells[0].seeds} seed{'s' if cells[0].seeds > 1 else ''}"
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("km/h", justify="right")
    table.add_column("policy", overflow="fold")
    table.add_column("rank", justify="right")
    for name in FIGURES:
        table.add_column(_label(name).column, justify="right")
        if name == SIGMA:
            table.add_column("Δσ\n(N)", justify="right", no_wrap=True)
    disqualifications: list[RenderableType] = []
    for speed, cells_at_speed in groupby(cells, key=lambda cell: cell.speed_kmh):
        for k, cell in enumerate(cells_at_speed):
            values = []
            for name, decimals in FIGURES.items():
                values.append(number(_label(name).scale * cell.figures[name], decimals))
                if name == SIGMA:
                    values.append(_std_change(cell))
            rank = "–" if cell.rank is None else str(cell.rank)
            style = "red" if cell.disqualified else "bold" if cell.rank == 1 else ""
            table.add_row(f"{speed:g}" if k == 0 else "", cell.policy, rank, *values, style=style)
            if cell.disqualified:
                sentence = f"{cell.policy} at {speed:g} km/h is disqualified: {cell.disqualified}."
                disqualifications.append(Text(sentence, style="red"))
        table.add_section()
    return [table, *disqualifications]


def _label(name: str) -> Label:
    return ACTION_RATE if name == "action_rate" else LABELS[name]


def _std_change(cell: Cell) -> str:
    """Change of sigma against passive, with its interval where there is one."""
    if cell.std_interval is None:
        return number(cell.std_change, 2)
    low, high = cell.std_interval
    return f"{cell.std_change:+.2f} ({low:+.2f} to {high:+.2f})"
