"""Where a score along the line is beyond its threshold, and which kind of defect that is.

The threshold is set by false alarms per kilometre: the maximum log score of a span is taken to have Gumbel's
distribution, the limit of maxima of many values, fitted to the spans of healthy passes, each held against
the others. Where passes are few, another one may differ by more than they do from one another.

For each candidate about a maximum a small neural network estimates whether a defect is there, and of which
kind; the surest counts. scikit-learn trains it (``training.py``); here is only its sum, of plain arrays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from ..base.arrays import Array
from ..metrics.figures import stretches
from ..plant.alignment import Alignment

ECHOES = ((1.3, np.inf), (2.5, 0.5), (4.0, 0.2))
"""Distance (spans) from a defect up to which less than such a share of its score counts as its own waves, as
simulated ones make them at 160 to 280 km/h. Nearer than the first none is distinguished."""


@dataclass(frozen=True)
class Evidence:
    """What one pass shows, or the mean of several, held against healthy ones."""

    position: Array  # (places,): m
    residual: Array  # (places,): force beside what healthy passes would have (N)
    score: Array  # (places,): 0 where the line is not judged
    threshold: float  # of the score
    alignment: Alignment  # of the line
    droppers: Array  # (droppers,): positions (m)
    speed: float  # m/s
    wave_speed: float  # m/s
    level: float  # of the residual where the passes are quiet (N)


class Region(NamedTuple):
    """A stretch of the line about a greatest score."""

    peak: int  # place
    first: int  # place where the score begins to be beyond the threshold
    last: int  # and the last one


def regions(evidence: Evidence) -> list[Region]:
    """Regions beyond the threshold, in their order along the line; waves of a greater one are none."""
    score, spans = evidence.score, evidence.alignment.in_spans(evidence.position)

    def echo(peak: int, greater: int) -> bool:
        apart = abs(spans[peak] - spans[greater])
        share = next((share for within, share in ECHOES if apart <= within), 0.0)
        return bool(score[peak] < share * score[greater])

    found = [
        Region(int(first + np.argmax(score[first:end])), int(first), int(end) - 1)
        for first, end in zip(*stretches(score > evidence.threshold), strict=True)
    ]
    kept: list[Region] = []
    for region in sorted(found, key=lambda each: -score[each.peak]):
        if not any(echo(region.peak, greater.peak) for greater in kept):
            kept.append(region)
    return sorted(kept)


AHEAD = 27.0
"""Distance (m) either side of the greatest score within which a defect may be that causes it."""
SUPPORTS = 35.0
"""Likewise of supports: two of them at least on lines of usual spans."""
OFFSETS = np.arange(-24.0, 33.0, 1.5)
"""Places (m) about a candidate at which force and score are shown."""
SCALE = 30.0
"""Distance (m) either side of the greatest score over which the residual has its scale."""


class Sort(IntEnum):
    """What may be defective at a candidate."""

    DROPPER = 0
    SUPPORT = 1
    WIRE = 2


class Candidate(NamedTuple):
    """A place where a defect may be."""

    position: float  # m
    sort: Sort


def candidates(evidence: Evidence, region: Region) -> list[Candidate]:
    """Droppers, supports, and places of the wire metre by metre, about the region's greatest score."""
    peak = float(evidence.position[region.peak])
    droppers = evidence.droppers[np.abs(evidence.droppers - peak) < AHEAD]
    alignment = evidence.alignment
    near = max(SUPPORTS, 0.6 * alignment.length_at(peak))
    supports = alignment.supports_within(peak - near, peak + near)
    wire = np.arange(np.ceil(peak - AHEAD), peak + AHEAD)
    return [
        Candidate(float(position), sort)
        for sort, positions in ((Sort.DROPPER, droppers), (Sort.SUPPORT, supports), (Sort.WIRE, wire))
        for position in positions
    ]


def features(evidence: Evidence, region: Region, places: list[Candidate]) -> Array:
    """(candidates, features): shape of residual and score about each, then how strong, where and how fast."""
    x, score, residual = evidence.position, evidence.score, evidence.residual
    peak = region.peak
    scale = float(np.sqrt((residual[np.abs(x - x[peak]) < SCALE] ** 2).mean()))
    at = np.array([place.position for place in places])
    seen = at[:, None] + OFFSETS
    angle = 2 * np.pi * evidence.alignment.in_spans(at)
    common = [
        np.log(scale),
        np.log(score[peak] / evidence.threshold),
        evidence.speed / 50,
        evidence.speed / evidence.wave_speed,
        np.log(evidence.level),
    ]
    where = [np.sin(angle), np.cos(angle), np.sin(2 * angle), np.cos(2 * angle)]
    sorts = [[place.sort == sort for place in places] for sort in (Sort.DROPPER, Sort.SUPPORT)]
    return np.concatenate(
        [
            np.interp(seen, x, residual) / scale,
            np.sqrt(np.interp(seen, x, score) / score[peak]),
            np.tile(common, (len(places), 1)),
            np.array(where).T,
            np.array(sorts, dtype=float).T,
        ],
        axis=1,
    )


FALSE_ALARMS = 0.1
"""Per kilometre: one in 10 km."""
ENOUGH = 100
"""Healthy spans for a threshold whose false alarms are right within a factor of about two."""


def threshold(scores: Array, per_span: int, span: float, false_alarms: float = FALSE_ALARMS) -> float:
    """Score that healthy lines exceed so many times per kilometre.

    scores: (passes, places) of healthy passes; per_span: places in a span; span: its length (m).
    """
    from scipy.stats import gumbel_r  # slow to import

    maxima = np.log(scores.reshape(-1, per_span).max(axis=1))
    place, scale = gumbel_r.fit(maxima)
    return float(np.exp(gumbel_r.isf(_in_a_span(false_alarms, span), place, scale)))


def cautious_threshold(
    scores: Array, per_span: int, span: float, false_alarms: float = FALSE_ALARMS
) -> float:
    """As ``threshold``, but for a further pass: beyond the mean by more, the fewer the healthy passes are.

    Spans of one pass are alike, as its pantograph is: that part of the spread which lies between passes is
    known from no more values than there are passes. It counts for more as in a prediction interval, by
    Student's t over the normal quantile (a textbook's, recalled); the rest, from span to span, does not.
    """
    from scipy.stats import norm, t  # slow to import

    maxima = np.log(scores.reshape(len(scores), -1, per_span).max(axis=2))
    passes, middle = len(maxima), float(maxima.mean())
    exceeded = _in_a_span(false_alarms, span)
    longer = t.isf(exceeded, passes - 1) / norm.isf(exceeded) * math.sqrt(1 + 1 / passes)
    between = min(1.0, float(maxima.mean(axis=1).var(ddof=1) / maxima.var()))
    above = math.log(threshold(scores, per_span, span, false_alarms)) - middle
    return math.exp(middle + above * math.sqrt(1 + between * (max(1.0, longer) ** 2 - 1)))


def _in_a_span(false_alarms: float, span: float) -> float:
    """Probability of an alarm in a span (m), where so many per kilometre are Poisson's."""
    return -math.expm1(-false_alarms * span / 1e3)


BROKEN, LONG, SHORT = "broken dropper", "dropper too long", "dropper too short"
RAISED, SUNK, SPOT = "raised support", "sunk support", "hard spot"
WORN, TENSION = "worn wire", "lost tension"
KINDS = (BROKEN, LONG, SHORT, RAISED, SUNK, SPOT, WORN)
"""Of defects that are somewhere: classes from 1 on; class 0 is that there is nothing just there."""
OF_SORT: Mapping[Sort, tuple[str, ...]] = {
    Sort.DROPPER: (BROKEN, LONG, SHORT),
    Sort.SUPPORT: (RAISED, SUNK),
    Sort.WIRE: (SPOT, WORN),
}
TRAINED = Path(__file__).with_name("kinds.npz")


class Answer(NamedTuple):
    """The surest kind and place."""

    kind: str
    place: Candidate
    shares: Mapping[str, float]  # of the kinds, each where it is surest; they add up to 1


@dataclass(frozen=True)
class Classifier:
    """A network of one hidden layer over standardised features."""

    mean: Array  # (features,)
    scale: Array  # (features,)
    inner: Array  # (features, hidden)
    inner_bias: Array  # (hidden,)
    outer: Array  # (hidden, classes)
    outer_bias: Array  # (classes,)

    @classmethod
    def load(cls, path: Path = TRAINED) -> Self:
        """From a file of arrays; nothing in it is run."""
        with np.load(path, allow_pickle=False) as arrays:
            return cls(*(arrays[field.name] for field in fields(cls)))

    def probabilities(self, shown: Array) -> Array:
        """Of all classes, (n, classes), by features, (n, features)."""
        hidden = np.maximum((shown - self.mean) / self.scale @ self.inner + self.inner_bias, 0.0)
        answer = hidden @ self.outer + self.outer_bias
        power = np.exp(answer - answer.max(axis=1, keepdims=True))
        return np.asarray(power / power.sum(axis=1, keepdims=True))

    def answer(self, evidence: Evidence, region: Region) -> Answer:
        """The surest kind and place of what a region shows."""
        places = candidates(evidence, region)
        share = self.probabilities(features(evidence, region, places))[:, 1:]
        possible = np.array([[kind in OF_SORT[place.sort] for kind in KINDS] for place in places])
        best = np.where(possible, share, 0.0)
        at, kind = np.unravel_index(int(best.argmax()), best.shape)
        each = best.max(axis=0)
        return Answer(KINDS[kind], places[at], dict(zip(KINDS, (each / each.sum()).tolist(), strict=True)))


@cache
def trained() -> Classifier:
    """The classifier that comes with the project."""
    return Classifier.load()
