"""All samples of a record together, with the force as it is judged: behind EN 50317's low-pass, and raw."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..metrics.low_pass import CUTOFF, low_pass, zero_phase_low_pass
from ..metrics.spectrum import band_rms
from .record import Piece, Record

SETTLING = 0.2
"""Time (s) at the begin of each piece that is left out of filtered figures: by then EN 50317's filter, which
starts settled at the first sample, has forgotten all but 0.2 % of what that was wrong by."""
SPEED_OVER = 1.0
"""Time (s) over which the local speed is a mean, since odometers count in steps."""
ABOVE, LITTLE = 30.0, 0.05
"""Frequency (Hz) above which a force that was low-passed at 20 Hz has less than this share of what it has up
to 20 Hz, by rms. Behind EN 50317's filter simulated forces have 0.2 to 1.4 %, behind one of fourth order up
to 3.4 %, raw ones 7 to 40 %."""


def is_low_passed(piece: Piece) -> bool:
    """Whether the force of a piece was low-passed at about 20 Hz before it was recorded."""
    if piece.filtered is not None:
        return piece.filtered <= CUTOFF
    force = (piece.force - piece.force.mean()) * np.hanning(len(piece.force))
    above = band_rms(force, piece.time_step, ABOVE, 0.5 / piece.time_step)
    return above < LITTLE * band_rms(force, piece.time_step, 0.0, CUTOFF)


def local_speed(piece: Piece) -> Array:
    """Speed at each sample, the mean over ``SPEED_OVER`` about it, (n,), m/s."""
    half, count = round(0.5 * SPEED_OVER / piece.time_step), len(piece.force)
    begin = np.clip(np.arange(count) - half, 0, None)
    end = np.clip(np.arange(count) + half, None, count - 1)
    return np.asarray((piece.position[end] - piece.position[begin]) / ((end - begin) * piece.time_step))


@dataclass(frozen=True, eq=False)
class Samples:
    """The n samples of a record's pieces, one piece behind the other."""

    record: Record

    @cached_property
    def slices(self) -> list[slice]:
        """Samples of each piece."""
        ends = np.cumsum([len(piece.force) for piece in self.record.pieces])
        pairs = zip(ends.tolist(), self.record.pieces, strict=True)
        return [slice(end - len(piece.force), end) for end, piece in pairs]

    @cached_property
    def low_passed(self) -> bool:
        """Whether the record holds low-passed forces: then they are judged as they are, losses not at all."""
        return is_low_passed(self.record.longest)

    @property
    def shows_losses(self) -> bool:
        """Whether losses of contact can be seen: behind a low-pass the force does not fall to 0."""
        return not self.low_passed and self.record.longest.filtered is None

    @cached_property
    def raw(self) -> Array:
        """(n,): contact force as recorded (N)."""
        return np.concatenate([piece.force for piece in self.record.pieces])

    @cached_property
    def filtered(self) -> Array:
        """(n,): contact force behind EN 50317's low-pass (N), or as recorded where it was low-passed."""
        if self.low_passed:
            return self.raw
        return np.concatenate([low_pass(piece.force, piece.time_step) for piece in self.record.pieces])

    @cached_property
    def in_place(self) -> Array:
        """(n,): as ``filtered``, but without delay (N), for pictures and for comparisons by place."""
        if self.low_passed:
            return self.raw
        return np.concatenate(
            [zero_phase_low_pass(piece.force, piece.time_step) for piece in self.record.pieces]
        )

    @cached_property
    def settled(self) -> NDArray[np.bool_]:
        """(n,): samples whose filtered force counts."""
        if self.low_passed:
            return np.ones(len(self.raw), dtype=bool)
        pieces = self.record.pieces
        return np.concatenate([np.arange(len(one.force)) * one.time_step >= SETTLING for one in pieces])

    @cached_property
    def position(self) -> Array:
        """(n,): along the line (m)."""
        return np.concatenate([piece.position for piece in self.record.pieces])

    @cached_property
    def until(self) -> Array:
        """(n,): position of the next sample of the piece (m), of its last one as the speed has it."""
        found = []
        for piece in self.record.pieces:
            last = piece.position[-1] + piece.time_step * local_speed(piece)[-1]
            found.append(np.append(piece.position[1:], last))
        return np.concatenate(found)

    def way(self, inside: NDArray[np.bool_]) -> float:
        """Way (m) that samples inside, (n,), cover; what several pieces cover counts once."""
        begin, end = self.position[inside], self.until[inside]
        order = np.argsort(begin, kind="stable")
        begin, end = begin[order], np.maximum.accumulate(end[order])
        covered = np.concatenate([begin[:1], end[:-1]])  # up to where those before have been
        return float(np.maximum(end - np.maximum(begin, covered), 0.0).sum())

    @cached_property
    def speed(self) -> Array:
        """(n,): local speed (m/s)."""
        return np.concatenate([local_speed(piece) for piece in self.record.pieces])

    @cached_property
    def run(self) -> NDArray[np.intp]:
        """(n,): number of the run of each sample, by its first appearance from 0."""
        names = list(dict.fromkeys(piece.run for piece in self.record.pieces))
        counts = [len(piece.force) for piece in self.record.pieces]
        return np.repeat([names.index(piece.run) for piece in self.record.pieces], counts)

    @property
    def step(self) -> float:
        """Time from a sample to the next (s), the same in all pieces but for rounding."""
        return self.record.pieces[0].time_step
