"""What a classifier is shown of a place near which the score is beyond the threshold."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from .places import Evidence, Region

AHEAD = 27.0
"""Way (m) either side of the greatest score within which a defect may be that causes it."""
SUPPORTS = 35.0
"""Likewise of supports: two of them at least on lines of usual spans."""
OFFSETS = np.arange(-24.0, 33.0, 1.5)
"""Places (m) about a candidate at which force and score are shown."""
SCALE = 30.0
"""Way (m) either side of the greatest score over which the rest has its scale."""


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
    supports = alignment.support(alignment.supports_within(peak - near, peak + near))
    wire = np.arange(np.ceil(peak - AHEAD), peak + AHEAD)
    return [
        Candidate(float(position), sort)
        for sort, positions in ((Sort.DROPPER, droppers), (Sort.SUPPORT, supports), (Sort.WIRE, wire))
        for position in positions
    ]


def features(evidence: Evidence, region: Region, places: list[Candidate]) -> Array:
    """(candidates, features): shape of rest and score about each, then how strong, where and how fast."""
    x, score, rest = evidence.position, evidence.score, evidence.rest
    peak = region.peak
    scale = float(np.sqrt((rest[np.abs(x - x[peak]) < SCALE] ** 2).mean()))
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
            np.interp(seen, x, rest) / scale,
            np.sqrt(np.interp(seen, x, score) / score[peak]),
            np.tile(common, (len(places), 1)),
            np.array(where).T,
            np.array(sorts, dtype=float).T,
        ],
        axis=1,
    )
