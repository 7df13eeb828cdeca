"""Card of a table of designs: its columns with units and ranges, and what it can be used for."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from panto_env.metrics.labels import LABELS

from .designs import FIGURES
from .designs_settings import DesignsSettings
from .front_matter import front_matter

TABLE = "designs.parquet"
"""Name of the table in its folder."""
SI = {"mm": "m"}
"""Units in the table by the unit shown elsewhere: the table uses SI units."""


class Column(NamedTuple):
    """A column of the table."""

    name: str
    kind: str  # Arrow type
    description: str  # with the unit, and the range of a drawn parameter


def columns(settings: DesignsSettings) -> list[Column]:
    """All columns, in order."""
    labels = settings.labels()
    drawn = [
        Column(name, "float64", f"{labels[name]}, drawn from {low:g} to {high:g}")
        for name, (low, high) in settings.ranges.items()
    ]
    return [
        Column("design", "int64", "number of the design, from 0"),
        *drawn,
        Column("refused", "string", "why no line or pantograph has these values; empty if they were run"),
        Column("ending", "string", "where and why the run ended early; empty if it did not"),
        Column("accuracy_warning", "string", "why figures are less accurate; empty if they are not"),
        Column("nominal_force", "float64", "static and aerodynamic uplift force (N)"),
        Column("wave_speed", "float64", "wave speed of the contact wire (m/s)"),
        Column("time_step", "float64", "time step of the computation (s)"),
        Column("spacing", "float64", "spacing of the computation's grid (m)"),
        *(Column(name, "float64", _figure(name)) for name in FIGURES),
    ]


def _figure(name: str) -> str:
    label = LABELS[name]
    return f"{label.name} ({SI.get(label.unit, label.unit)})"


def card(settings: DesignsSettings, shown: Sequence[Column], table: Any, made_of: Mapping[str, Any]) -> str:
    """Text of the card, as Markdown. shown: columns to describe. table: Arrow table."""
    kinds = {name: _reasons(table[name].to_pylist()) for name in ("refused", "ending", "accuracy_warning")}
    lines = [
        *front_matter(settings.title, TABLE, table.num_rows, "tabular-regression", ("surrogate-model",)),
        f"# {settings.title}",
        "",
        f"{table.num_rows:,} designs around the pantograph {settings.pantograph} on the line "
        f"{settings.catenary}, each simulated once: a passive pantograph along a new line, as designed, "
        "without irregularity, sensors or control. Figures are those of EN 50317 over the spans after the "
        "start has died out.",
        "",
        f"Drawn by a scrambled Sobol sequence (seed {settings.seed}), evenly over the ranges. If a span "
        "is longer or shorter, droppers keep their positions relative to it. Parameters without a range are "
        "as in the catalogue.",
        "",
        f"Made by panto-env {made_of['version']}, commit {made_of['commit'] or 'unknown'}, sources "
        f"{made_of['sources']}. Licence: MIT. `panto dataset verify` checks the files.",
        "",
        "| column | description | minimum | median | maximum |",
        "|---|---|---:|---:|---:|",
        *(f"| `{each.name}` | {each.description} | {_spread(table, each)} |" for each in shown),
        "",
        "No design is left out: one that was refused, or whose run ended early, has a row that says so.",
        "",
        *_endings("refused", "refused", kinds["refused"], table.num_rows),
        *_endings("ending", "ended early", kinds["ending"], table.num_rows),
        *_endings("accuracy_warning", "with a warning", kinds["accuracy_warning"], table.num_rows),
        "",
        "Caveats: simulated, not measured; grid and time step are chosen so that the standard deviation is "
        "within 1 % of its converged value up to 95 % of the wave speed, where no warning says more; a model "
        "that is fitted to it knows nothing beyond the ranges, nor of other kinds of line (stitched, with "
        "pre-sag), several pantographs, wind, or irregularity.",
        "",
    ]
    return "\n".join(lines)


def _spread(table: Any, column: Column) -> str:
    if column.kind != "float64":
        return "| | "
    values = table[column.name].drop_null().to_numpy()
    if not len(values):
        return "– | – | –"
    return " | ".join(f"{float(f'{each:.4g}'):g}" for each in (values.min(), np.median(values), values.max()))


def _reasons(texts: Sequence[str]) -> list[tuple[str, int]]:
    """Reasons with their counts; texts that differ only in numbers count as one reason."""
    same: dict[str, list[str]] = {}
    for text in texts:
        if text:
            same.setdefault(re.sub(r"[-+]?\d[\d.e+-]*", "#", text), []).append(text)
    counts = Counter({group[0]: len(group) for group in same.values()})
    return counts.most_common()


def _endings(column: str, words: str, reasons: Sequence[tuple[str, int]], count: int) -> list[str]:
    number = sum(each for _, each in reasons)
    head = f"- {number:,} of {count:,} {words} (`{column}`){':' if reasons else '.'}"
    return [head, *(f"  - {each:,} such as: {text}" for text, each in reasons)]
