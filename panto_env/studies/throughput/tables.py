"""What ``panto speed`` says of its measurements: tables and sentences, for the terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...base.table import Table
from .environments import SHARED, SINGLE_YARDSTICK, VECTOR_YARDSTICK
from .plants import COUNTED, LINE_SPANS, SPEED_KMH

BEGIN, END = "<!-- panto speed --markdown -->", "<!-- end -->"
"""Between these a document holds what the command printed."""
Row = dict[str, Any]


def machine(result: Row) -> str:
    """Where and how it was measured."""
    processor, python = result["machine"]["processor"], result["machine"]["python"]
    return f"{processor}, Python {python}; medians of {result['repeats']}."


def summary(result: Row) -> Table:
    """Plants and environments, each beside its yardstick."""
    rows = []
    for row in result["plants"]:
        speed, cells = row["times_real_time"], ("–", "–")
        if row["id"] == COUNTED:
            bound = result["roofline"]["bound"]
            cells = (f"limit of the core: {bound:,.0f}", _ratio(speed, bound))
        rows.append((f"plant of `{row['id']}`, one core", f"{speed:,.0f} × real time", *cells))
    measured = {(row["id"], row["lanes"]): row for row in result["environments"]}
    singles = [(row["id"], None) for row in result["plants"]]
    for name, lanes in (*singles, *SHARED):
        row, yardstick = measured[name, lanes], SINGLE_YARDSTICK if lanes is None else VECTOR_YARDSTICK
        rate, reference = row["steps_per_second"], measured[yardstick, lanes]["steps_per_second"]
        environment = _lanes(row) if lanes is None else f"{_lanes(row)}, {_count(row['cores'], 'core')}"
        cells = (f"`{yardstick}`: {reference:,.0f}", _ratio(rate, reference))
        rows.append((f"`{name}`, {environment}", f"{rate:,.0f} steps/s", *cells))
    return Table("Beside yardsticks", ("", "speed", "yardstick", "ratio"), rows)


def details(result: Row) -> list[Table | str]:
    """All else: plants and their settings, environments by lanes and by cores."""
    scaling = result["scaling"]
    plants = [(row["catenary"], row) for row in result["plants"]]
    modes = [(str(row["modes"]), row) for row in scaling["modes"]]
    flexible = f"the flexible catenary, a line of {LINE_SPANS} spans"
    spans = [(f"{row['spans']}{', the whole line' * row['whole_line']}", row) for row in scaling["spans"]]
    grids = [
        (
            f"{row['speed_kmh']:g} km/h, {row['accuracy']}: {row['spacing']:.3g} m, "
            f"{1e3 * row['time_step']:.3g} ms, {row['precision']}",
            row,
        )
        for row in scaling["discretisation"]
    ]
    environments = [(f"{row['id']}, {_lanes(row)}", row) for row in result["environments"]]
    cores = [(f"{row['id']}, {_lanes(row)}, {_count(row['cores'], 'core')}", row) for row in scaling["cores"]]
    return [
        _plants(f"Plants, one core, {SPEED_KMH:g} km/h", "catenary", plants),
        _limits(result["roofline"]),
        _plants(f"Spans computed of {flexible}", "spans", spans),
        _plants("Modes of the three-span catenary", "modes", modes),
        _plants(f"Speed, accuracy and precision of {flexible}", "speed, accuracy, grid, step", grids),
        _environments("Environments", environments),
        _environments("Vector environments by cores", cores)
        if cores
        else "This platform does not let a process choose its cores: the cost by cores is not measured.",
    ]


def markdown(result: Row) -> tuple[str, str]:
    """The table of README.md and those of docs/speed.md, each between its markers."""
    first = _marked([machine(result), summary(result).markdown])
    parts = [
        part if isinstance(part, str) else f"**{part.title}**\n\n{part.markdown}" for part in details(result)
    ]
    return first, _marked([machine(result), *parts])


def _marked(parts: Sequence[str]) -> str:
    return "\n\n".join((BEGIN, *parts, END)) + "\n"


def _limits(roofline: Row) -> str:
    return (
        f"Flexible plant: {roofline['arithmetic']:.1f} GFLOP/s of {roofline['multiply_add']:.0f} "
        f"that one core multiplies and adds in registers, {roofline['traffic']:.0f} GB/s of "
        f"{roofline['cache']:.0f} that it moves in the nearest cache; at the nearer limit it would run "
        f"{roofline['bound']:,.0f} × real time."
    )


def _plants(title: str, key: str, rows: Sequence[tuple[str, Row]]) -> Table:
    headings = (key, "× real time", "slowest", "fastest", "first call (s)")
    cells = []
    for label, row in rows:
        factors = (f"{row[name]:,.0f}" for name in ("times_real_time", "slowest", "fastest"))
        cells.append((label, *factors, f"{row['first_call']:.2f}"))
    return Table(title, headings, cells)


def _environments(title: str, rows: Sequence[tuple[str, Row]]) -> Table:
    cells = []
    for label, row in rows:
        rates = (f"{row[name]:,.0f}" for name in ("steps_per_second", "slowest", "fastest"))
        cells.append((label, *rates))
    return Table(title, ("environment", "steps/s", "slowest", "fastest"), cells)


def _lanes(row: Row) -> str:
    return "single" if row["lanes"] is None else _count(row["lanes"], "lane")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _ratio(speed: float, yardstick: float) -> str:
    return f"{speed / yardstick:.2g}"
