"""What ``panto speed`` says of its measurements: tables and sentences, for the terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from .measure import LINE_SPANS, SHARED, SINGLE_YARDSTICK, SPEED_KMH, VECTOR_YARDSTICK

BEGIN, END = "<!-- panto speed --markdown -->", "<!-- end -->"
"""Between these a document holds what the command printed."""
Row = dict[str, Any]


class Sheet(NamedTuple):
    """A table: its first column names, the others hold figures."""

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def machine(result: Row) -> str:
    """Where and how it was measured."""
    own = result["machine"]
    return f"{own['processor']}, Python {own['python']}; medians of {result['repeats']}."


def summary(result: Row) -> Sheet:
    """Plants and environments, each beside its yardstick."""
    rows = []
    for row in result["plants"]:
        own, cells = row["times_real_time"], ("–", "–")
        if row["id"] == "Pantograph-v0":  # the plant whose arithmetic is counted
            bound = result["roofline"]["bound"]
            cells = (f"limit of the core: {bound:,.0f}", _ratio(own, bound))
        rows.append((f"plant of `{row['id']}`, one core", f"{own:,.0f} × real time", *cells))
    measured = {(row["id"], row["lanes"]): row for row in result["environments"]}
    singles = [(row["id"], None) for row in result["plants"]]
    for name, lanes in (*singles, *SHARED):
        row, yardstick = measured[name, lanes], SINGLE_YARDSTICK if lanes is None else VECTOR_YARDSTICK
        own, other = (each["steps_per_second"] for each in (row, measured[yardstick, lanes]))
        shown = _lanes(row) if lanes is None else f"{_lanes(row)}, {_count(row['cores'], 'core')}"
        cells = (f"`{yardstick}`: {other:,.0f}", _ratio(own, other))
        rows.append((f"`{name}`, {shown}", f"{own:,.0f} steps/s", *cells))
    return Sheet("Beside yardsticks", ("", "speed", "yardstick", "ratio"), rows)


def details(result: Row) -> list[Sheet | str]:
    """All else: plants and their settings, environments by lanes and by cores."""
    scaling = result["scaling"]
    plants = [(row["catenary"], row) for row in result["plants"]]
    modes = [(str(row["modes"]), row) for row in scaling["modes"]]
    flexible = f"the flexible catenary, a line of {LINE_SPANS} spans"
    spans = [(f"{row['spans']}{', the whole line' * row['whole_line']}", row) for row in scaling["spans"]]
    grids = [
        (f"{row['spacing']:.2f} m, {1e3 * row['time_step']:.1f} ms, {row['precision']}", row)
        for row in scaling["discretisation"]
    ]
    environments = [(f"{row['id']}, {_lanes(row)}", row) for row in result["environments"]]
    cores = [(f"{row['id']}, {_lanes(row)}, {_count(row['cores'], 'core')}", row) for row in scaling["cores"]]
    return [
        _plants(f"Plants, one core, {SPEED_KMH:g} km/h", "catenary", plants),
        _limits(result["roofline"]),
        _plants(f"Spans computed of {flexible}", "spans", spans),
        _plants("Modes of the three-span catenary", "modes", modes),
        _plants(f"Grid, time step and precision of {flexible}", "grid, step, precision", grids),
        _environments("Environments", environments),
        _environments("Vector environments by cores", cores)
        if cores
        else "This platform does not let a process choose its cores: the cost by cores is not measured.",
    ]


def markdown(result: Row) -> tuple[str, str]:
    """The table of README.md and those of docs/speed.md, each between its markers."""
    first = _marked([machine(result), _table(summary(result))])
    parts = [
        part if isinstance(part, str) else f"**{part.title}**\n\n{_table(part)}" for part in details(result)
    ]
    return first, _marked([machine(result), *parts])


def _marked(parts: Sequence[str]) -> str:
    return "\n\n".join((BEGIN, *parts, END)) + "\n"


def _table(sheet: Sheet) -> str:
    rule = ("---", *("---:" for _ in sheet.headings[1:]))
    return "\n".join(f"| {' | '.join(row)} |" for row in (sheet.headings, rule, *sheet.rows))


def _limits(found: Row) -> str:
    return (
        f"Flexible plant: {found['arithmetic']:.1f} GFLOP/s of {found['multiply_add']:.0f} that one core "
        f"multiplies and adds in registers, {found['traffic']:.0f} GB/s of {found['cache']:.0f} that it "
        f"moves in the nearest cache; at the nearer limit it would run {found['bound']:,.0f} × real time."
    )


def _plants(title: str, key: str, rows: Sequence[tuple[str, Row]]) -> Sheet:
    headings = (key, "× real time", "slowest", "fastest", "first call (s)")
    cells = []
    for name, row in rows:
        factors = (f"{row[each]:,.0f}" for each in ("times_real_time", "slowest", "fastest"))
        cells.append((name, *factors, f"{row['first_call']:.2f}"))
    return Sheet(title, headings, cells)


def _environments(title: str, rows: Sequence[tuple[str, Row]]) -> Sheet:
    cells = []
    for name, row in rows:
        rates = (f"{row[each]:,.0f}" for each in ("steps_per_second", "slowest", "fastest"))
        cells.append((name, *rates))
    return Sheet(title, ("environment", "steps/s", "slowest", "fastest"), cells)


def _lanes(row: Row) -> str:
    return "single" if row["lanes"] is None else _count(row["lanes"], "lane")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _ratio(own: float, yardstick: float) -> str:
    return f"{own / yardstick:.2g}"
