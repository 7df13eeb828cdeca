"""Permissible speeds on lines of the catalogue, alone and in trains: what control is worth in km/h.

And what any scan of speeds says, as a table, a picture and a page.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...base.arrays import from_kmh, to_kmh
from ...base.plotting import LIMIT, panels, series_colour, stacked
from ...base.table import Alarm, Table, number
from ...catalog import load_catenary
from ...metrics.compliance import STD_OF_MEAN, WAVE_SHARE, arcing_limit, maximum_limit, uplift_factor
from ...plant.catenary.flexible import FlexibleCatenaryData
from ...plant.catenary.schema import CatenaryData
from ...records.plots import save_page
from ...report.charts import svg_of
from ..study import Figure, Outcome, Report, legend_below
from .scan import PASSIVE, VERIFIED_FROM, Scan, bands_of, scan, verified


class Case(NamedTuple):
    """A line, the pantographs on it, and the speeds that are scanned."""

    line: str
    pantograph: str
    speeds_kmh: Sequence[float]


STEP = 20.0
CASES = tuple(
    Case(line, pantograph, np.arange(first, last + 1, STEP).tolist())
    for line, pantograph, first, last in (
        ("en50318-2002", "dsa380", 180.0, 320.0),
        ("benchmark-2015", "dsa380", 180.0, 340.0),
        ("ln2", "dsa250", 180.0, 320.0),
        ("re250", "dsa380", 180.0, 320.0),
        ("re330", "dsa380", 220.0, 420.0),
        ("shinkansen-simple", "dsa380", 220.0, 380.0),
        ("beijing-shanghai", "dsa380", 220.0, 400.0),
        ("beijing-tianjin", "dsa380", 220.0, 420.0),
        ("re330-stitched", "dsa380", 220.0, 420.0),
    )
)
DISTANCES: tuple[float | None, ...] = (None, 100.0, 200.0, 300.0)
"""Distances of two pantographs (m); none for one alone."""
POLICIES = ("pd:washout=1", "fb+ff:gain=0.3,washout=1", "repetitive", "agent-any-pantograph")
SEEDS = 3  # lines as built for each speed, and as many others for the verification
SHOWN = 200.0  # distance of the picture (m)


class Found(NamedTuple):
    """The scans of one line with its pantographs at a distance."""

    case: Case
    distance: float | None
    first: Scan
    again: Scan

    def limit(self, policy: str) -> float:
        """Permissible speed in both scans (km/h)."""
        return verified(self.first, self.again, policy)

    def gain(self, policy: str) -> float:
        """By how much a policy raises the limit (km/h); none counts as a step below the lowest speed."""
        below = self.first.speeds_kmh[0] - STEP
        limits = (self.limit(policy), self.limit(PASSIVE))
        own, passive = (below if math.isnan(limit) else limit for limit in limits)
        return own - passive

    def kept(self, policy: str) -> list[bool]:
        """Whether a policy keeps all requirements at each speed in both scans."""
        pairs = zip(self.first.kept(policy), self.again.kept(policy), strict=True)
        return [one and other for one, other in pairs]

    def bands(self, policy: str) -> list[tuple[float, float]]:
        """Bands of speeds that a policy keeps (km/h)."""
        return bands_of(self.first.speeds_kmh, self.kept(policy))

    def reduction(self, policy: str) -> float:
        """Mean reduction of the worst pantograph's σ/F_m by a policy over all speeds (%)."""
        ratios = []
        for one in (self.first, self.again):
            for speed in one.speeds_kmh:
                pairs = zip(one.at(PASSIVE, speed), one.at(policy, speed), strict=True)
                ratios += [acting.std_ratio / passive.std_ratio for passive, acting in pairs]
        known = [each for each in ratios if not math.isnan(each)]
        return 100 * (1 - float(np.mean(known))) if known else math.nan


def run(report: Report) -> Outcome:
    """Scan all lines, alone and with a second pantograph at each distance, and again with other seeds."""
    found = []
    wanted = [(case, distance) for case in CASES for distance in DISTANCES]
    for k, (case, distance) in enumerate(wanted):
        report(f"{case.line}, {where(distance)}", k / len(wanted))
        found.append(scanned(case, distance))
    return outcome_of(found)


def outcome_of(found: Sequence[Found]) -> Outcome:
    """Tables, picture and words of all scans."""
    return Outcome(
        title="Permissible speeds with control and without",
        comparisons=(),
        tables=(*(limits_table(found, each) for each in DISTANCES), gains_table(found), fell_table(found)),
        plots={"permissible-speeds": plot_bands([one for one in found if one.distance == SHOWN])},
        numbers={"cases": [as_dict(one) for one in found]},
        rows={"permissible-speeds": [row for one in found for row in rows_of(one)]},
        verdict=verdict(found),
    )


def scanned(case: Case, distance: float | None) -> Found:
    """Scan a line with one pantograph, or with two at a distance (m), under both sets of seeds."""
    train = {"pantographs": [case.pantograph] * 2, "distances": [distance]}
    riding: dict[str, Any] = {"pantograph": case.pantograph} if distance is None else train
    first, again = (
        scan(case.speeds_kmh, POLICIES, seeds=range(begin, begin + SEEDS), catenary=case.line, **riding)
        for begin in (0, VERIFIED_FROM)
    )
    return Found(case, distance, first, again)


def where(distance: float | None) -> str:
    """Words for one pantograph, or two at a distance."""
    return "one pantograph" if distance is None else f"two pantographs, {distance:g} m"


def as_dict(one: Found) -> dict[str, Any]:
    """Plain data of a case."""
    return {
        "line": one.case.line,
        "pantograph": one.case.pantograph,
        "distance_m": one.distance,
        "policies": {
            policy: {
                "permissible_kmh": one.limit(policy),
                "first": one.first.answer(policy)._asdict(),
                "again": one.again.answer(policy)._asdict(),
                "std_reduction": one.reduction(policy),
            }
            for policy in one.first.policies
        },
    }


def rows_of(one: Found) -> list[dict[str, Any]]:
    """A row for each pass."""
    keys = ("policy", "speed_kmh", "seed", "failing", "std_ratio", "max", "min", "uplift", "arcing", "rms")
    return [
        {"line": one.case.line, "distance": one.distance}
        | {key: getattr(each, key) for key in keys}
        | {"broken": ", ".join(broken.name for broken in each.broken)}
        for each in (*one.first.passes, *one.again.passes)
    ]


def limits_table(found: Sequence[Found], distance: float | None) -> Table:
    """Permissible speed on each line, without control, if control fails, and with each policy."""
    rows = []
    for one in [one for one in found if one.distance == distance]:
        best = max(POLICIES, key=lambda policy: (_or_zero(one.limit(policy)), policy))
        fallback = verified(one.first, one.again, best, failing=True)
        limits = [_speed(one, policy) for policy in (PASSIVE, *POLICIES)]
        limits.append("none" if math.isnan(fallback) else f"{fallback:g}")
        rows.append((one.case.line, one.case.pantograph, f"{wave_limit(one.case.line):.0f}", *limits))
    headings = ("line", "pantograph", "0.7 c", PASSIVE, *POLICIES, "if the best fails")
    return Table(f"Permissible speeds (km/h): {where(distance)}", headings, rows, text_columns=2)


def wave_limit(name: str, tension: float | None = None) -> float:
    """Speed (km/h) at ``WAVE_SHARE`` of a contact wire's wave speed; tension: another than its own (N)."""
    line = load_catenary(name)
    assert isinstance(line, FlexibleCatenaryData)
    wire = line.contact_wire if tension is None else line.contact_wire.model_copy(update={"tension": tension})
    return WAVE_SHARE * to_kmh(wire.wave_speed)


def _or_zero(value: float) -> float:
    return 0.0 if math.isnan(value) else value


def _speed(one: Found, policy: str) -> str:
    """The limit; marked where it is the last speed of the scan, which is no limit at all."""
    limit = one.limit(policy)
    if math.isnan(limit):
        return "none"
    return f"≥ {limit:g}" if limit == one.first.speeds_kmh[-1] else f"{limit:g}"


def gains_table(found: Sequence[Found]) -> Table:
    """Over all lines: km/h gained by each policy, and by how much σ/F_m falls.

    Gains are lower bounds where a policy keeps all up to the last speed of the scan.
    """
    rows = []
    for distance, policy in product(DISTANCES, POLICIES):
        own = [one for one in found if one.distance == distance]
        gains, std = [one.gain(policy) for one in own], [one.reduction(policy) for one in own]
        medians = f"{np.median(gains):+.0f}", f"{-np.median(std):+.0f}"
        ranges = f"{min(gains):+.0f} to {max(gains):+.0f}", f"{-max(std):+.0f} to {-min(std):+.0f}"
        rows.append((where(distance), policy, medians[0], ranges[0], medians[1], ranges[1]))
    ends = tuple(len(POLICIES) * (k + 1) - 1 for k in range(len(DISTANCES)))
    headings = ("train", "policy", "gain, median (km/h)", "range", "σ/F_m, median (%)", "range of lines")
    return Table("Gain over passive, over the lines", headings, rows, text_columns=2, section_ends=ends)


def fell_table(found: Sequence[Found]) -> Table:
    """Limits of the first seeds that other seeds lowered."""
    rows = [
        (one.case.line, where(one.distance), policy, f"{one.first.limit(policy):g}", f"{one.limit(policy):g}")
        for one in found
        for policy in one.first.policies
        if one.limit(policy) < one.first.limit(policy)
    ]
    headings = ("line", "train", "policy", "first seeds (km/h)", "both")
    return Table("What fell with other seeds", headings, rows, text_columns=3)


def plot_bands(found: Sequence[Found]) -> Figure:
    """Speeds that are kept, for each line and policy, and 0.7 of its wave speed."""
    names = (PASSIVE, *POLICIES)
    figure, axis = panels((9, 0.55 * len(found) * len(names) ** 0.5 + 1.5))
    for k, one in enumerate(found):
        speeds = np.array(one.first.speeds_kmh)
        for j, policy in enumerate(names):
            place = k + 0.8 * (j + 0.5) / len(names) - 0.4
            kept = speeds[one.kept(policy)]
            colour = "0.45" if policy == PASSIVE else series_colour(j - 1)
            bars = np.full(kept.size, place), np.full(kept.size, STEP), 0.7 / len(names), kept - STEP / 2
            axis.barh(*bars, color=colour, label=policy if k == 0 else None)
        axis.plot([wave_limit(one.case.line)] * 2, [k - 0.42, k + 0.42], color=LIMIT, linewidth=0.9)
    axis.set(xlabel="speed (km/h); black: 0.7 of the wave speed", ylim=(len(found) - 0.5, -0.5))
    axis.set_yticks(range(len(found)), [one.case.line for one in found])
    axis.set_xlim(min(one.first.speeds_kmh[0] for one in found) - STEP)
    axis.grid(axis="x", color="0.92")
    axis.set_axisbelow(True)
    figure.suptitle(f"Speeds at which all requirements are kept: {where(found[0].distance)}")
    legend_below(figure, 3)
    return figure


def verdict(found: Sequence[Found]) -> str:
    """What it comes to."""
    own = [one for one in found if one.distance == SHOWN]
    best = max(POLICIES, key=lambda policy: sum(_or_zero(one.limit(policy)) for one in own))
    gains = [one.gain(best) for one in own]
    gaps = [f"{one.case.line} {in_words(one.bands(PASSIVE))}" for one in own if len(one.bands(PASSIVE)) > 1]
    words = (
        f"Under two pantographs {SHOWN:g} m apart {best} raises the permissible speed by {min(gains):.0f} to "
        f"{max(gains):.0f} km/h, median {np.median(gains):.0f}, over {len(gains)} lines."
    )
    return f"{words} Without control speeds are kept in bands: {'; '.join(gaps)}." if gaps else words


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
        limits = [_in_kmh(found.limit)]
        if again is not None:
            both = " and ".join(_in_kmh(each) for each in (found.limit, again.limit(policy)))
            limits = [_in_kmh(verified(scan, again, policy)), both]
        limits += [_in_kmh(found.with_waves), _in_kmh(found.fallback) if acts else ""]
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


def _in_kmh(value: float) -> str:
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
