"""What ``panto speed`` says of its measurements: tables and sentences, as Markdown too, and plots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...base.plotting import legend_above, panels, series_colour
from ...base.table import Table
from ..study import Cell, Columns, tabled
from .study import COUNTED, LINE_SPANS, SPEED_KMH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    """What distinguishes machines; empty for a single one."""
    return [f" ({k + 1})" for k in range(len(results))] if len(results) > 1 else [""]


def machines(results: Sequence[Row]) -> list[str]:
    """Where and how each was measured, numbered where they are several."""
    numbered = zip(_numbers(results), results, strict=True)
    return [f"{number} {machine(result)}".strip() for number, result in numbered]


def summary(results: Sequence[Row]) -> Table:
    """Plants, and environments over yardsticks, of one machine or several, side by side."""
    columns = [_summary(result) for result in results]
    headings = [f"{what}{number}" for number in _numbers(results) for what in ("speed", "ratio")]
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
    flexible = f"the flexible catenary, a line of {LINE_SPANS} spans"
    lines, trains = (scaling.get(name, []) for name in ("lines", "trains"))  # older results have none

    def grid(row: Row) -> str:
        how = f"{row['spacing']:.3g} m, {1e3 * row['time_step']:.3g} ms, {row['precision']}"
        return f"{row['speed_kmh']:g} km/h, {row['accuracy']}: {how}"

    def of_line(row: Row) -> str:
        return f"{row['line']}, {row['times_real_time'] / lines[0]['times_real_time']:.2f} of the speed"

    def of_train(row: Row) -> str:
        return (
            f"{row['pantographs']}, {trains[0]['times_real_time'] / row['times_real_time']:.2f} of the time"
        )

    def on_cores(row: Row) -> str:
        return f"{_environment(row)}, {_count(row['cores'], 'core')}"

    def plants(title: str, key: str, rows: Sequence[Row], name: Cell) -> Table:
        return tabled(title, ((key, name), *PLANT), rows)

    def spans(row: Row) -> str:
        return f"{row['spans']}{', the whole line' * row['whole_line']}"

    parts: list[Table | str] = [
        plants(f"Plants, one core, {SPEED_KMH:g} km/h", "catenary", result["plants"], "{[catenary]}"),
        _limits(result["roofline"]),
        plants(f"Spans computed of {flexible}", "spans", scaling["spans"], spans),
        plants("Modes of the three-span catenary", "modes", scaling["modes"], "{[modes]}"),
        plants(
            f"Speed, accuracy and precision of {flexible}",
            "speed, accuracy, grid, step",
            scaling["discretisation"],
            grid,
        ),
    ]
    if lines:
        parts.append(plants("Lines, their window travelling", "line", lines, of_line))
    if trains:
        parts.append(plants("Pantographs, 20 spans computed", "pantographs", trains, of_train))
    parts.append(tabled("Environments", (("environment", _environment), *SPEED), result["environments"]))
    if not scaling["cores"]:
        without = "This platform does not let a process choose its cores: the cost by cores is not measured."
        return [*parts, without]
    of_cores = (("environment", on_cores), *SPEED)
    return [*parts, tabled("Vector environments by cores", of_cores, scaling["cores"])]


def markdown(results: Sequence[Row]) -> tuple[str, str]:
    """Blocks between markers: of all machines, as in docs/speed.md; of the first one, some tables there."""
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


SPREAD: Columns = (("slowest", "{[slowest]:,.0f}"), ("fastest", "{[fastest]:,.0f}"))
PLANT: Columns = (
    ("× real time", "{[times_real_time]:,.0f}"),
    *SPREAD,
    ("first call (s)", "{[first_call]:.2f}"),
)
SPEED: Columns = (
    ("steps/s", "{[steps_per_second]:,.0f}"),
    *SPREAD,
    ("yardstick", "{[yardstick]}"),
    ("its", "{[yardstick_steps_per_second]:,.0f}"),
    ("ratio", "{[ratio]:.2g}"),
)


def _environment(row: Row) -> str:
    lanes = "single" if row["lanes"] is None else _count(row["lanes"], "lane")
    return f"`{row['id']}`{', ideal actuator and sensors' * row['ideal']}, {lanes}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def plot_speed(result: Row) -> Figure:
    """How cost grows on a machine: plants over spans and modes, vector environments over lanes, cores."""
    figure, ((by_spans, by_modes), (by_lanes, by_cores)) = panels((10, 8), 2, 2)
    scaling = result["scaling"]
    _draw_plants(by_spans, scaling["spans"], "spans", "spans computed, flexible catenary")
    _draw_plants(by_modes, scaling["modes"], "modes", "modes, three-span catenary")
    _draw_lanes(by_lanes, [row for row in result["environments"] if row["lanes"] is not None])
    _draw_cores(by_cores, scaling["cores"])
    for axis in figure.axes:
        axis.grid(color="0.9")
    figure.suptitle(f"{result['machine']['processor']}, medians of {result['repeats']}")
    return figure


def _draw_plants(axis: Axes, rows: Sequence[Row], key: str, label: str) -> None:
    values = [row[key] for row in rows]
    axis.plot(values, [1e3 / row["times_real_time"] for row in rows], "o-", color=series_colour(0))
    axis.set(xlabel=label, ylabel="one core, ms per simulated second", xticks=values)
    axis.set(xlim=(0, None), ylim=(0, None))


def _draw_lanes(axis: Axes, rows: Sequence[Row]) -> None:
    for k, (name, of_environment) in enumerate(_by_environment(rows).items()):
        rates = [row["steps_per_second"] for row in of_environment]
        lanes = [row["lanes"] for row in of_environment]
        axis.loglog(lanes, rates, "o-", color=series_colour(k), label=name)
    widest = max(_by_environment(rows).values(), key=lambda its: its[-1]["lanes"])
    rates = [row["yardstick_steps_per_second"] for row in widest]
    axis.loglog([row["lanes"] for row in widest], rates, "s:", color="0.5", label=widest[0]["yardstick"])
    axis.set(xlabel="lanes, on all cores", ylabel="environment steps per second")
    legend_above(axis, 2)


def _draw_cores(axis: Axes, rows: Sequence[Row]) -> None:
    """Steps per second over those on one core, the first row of each environment."""
    if not rows:
        axis.set_axis_off()
        axis.text(0.5, 0.5, "cores can't be chosen on this platform", ha="center")
        return
    counts = sorted({row["cores"] for row in rows})
    for k, (name, lanes) in enumerate(dict.fromkeys((row["id"], row["lanes"]) for row in rows)):
        own = [row for row in rows if (row["id"], row["lanes"]) == (name, lanes)]
        gain = [row["steps_per_second"] / own[0]["steps_per_second"] for row in own]
        label = f"{name}, {lanes} lanes"
        axis.plot([row["cores"] for row in own], gain, "o-", color=series_colour(k), label=label)
    axis.plot(counts, counts, ":", color="0.5", label="in step with cores")
    axis.set(xlabel="cores", ylabel="steps per second, times one core's", xticks=counts, ylim=(0, None))
    legend_above(axis, 2)


def _by_environment(rows: Sequence[Row]) -> dict[str, list[Row]]:
    names = dict.fromkeys(row["id"] for row in rows)
    return {name: [row for row in rows if row["id"] == name] for name in names}
