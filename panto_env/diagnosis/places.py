"""Places along the line whose score is beyond the threshold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from .passes import Passes

ECHO = (1.0, 3.0)
"""Spans about a defect within which another is not told from its waves; and within which it is not, if its score
is less than ``FAINT`` of the greater one."""
FAINT = 0.1


class Region(NamedTuple):
    """A stretch of the line about a greatest score."""

    peak: int  # place
    first: int  # place where the score begins to be beyond the threshold
    last: int  # and the last one


def regions(score: Array, level: float, passes: Passes) -> list[Region]:
    """Regions beyond a level, in their order along the line; waves of a greater one are none of their own."""
    beyond = np.flatnonzero(np.diff(np.concatenate([[False], score > level, [False]]).astype(int)))
    found = [
        Region(first + int(np.argmax(score[first:end])), int(first), int(end) - 1)
        for first, end in beyond.reshape(-1, 2)
    ]
    kept: list[Region] = []
    for region in sorted(found, key=lambda each: -score[each.peak]):
        if not any(_echo(region, other, score, passes.per_span) for other in kept):
            kept.append(region)
    return sorted(kept)


def _echo(region: Region, greater: Region, score: Array, per_span: int) -> bool:
    near, far = ECHO
    apart = abs(region.peak - greater.peak) / per_span
    return apart <= near or (apart <= far and bool(score[region.peak] < FAINT * score[greater.peak]))
