"""A record of a measuring train, as pieces without gaps, at equal steps of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array, to_kmh


@dataclass(frozen=True)
class Piece:
    """n samples of one run without a gap; positions rise with time."""

    run: str  # name of the run
    time_step: float  # s
    start: float  # time of the first sample (s)
    position: Array  # (n,): along the line (m)
    force: Array  # (n,): contact force, with the inertia of the strips where it was measured (N)
    height: Array | None = None  # (n,): of the contact point over any zero (m)
    uplift: Array | None = None  # (n,): of the contact wire at one mast (m)
    filtered: float | None = None  # cut-off of a low-pass known to be in the force (Hz)

    @property
    def time(self) -> Array:
        """(n,): s."""
        return self.start + self.time_step * np.arange(len(self.force))

    @property
    def speed(self) -> float:
        """Mean speed of the train (m/s)."""
        return float((self.position[-1] - self.position[0]) / (self.time_step * (len(self.force) - 1)))

    @property
    def speed_kmh(self) -> float:
        """Mean speed of the train (km/h)."""
        return to_kmh(self.speed)

    @property
    def length(self) -> float:
        """Way that the piece covers (m)."""
        return float(self.position[-1] - self.position[0])


@dataclass(frozen=True)
class Record:
    """Pieces in the order of the file, and what a reader should know about how they were made from it."""

    name: str
    pieces: tuple[Piece, ...]
    notes: tuple[str, ...] = ()  # sentences: gaps, what was left out, corrections

    @property
    def longest(self) -> Piece:
        """The piece that covers the longest way."""
        return max(self.pieces, key=lambda piece: piece.length)
