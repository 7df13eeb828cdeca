"""Permissible speeds on lines of the catalogue, alone and in trains: what control is worth in km/h."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ...base.arrays import to_kmh
from ...base.plotting import LIMIT, panels, series_colour
from ...base.table import Table
from ...catalog import load_catenary
from ...metrics.compliance import WAVE_SHARE
from ...plant.catenary.flexible import FlexibleCatenaryData
from ..study import Figure, Outcome, Report, legend_below
from .scan import PASSIVE, VERIFIED_FROM, Scan, bands_of, scan, verified
from .shown import in_words


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
