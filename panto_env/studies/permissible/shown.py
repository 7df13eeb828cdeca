"""What a scan of speeds says, as a table, a picture and a page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import from_kmh
from ...base.plotting import LIMIT, series_colour, stacked
from ...base.table import Alarm, Table
from ...metrics.compliance import STD_OF_MEAN, arcing_limit, maximum_limit, uplift_factor
from ...plant.catenary.schema import CatenaryData
from ...records.plots import save_page
from ...report.charts import svg_of
from ...terminal import number
from ..study import Figure, legend_below
from .scan import PASSIVE, Scan, verified

NOTES = (
    "A speed is permissible where all passes at it, and at all lower speeds of the scan, keep every "
    "requirement but that of the wave speed; the table has the limit with that rule too.",
    "The mean force is trimmed to the standard's target without control; control may move it by 1.5 % beyond "
    "its limit, as in the benchmark.",
    "If control fails: the actuator gives no force any more from the middle of each pass on.",
)
"""What the table's columns mean."""


def answers_table(scan: Scan, again: Scan | None = None) -> Table:
    """A row for each policy: its permissible speed, and what the actuator gives there."""
    rows: list[tuple[str | float, ...]] = []
    for policy in scan.policies:
        found, acts = scan.answer(policy), policy != PASSIVE
        limits = [_speed(found.limit)]
        if again is not None:
            both = " and ".join(_speed(each) for each in (found.limit, again.limit(policy)))
            limits = [_speed(verified(scan, again, policy)), both]
        limits += [_speed(found.with_waves), _speed(found.fallback) if acts else ""]
        force = f"{number(found.rms)} / {number(found.peak, 0)}" if acts else ""
        rows.append((policy, *limits, force, number(found.watts) if acts else ""))
    headings = ("policy", "permissible (km/h)", *(() if again is None else ("of both scans",)))
    others = ("with v/c ≤ 0.7", "if control fails", "rms / peak (N)", "W")
    return Table("Permissible speeds", (*headings, *others), rows)


def reasons(scan: Scan) -> list[str]:
    """A sentence for each policy: which speeds it keeps, what forbids the first one that it does not."""
    sentences = []
    for policy in scan.policies:
        found = scan.answer(policy)
        words = f"{policy}: kept at {in_words(found.bands)} km/h"
        if not math.isnan(found.beyond):
            words += f"; forbidden at {found.beyond:g} by {found.reason}"
        if found.tightest:
            near = f"; nearest to its limit at {found.limit:g}: {found.tightest}"
            words += f"{near}, by {number(found.margin)} %"
        sentences.append(f"{words}.")
    return sentences


def _speed(value: float) -> str:
    return Alarm("none") if math.isnan(value) else f"{value:g}"


def in_words(bands: Sequence[tuple[float, float]]) -> str:
    """Bands of speeds (km/h)."""
    return ", ".join(f"{low:g}" if low == high else f"{low:g} to {high:g}" for low, high in bands) or "none"


def plot_scan(scan: Scan, line: CatenaryData) -> Figure:
    """σ over F_m, maximum, minimum, uplift and NQ over speed, with their limits, for each policy.

    Lines are medians over the seeds, bands reach from the smallest to the largest.
    """
    rows = {
        "σ / F_m (-)": ("std_ratio", 1.0, lambda v: STD_OF_MEAN),
        "maximum (N)": ("max", 1.0, lambda v: maximum_limit(from_kmh(v), line.system)),
        "minimum (N)": ("min", 1.0, lambda v: 0.0),
        "uplift (mm)": ("uplift", 1e3, lambda v: 1e3 * line.free_uplift / uplift_factor(line.uplift_stop)),
        "NQ (%)": ("arcing", 1.0, lambda v: arcing_limit(from_kmh(v), line.system)),
    }
    figure, axes = stacked((8, 11), len(rows))
    speeds = np.array(scan.speeds_kmh)
    for axis, (label, (key, scale, limit)) in zip(axes, rows.items(), strict=True):
        for k, policy in enumerate(scan.policies):
            values = [[scale * getattr(each, key) for each in scan.at(policy, v)] for v in scan.speeds_kmh]
            known = [np.array([x for x in own if not math.isnan(x)] or [math.nan]) for own in values]
            colour = series_colour(k)
            axis.plot(speeds, [np.median(own) for own in known], color=colour, marker=".", label=policy)
            lowest, highest = ([edge(own) for own in known] for edge in (np.min, np.max))
            axis.fill_between(speeds, lowest, highest, color=colour, alpha=0.15, linewidth=0)
        limits = [limit(v) for v in scan.speeds_kmh]
        axis.plot(speeds, limits, color=LIMIT, linestyle=(0, (5, 3)), linewidth=0.9, drawstyle="steps-pre")
        axis.set(ylabel=label)
        axis.grid(color="0.92")
    axes[-1].set(xlabel="speed (km/h)")
    seeds = len({each.seed for each in scan.passes})
    figure.suptitle(f"{line.name}: the worst pantograph of each pass, median and range of {seeds} seeds")
    legend_below(figure, 3)
    return figure


def write_page(
    scan: Scan, again: Scan | None, line: CatenaryData, settings: Mapping[str, Any], path: str | Path
) -> None:
    """Write the page of a scan, whole or not at all. Raises InputError for a name with another suffix."""
    save_page(
        f"Permissible speeds on {line.name}",
        f"Settings: {', '.join(f'{name} {value}' for name, value in settings.items())}.",
        [],
        [("Over speed, with the limits of EN 50367 and EN 50119 (dashed)", svg_of(plot_scan(scan, line)))],
        [answers_table(scan, again)],
        [*reasons(scan), *NOTES],
        path,
    )
