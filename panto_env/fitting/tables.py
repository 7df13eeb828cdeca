"""Tables and pictures of a fit, to print, for files, and as plain data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.plotting import POSITION, legend_above, mark_supports, series_colour, stacked
from ..base.table import Alarm, Table, number
from .fit import INTERVAL, WHITE, Fit, Found, slack_droppers
from .stored import GOES_ON, doubts
from .values import FREE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .drift import Drift


NAMED = 20
"""Values in a table at most."""
NAMES = {
    "tensions": "tensions",
    "droppers": "lengths of droppers",
    "supports": "heights of supports",
    "damping": "damping of the line",
    "pantograph": "pantograph",
    "unevenness": "waves of the running surface",
}


def summary_table(found: Sequence[Found], differing: Sequence[Found], unlike: str) -> Table:
    """A row for each kind of value: how many there are, are identifiable and differ, and how well known.

    unlike: what values that differ are unlike.
    """
    rows = []
    for kind in FREE:
        own = [each for each in found if each.value.kind == kind]
        if not own:
            continue
        value = own[0].value
        counts = (
            len(own),
            sum(each.identifiable for each in own),
            sum(each.value.kind == kind for each in differing),
        )
        rms = np.sqrt(np.mean([(value.scale * each.difference) ** 2 for each in own]))
        size = np.median([INTERVAL * value.scale * each.deviation for each in own])
        sizes = (number(float(each), 2) for each in (rms, size))
        rows.append((f"{NAMES[kind]} ({value.unit})", *map(str, counts), *sizes))
    headings = ("values", "number", "told", f"unlike {unlike}", "rms difference", "95 % interval ±, median")
    return Table("What the records tell", headings, rows)


def values_table(differing: Sequence[Found], unlike: str) -> Table:
    """The values that most surely differ, waves of the running surface left out."""
    named = [each for each in differing if each.value.kind != "unevenness"]
    found = sorted(named, key=lambda each: -abs(each.difference) / each.deviation)[:NAMED]
    columns: dict[str, Callable[[Found], str]] = {
        "value": lambda each: each.value.name,
        "unit": lambda each: each.value.unit,
        "difference": lambda each: f"{each.value.scale * each.difference:+.2f}",
        "from": lambda each: f"{each.value.scale * each.interval[0]:+.2f}",
        "to": lambda each: f"{each.value.scale * each.interval[1]:+.2f}",
    }
    title = f"Most surely unlike {unlike}, {len(found)} of {len(named)}"
    return Table.of(title, found, columns, text_columns=2)


def parts_table(fit: Fit) -> Table:
    """A row for each piece of a record: what the fit explains of it, and whether the residual is noise."""
    found, std = fit.sensors, fit.std
    shifts = found["shift"] + np.array(fit.problem.shifts)
    as_noise = [white.probability for white in fit.whiteness]

    columns = {
        "record": lambda k: fit.parts[k].name,
        "speed (km/h)": lambda k: f"{fit.parts[k].measured.piece.speed_kmh:.1f}",
        "shift (m)": lambda k: f"{shifts[k] + 0.0:+.2f}",
        "wheel (%)": lambda k: f"{100 * found['scale'][k] + 0.0:+.3f}",
        "gain (%)": lambda k: f"{100 * found['gain'][k] + 0.0:+.2f}",
        "σ compared (N)": lambda k: number(std[k][0], 2),
        "σ left (N)": lambda k: number(std[k][1], 2),
        "explained (%)": lambda k: f"{100 * (1 - (std[k][1] / std[k][0]) ** 2):.1f}",
        "as noise, p": lambda k: (Alarm if as_noise[k] < WHITE else str)(f"{as_noise[k]:.2g}"),
    }
    return Table.of("What is left of each record", range(len(fit.parts)), columns)


def rows_of(found: Sequence[Found], before: float = 0.0) -> list[dict[str, Any]]:
    """A row for each value, for a file; before: way along the line before their places (m)."""
    return [
        {
            "kind": each.value.kind,
            "name": each.value.name,
            "unit": each.value.unit,
            "position": None if each.value.place is None else each.value.place + before,
            "difference": each.value.scale * each.difference,
            "low": each.value.scale * each.interval[0],
            "high": each.value.scale * each.interval[1],
            "tolerance": each.value.scale * each.value.tolerance,
            "told": each.identifiable,
        }
        for each in found
    ]


def remarks(fit: Fit) -> list[str]:
    """Sentences on what the records do not determine, or only together, and why the fit is less sure."""
    found = []
    for kind in FREE:
        own = fit.of_kind(kind)
        known = sum(each.identifiable for each in own)
        if known < len(own):
            what = f"{NAMES[kind][0].upper()}{NAMES[kind][1:]}"
            found.append(f"{what}: the records tell {known or 'none'} of {len(own)}.")
    for one, other, r in fit.correlated[:3]:
        found.append(f"The records hardly tell {one.name} from {other.name} (correlation {r:.3f}).")
    if not fit.problem.values.design.catenary.ends:
        found.append(GOES_ON)
    return [*found, *slack_droppers(fit.found), *doubts(fit)]


def plain(fit: Fit) -> dict[str, Any]:
    """All that was found, as plain data."""
    triples = zip(fit.parts, fit.std, fit.whiteness, strict=True)
    return {
        "settled": fit.solution.converged,
        "records": [
            {"name": part.name, "compared": before, "left": after, "as_noise": white.probability}
            for part, (before, after), white in triples
        ],
        "values": rows_of(fit.found, fit.problem.before),
        "notes": remarks(fit),
    }


def plot_fit(fit: Fit, title: str) -> Figure:
    """The record with the largest residual beside the fitted force, and values along the line."""
    kinds = [kind for kind in ("droppers", "supports") if fit.of_kind(kind)]
    figure, (force, *others) = stacked((11, 3.2 + 2.6 * len(kinds)), 1 + len(kinds))
    figure.suptitle(title)
    _draw_force(force, fit)
    for axes, kind in zip(others, kinds, strict=True):
        _draw_values(axes, fit.of_kind(kind), fit.problem.before)
    supports = [fit.problem.before + x for x in fit.problem.values.design.layout.supports[1:-1]]
    for axes in (force, *others[:1]):  # supports' own intervals stand where the lines would
        low, high = axes.get_xlim()
        mark_supports(axes, (x for x in supports if low <= x <= high))
    figure.axes[-1].set_xlabel(POSITION)
    return figure


def _draw_force(axes: Axes, fit: Fit) -> None:
    worst = int(np.argmax([after / before for before, after in fit.std]))
    part, seen = fit.parts[worst], fit.measured(worst)
    own, place = part.measured, part.measured.place + fit.problem.before
    axes.plot(place, own.back(seen), color="0.6", linewidth=1.6, label=f"{part.name}, measured")
    fitted = own.back(seen - fit.residual[worst])
    axes.plot(place, fitted, color=series_colour(0), linewidth=0.9, label="fitted")
    axes.set(ylabel="contact force without\nits slow part, to 18 Hz (N)", xlim=(place[0], place[-1]))
    legend_above(axes, 2)


def plot_drift(drift: Drift, title: str) -> Figure:
    """Changes of droppers and supports along the line."""
    kinds = {"droppers": "dropper longer", "supports": "support higher"}
    drawn = [(words, found) for kind, words in kinds.items() if (found := drift.of_kind(kind))]
    count = max(len(drawn), 1)
    figure, every = stacked((11, 1.2 + 2.6 * count), count)
    figure.suptitle(title)
    for axes, (words, found) in zip(every, drawn, strict=False):
        _draw_values(axes, found, 0.0, drift.changed)
        axes.set_ylabel(f"{words} than before ({found[0].value.unit})")
    every[-1].set_xlabel("position (m)")
    return figure


def _draw_values(axes: Axes, found: list[Found], before: float, named: Sequence[Found] = ()) -> None:
    value = found[0].value
    for identifiable, colour, words in ((True, series_colour(0), "told"), (False, "0.7", "not told")):
        own = [each for each in found if each.identifiable is identifiable]
        if own:
            axes.errorbar(
                [(each.value.place or 0.0) + before for each in own],
                [value.scale * each.difference for each in own],
                [INTERVAL * value.scale * each.deviation for each in own],
                fmt=".",
                color=colour,
                elinewidth=1.0,
                label=f"{words} by the records, 95 % intervals",
            )
    out = [each for each in named if each.value.kind == value.kind]
    if out:
        axes.plot(
            [each.value.place or 0.0 for each in out],
            [value.scale * each.difference for each in out],
            "o",
            color=series_colour(1),
            markerfacecolor="none",
            label="changed",
        )
    axes.axhline(0.0, color="0.4", linewidth=0.8)
    what = "dropper too long" if value.kind == "droppers" else "support too high"
    axes.set_ylabel(f"{what} ({value.unit})")
    axes.grid(color="0.92")
    legend_above(axes, 3)
