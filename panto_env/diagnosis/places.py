"""What passes show along a line, and the places of it whose score is beyond the threshold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from ..plant.alignment import Alignment

ECHOES = ((1.3, np.inf), (2.5, 0.5), (4.0, 0.2))
"""Distance (spans) from a defect up to which less than such a share of its score counts as its own waves, as
simulated ones make them at 160 to 280 km/h. Nearer than the first none is distinguished."""


@dataclass(frozen=True)
class Evidence:
    """What one pass shows, or the mean of several, held against healthy ones."""

    position: Array  # (places,): m
    rest: Array  # (places,): force beside what healthy passes would have (N)
    score: Array  # (places,): 0 where the line is not judged
    threshold: float  # of the score
    alignment: Alignment  # of the line
    droppers: Array  # (droppers,): positions (m)
    speed: float  # m/s
    wave_speed: float  # m/s
    level: float  # of the rest where the passes are quiet (N)


class Region(NamedTuple):
    """A stretch of the line about a greatest score."""

    peak: int  # place
    first: int  # place where the score begins to be beyond the threshold
    last: int  # and the last one


def regions(evidence: Evidence) -> list[Region]:
    """Regions beyond the threshold, in their order along the line; waves of a greater one are none."""
    score = evidence.score
    edges = np.diff(np.concatenate([[False], score > evidence.threshold, [False]]).astype(int))
    found = [
        Region(int(first + np.argmax(score[first:end])), int(first), int(end) - 1)
        for first, end in np.flatnonzero(edges).reshape(-1, 2)
    ]
    kept: list[Region] = []
    for region in sorted(found, key=lambda each: -score[each.peak]):
        if not any(_echo(region, greater, evidence) for greater in kept):
            kept.append(region)
    return sorted(kept)


def _echo(region: Region, greater: Region, evidence: Evidence) -> bool:
    """Whether a region may be the waves of a greater one."""
    apart = abs(np.diff(evidence.alignment.in_spans(evidence.position[[region.peak, greater.peak]]))[0])
    share = next((share for within, share in ECHOES if apart <= within), 0.0)
    return bool(evidence.score[region.peak] < share * evidence.score[greater.peak])
