"""A record held against a simulated run: aligned by place, and the deviations by which EN 50318 accepts it.

The standard was not at hand; its acceptance of a simulation against a measurement is recalled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import METRES_PER_SECOND, Array, to_kmh
from ..base.errors import InputError
from ..base.table import Table, number
from ..metrics.compliance import Criterion, criteria_table
from ..metrics.figures import LABELS, STATISTICS, statistics
from ..metrics.low_pass import low_pass, zero_phase_low_pass
from ..metrics.trajectory import Trajectory
from .likeness import SUM, UNLIKE, check_period, check_reading, doubts
from .record import Piece, Record, Samples, Shift, find_shift

SAME_SPEED = 0.03
"""Relative difference of speeds, mean and local, up to which a record is compared with a run. Own choice."""
STD, UPLIFT, HEIGHT = 20.0, 20.0, 20.0
"""Accepted deviations of σ (%), of the maximum uplift (mm) and of the contact point's range (mm)."""
SOURCE = "EN 50318, recalled"
COVERED = 0.98
"""Share of a span that both must cover for it to be compared."""


class SpanPair(NamedTuple):
    """Figures of one span, of the record and of the run: forces in N, heights in m."""

    span: int
    begin: float  # m
    end: float  # m
    mean: tuple[float, float]
    std: tuple[float, float]
    max: tuple[float, float]
    min: tuple[float, float]
    height_range: tuple[float, float]  # of the contact point; nan where not measured


@dataclass(frozen=True, eq=False)
class Comparison:
    """A record beside a run, over the spans that both cover."""

    samples: Samples  # of the record's pieces at the run's speed, shifted to the run's places
    run: Trajectory
    shift: Shift
    spans: tuple[SpanPair, ...]
    figures: dict[str, tuple[float, float]]  # mean, std, max and min of all these spans (N)
    criteria: tuple[Criterion, ...]  # deviations, run minus record; the last ones for information
    missing: tuple[str, ...]  # what was not measured, and so is not judged
    notes: tuple[str, ...]

    @property
    def accepted(self) -> bool | None:
        """Whether all limits are kept; None where something was not measured and all others are kept."""
        if any(each.kept is False for each in self.criteria):
            return False
        return None if self.missing else True

    @property
    def verdict(self) -> str:
        """The verdict as a clause."""
        if self.accepted is None:
            return f"not judged: {' and '.join(self.missing)} not measured"
        return "accepted" if self.accepted else "not accepted"


def compare(record: Record, run: Trajectory, *, shift: float | None = None) -> Comparison:
    """Hold a record against the evaluated spans of a run's first pantograph.

    shift: about what is to be added to the record's positions (m), if known; else it is searched within 1.5
    spans. Raises InputError where the run ended early or is too short, the two have less than a span in
    common, the speeds differ by more than 3 %, of the whole or of a second in the spans that both cover, or
    the record is clearly more like the run if it is read in another way.
    """
    covered = run.spans()
    assert covered is not None  # it is for a choice of "all" only
    begin, end = run.alignment.limits(covered)
    check_period(Samples(record), run.alignment.mean_length)
    same, notes = _at_speed(record, run)
    unmoved = Samples(same)
    found = find_shift(unmoved, run, begin, end, shift)
    check_reading(unmoved, run, begin, end, shift, found)
    moved = [replace(piece, position=piece.position + found.value) for piece in same.pieces]
    samples = Samples(replace(same, pieces=tuple(moved)))
    spans, own, other = _spans(samples, run, begin, end)
    figures = _pairs(own, other)
    uplift, where = _uplift(samples, run, begin, end)
    heights = np.array([each.height_range for each in spans if not math.isnan(each.height_range[0])])
    height = 1e3 * float((heights[:, 1] - heights[:, 0]).mean()) if len(heights) else math.nan
    ratio = figures["mean"][0] / figures["mean"][1]
    notes += doubts(found, ratio)
    range_of_height = "range of the contact point's height"
    values = {"uplift at a support": uplift, range_of_height: height}
    missing = tuple(name for name, value in values.items() if math.isnan(value))
    heights_note = "mean over the spans of the range within each, low-passed at 20 Hz"
    criteria = (
        Criterion("std", "σ of the contact force", "%", deviation(figures["std"]), -STD, STD, SOURCE),
        Criterion("uplift", "maximum uplift at the support", "mm", uplift, -UPLIFT, UPLIFT, SOURCE, where),
        Criterion("height", range_of_height, "mm", height, -HEIGHT, HEIGHT, SOURCE, heights_note),
        Criterion(
            "correlation", "correlation of the forces", "", found.correlation, UNLIKE, None, "own choice"
        ),
        Criterion("ratio", "mean force, record over run", "", ratio, 1 / SUM, SUM, "own choice"),
        *(
            Criterion(key, LABELS[key].name, "N", simulated - measured)
            for key, (measured, simulated) in figures.items()
            if key != "std"
        ),
    )
    return Comparison(samples, run, found, tuple(spans), figures, criteria, missing, tuple(notes))


def _pairs(one: Array, other: Array) -> dict[str, tuple[float, float]]:
    ours, theirs = statistics(one), statistics(other)
    return {name: (ours[name], theirs[name]) for name in STATISTICS}


def _at_speed(record: Record, run: Trajectory) -> tuple[Record, list[str]]:
    same = [piece for piece in record.pieces if abs(piece.speed / run.speed - 1) <= SAME_SPEED]
    if not same:
        own, speed = record.longest, f"{record.longest.speed_kmh:.1f}"
        said = f"The record's speed is {speed} km/h and the run's {run.speed_kmh:.1f} km/h"
        if abs(run.speed / own.speed / METRES_PER_SECOND - 1) <= SAME_SPEED:
            raise InputError(
                f"{said}, 3.6 times as much: if the speed was recorded in m/s, tell: --unit speed=m/s."
            )
        raise InputError(f"{said}; simulate the run at the record's speed: --speed {speed}.")
    left = len(record.pieces) - len(same)
    more = [f"{left} pieces at other speeds are left out."] if left else []
    return replace(record, pieces=tuple(same)), [*record.notes, *more]


def _spans(
    samples: Samples, run: Trajectory, begin: float, end: float
) -> tuple[list[SpanPair], Array, Array]:
    """Figures of the spans between begin and end (m) that both cover, and the filtered forces there (N)."""
    filtered = low_pass(run.contact_force, run.time_step)
    heights = zero_phase_low_pass(run.wire, run.time_step)
    measured = _heights(samples)
    settled, position = samples.settled, samples.position
    numbers = run.alignment.span_of(np.array([begin + 1e-6, end - 1e-6]))
    found, own, other = [], [], []
    compared = np.zeros(len(position), dtype=bool)
    for span in range(int(numbers[0]), int(numbers[1]) + 1):
        first, last = run.alignment.limits((span, span))
        here = (position >= first) & (position < last) & settled
        there = run.alignment.within(run.position, (span, span))
        if samples.distance(here) < COVERED * (last - first):
            continue
        compared |= here
        own.append(samples.filtered[here])
        other.append(filtered[there])
        ranges = _range(measured, here), _range(heights, there)
        found.append(SpanPair(span, first, last, **_pairs(own[-1], other[-1]), height_range=ranges))
    if not found:
        raise InputError(
            "The record covers none of the run's evaluated spans without a gap; simulate a run along all "
            "that was recorded, or give a record without so many gaps."
        )
    speed = samples.speed[compared]
    away = float(np.abs(speed / run.speed - 1).max())
    if away > SAME_SPEED:
        low, high = to_kmh(float(speed.min())), to_kmh(float(speed.max()))
        raise InputError(
            f"The record's speed lies between {low:.1f} and {high:.1f} km/h from {found[0].begin:,.0f} to "
            f"{found[-1].end:,.0f} m, up to {100 * away:.1f} % from the run's {run.speed_kmh:.1f} km/h, and "
            f"{100 * SAME_SPEED:g} % are allowed; give a part of the record at one speed, and a run at that."
        )
    return found, np.concatenate(own), np.concatenate(other)


def _heights(samples: Samples) -> Array:
    """Height of the contact point, low-passed without delay, (n,), m; nan where it was not measured."""

    def of_piece(piece: Piece) -> Array:
        if piece.height is None or not np.isfinite(piece.height).all():
            return np.full(len(piece.force), np.nan)
        return zero_phase_low_pass(piece.height, piece.time_step)

    return samples.joined(of_piece)


def _range(heights: Array, inside: NDArray[np.bool_]) -> float:
    return float(np.ptp(heights[inside])) if inside.any() else math.nan


def _uplift(samples: Samples, run: Trajectory, begin: float, end: float) -> tuple[float, str]:
    """Deviation of the maximum uplift at the mast that was measured (mm), and which support that is.

    It is nan where none was measured, or the mast stands outside the evaluated spans, begin to end (m).
    """
    pairs = [(piece.position, piece.uplift) for piece in samples.record.pieces if piece.uplift is not None]
    if not pairs or not run.uplift.size:
        return math.nan, ""
    position, uplift = max(pairs, key=lambda pair: float(np.nanmax(pair[1])))
    at = int(np.nanargmax(uplift))
    nearest = int(np.argmin(np.abs(run.support_position - position[at])))
    place = float(run.support_position[nearest])
    if not begin - 1e-6 <= place <= end + 1e-6:
        return math.nan, f"it was measured at {place:.6g} m, outside the run's evaluated spans"
    measured, simulated = float(uplift[at]), float(run.uplift_at(place).max())
    words = (
        f"{1e3 * measured:.1f} mm were measured when the train was at {position[at]:.1f} m, "
        f"and {1e3 * simulated:.1f} mm simulated at the support at {place:.6g} m"
    )
    return 1e3 * (simulated - measured), words


def figures_table(found: Comparison) -> Table:
    """Statistics of both forces over the common spans."""
    rows = [
        (LABELS[key].heading, number(measured), number(simulated), _signed(simulated - measured))
        for key, (measured, simulated) in found.figures.items()
    ]
    first, last = found.spans[0], found.spans[-1]
    title = f"{len(found.spans)} common spans, {first.begin:,.0f} to {last.end:,.0f} m"
    return Table(title, ("figure", "record", "run", "run − record"), rows)


def acceptance_table(found: Comparison) -> Table:
    """Deviations with limits, and what was not measured."""
    table = criteria_table(found.criteria, "Deviations, run minus record")
    rows = [(row[0], "not measured", *row[2:]) if "not judged" in row else row for row in table.rows]
    return Table(table.title, ("deviation of", *table.headings[1:]), rows)


def spans_table(found: Comparison, most: int | None = None) -> Table:
    """Figures span by span: record, run, and for the standard deviation how much they differ.

    most: rows at most, those whose σ differs most.
    """
    rows = [
        (
            found.run.alignment.span_name(each.span),
            f"{each.begin:,.6g}",
            *(number(value) for key in STATISTICS for value in getattr(each, key)),
            _signed(deviation(each.std)),
        )
        for each in found.spans
    ]
    short = [f"{LABELS[key].short} {whose}" for key in STATISTICS for whose in ("rec.", "run")]
    table = Table("By span (N)", ("span", "from (m)", *short, "σ: run − record (%)"), rows)
    sizes = [abs(deviation(each.std)) for each in found.spans]
    return table.of_largest(sizes, most, "difference of σ")


def deviation(pair: tuple[float, float]) -> float:
    """Deviation of a run's standard deviation from a record's (%)."""
    measured, simulated = pair
    return 100 * (simulated / measured - 1)


def _signed(value: float) -> str:
    return f"{value:+z.1f}"  # never "-0.0"


def shift_sentence(found: Comparison) -> str:
    """The shift that was found, how sure it is, and what else came near."""
    shift = found.shift
    text = f"The record is shifted by {shift.value:+z.2f} m, where the forces correlate with "
    text += f"{shift.correlation:.3f}"
    if shift.other_correlation > 0:
        text += f"; the next best shift is {shift.other:+.0f} m with {shift.other_correlation:.3f}"
    return f"{text} (searched from {shift.search[0]:+.0f} to {shift.search[1]:+.0f} m)."


def criterion_notes(found: Comparison) -> list[str]:
    """Sentences on how deviations were found."""
    return [f"{each.name}: {each.note}." for each in found.criteria if each.note]


def plain(found: Comparison) -> dict[str, Any]:
    """All that was found, as plain data; pairs are of record and run."""
    return {
        "record": found.samples.record.name,
        "shift": vars(found.shift),
        **{name: getattr(found, name) for name in ("accepted", "verdict", "figures")},
        "criteria": [each.as_dict() for each in found.criteria],
        "missing": list(found.missing),
        "spans": [each._asdict() for each in found.spans],
        "notes": list(found.notes),
    }
