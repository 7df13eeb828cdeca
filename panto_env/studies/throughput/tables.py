"""What ``panto speed`` says of its measurements: tables and sentences, for the terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...base.table import Table
from .plants import COUNTED, LINE_SPANS, SPEED_KMH

BEGIN, END = "<!-- panto speed --markdown -->", "<!-- end -->"
"""Between these a document holds what the command printed."""
Row = dict[str, Any]


def machine(result: Row) -> str:
    """Where and how it was measured."""
    here = result["machine"]
    return (
        f"{here['processor']} ({here['family']}, vectors of {here['vector_bits']} bits), "
        f"{_count(here['cores'], 'core')}, Python {here['python']}; medians of {result['repeats']}."
    )


def _numbers(results: Sequence[Row]) -> list[str]:
    """Column that distinguishes machines; empty for a single one."""
    return [f"({k + 1})" for k in range(len(results))] if len(results) > 1 else [""]


def machines(results: Sequence[Row]) -> list[str]:
    """Where and how each was measured, numbered where they are several."""
    numbered = zip(_numbers(results), results, strict=True)
    return [f"{number} {machine(result)}".strip() for number, result in numbered]


def summary(results: Sequence[Row]) -> Table:
    """Plants, and environments over yardsticks, of one machine or several, side by side."""
    columns = [_summary(result) for result in results]
    headings = [f"{what} {number}".strip() for number in _numbers(results) for what in ("speed", "ratio")]
    rows = [
        (label, *(cell for column in columns for cell in column.get(label, ("–", "–"))))
        for label in dict.fromkeys(label for column in columns for label in column)
    ]
    return Table("Beside yardsticks", ("", *headings), rows)


def _summary(result: Row) -> dict[str, tuple[str, str]]:
    rows: dict[str, tuple[str, str]] = {}
    for row in result["plants"]:
        speed, ratio, over = row["times_real_time"], "–", ""
        if row["id"] == COUNTED:
            ratio, over = f"{speed / result['roofline']['bound']:.2g}", " over the core's limit"
        rows[f"plant of `{row['id']}`, one core{over}"] = f"{speed:,.0f} × real time", ratio
    singles = [row for row in result["environments"] if row["lanes"] is None]
    for row in (*singles, *result["scaling"]["cores"]):
        where = "" if row["lanes"] is None else f", {_count(row['cores'], 'core')}"
        label = f"{_environment(row)}{where}, over `{row['yardstick']}`"
        rows[label] = f"{row['steps_per_second']:,.0f} steps/s", f"{row['ratio']:.2g}"
    return rows


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
    lines = scaling.get("lines", [])  # older results have none
    of_lines = [
        (f"{row['line']}, {row['times_real_time'] / lines[0]['times_real_time']:.2f} of the speed", row)
        for row in lines
    ]
    trains = scaling.get("trains", [])  # older results have none
    alone = trains[0]["times_real_time"] if trains else 0.0
    of_trains = [
        (f"{row['pantographs']}, {alone / row['times_real_time']:.2f} of the time", row) for row in trains
    ]
    environments = [(_environment(row), row) for row in result["environments"]]
    cores = [(f"{_environment(row)}, {_count(row['cores'], 'core')}", row) for row in scaling["cores"]]
    return [
        _plants(f"Plants, one core, {SPEED_KMH:g} km/h", "catenary", plants),
        _limits(result["roofline"]),
        _plants(f"Spans computed of {flexible}", "spans", spans),
        _plants("Modes of the three-span catenary", "modes", modes),
        _plants(f"Speed, accuracy and precision of {flexible}", "speed, accuracy, grid, step", grids),
        *([_plants("Lines, their window travelling", "line", of_lines)] if lines else []),
        *([_plants("Pantographs, 20 spans computed", "pantographs", of_trains)] if trains else []),
        _environments("Environments", environments),
        _environments("Vector environments by cores", cores)
        if cores
        else "This platform does not let a process choose its cores: the cost by cores is not measured.",
    ]


def markdown(results: Sequence[Row]) -> tuple[str, str]:
    """The two blocks of docs/speed.md, of all machines and of the first one, each between its markers."""
    first = _marked(["  \n".join(machines(results)), summary(results).markdown])
    parts = [
        part if isinstance(part, str) else f"**{part.title}**\n\n{part.markdown}"
        for part in details(results[0])
    ]
    return first, _marked([machine(results[0]), *parts])


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
        reference = f"{row['yardstick_steps_per_second']:,.0f}"
        cells.append((label, *rates, row["yardstick"], reference, f"{row['ratio']:.2g}"))
    return Table(title, ("environment", "steps/s", "slowest", "fastest", "yardstick", "its", "ratio"), cells)


def _environment(row: Row) -> str:
    lanes = "single" if row["lanes"] is None else _count(row["lanes"], "lane")
    return f"`{row['id']}`{', ideal actuator and sensors' * row['ideal']}, {lanes}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
