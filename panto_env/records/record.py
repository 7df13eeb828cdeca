"""A record of a measuring train, as pieces without gaps, at equal steps of time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from ..metrics.low_pass import CUTOFF, band_rms, low_pass, zero_phase_low_pass
from ..metrics.trajectory import Trajectory


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
        return self.length / (self.time_step * (len(self.force) - 1))

    @property
    def speed_kmh(self) -> float:
        """Mean speed of the train (km/h)."""
        return to_kmh(self.speed)

    @property
    def length(self) -> float:
        """Distance that the piece covers (m)."""
        return float(self.position[-1] - self.position[0])


@dataclass(frozen=True)
class Record:
    """Pieces in the order of the file, and what a reader should know about how they were made from it."""

    name: str
    pieces: tuple[Piece, ...]
    notes: tuple[str, ...] = ()  # sentences: gaps, what was left out, corrections

    @property
    def longest(self) -> Piece:
        """The piece that covers the longest distance."""
        return max(self.pieces, key=lambda piece: piece.length)


def repeated(series: Iterable[tuple[str, Array]]) -> Iterator[tuple[str, str]]:
    """Names of each two series that are the same, sample by sample."""
    known: dict[bytes, str] = {}
    for name, values in series:
        content = values.tobytes()
        if content in known:
            yield known[content], name
        known.setdefault(content, name)


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
        ends = accumulate((len(piece.force) for piece in self.record.pieces), initial=0)
        return [slice(*each) for each in pairwise(ends)]

    @cached_property
    def low_passed(self) -> bool:
        """Whether the record holds low-passed forces: then they are judged as they are, losses not at all."""
        return is_low_passed(self.record.longest)

    @property
    def shows_losses(self) -> bool:
        """Whether losses of contact can be seen: behind a low-pass the force does not fall to 0."""
        return not self.low_passed and self.record.longest.filtered is None

    def joined(self, of_piece: Callable[[Piece], NDArray[Any]]) -> NDArray[Any]:
        """(n,): an array of each piece, one behind the other."""
        return np.concatenate([of_piece(piece) for piece in self.record.pieces])

    @cached_property
    def raw(self) -> Array:
        """(n,): contact force as recorded (N)."""
        return self.joined(lambda piece: piece.force)

    @cached_property
    def filtered(self) -> Array:
        """(n,): contact force behind EN 50317's low-pass (N), or as recorded where it was low-passed."""
        if self.low_passed:
            return self.raw
        return self.joined(lambda piece: low_pass(piece.force, piece.time_step))

    @cached_property
    def in_place(self) -> Array:
        """(n,): as ``filtered``, but without delay (N), for pictures and for comparisons by place."""
        if self.low_passed:
            return self.raw
        return self.joined(lambda piece: zero_phase_low_pass(piece.force, piece.time_step))

    @cached_property
    def settled(self) -> NDArray[np.bool_]:
        """(n,): samples whose filtered force counts."""
        time = self.joined(lambda piece: np.arange(len(piece.force)) * piece.time_step)
        return (time >= SETTLING) | self.low_passed

    @cached_property
    def position(self) -> Array:
        """(n,): along the line (m)."""
        return self.joined(lambda piece: piece.position)

    @cached_property
    def until(self) -> Array:
        """(n,): position of the next sample of the piece (m), of its last one as the speed has it."""

        def following(piece: Piece) -> Array:
            last = piece.position[-1] + piece.time_step * local_speed(piece)[-1]
            return np.append(piece.position[1:], last)

        return self.joined(following)

    def distance(self, inside: NDArray[np.bool_]) -> float:
        """Distance (m) that samples inside, (n,), cover; what several pieces cover counts once."""
        begin, end = self.position[inside], self.until[inside]
        order = np.argsort(begin, kind="stable")
        begin, end = begin[order], np.maximum.accumulate(end[order])
        covered = np.concatenate([begin[:1], end[:-1]])  # up to where those before have been
        return float(np.maximum(end - np.maximum(begin, covered), 0.0).sum())

    @cached_property
    def speed(self) -> Array:
        """(n,): local speed (m/s)."""
        return self.joined(local_speed)

    @cached_property
    def run(self) -> NDArray[np.intp]:
        """(n,): number of the run of each sample, by its first appearance from 0."""
        names = list(dict.fromkeys(piece.run for piece in self.record.pieces))
        return self.joined(lambda piece: np.full(len(piece.force), names.index(piece.run)))

    @property
    def step(self) -> float:
        """Time from a sample to the next (s), the same in all pieces but for rounding."""
        return self.record.pieces[0].time_step


GRID = 0.25
"""Distance of the places (m) at which forces are compared: at 300 km/h, 20 Hz have a wavelength of 4 m."""
SEARCH, NEAR = 1.5, 0.5
"""Spans on each side within which a shift is searched: without any idea, and about one that is given."""
ENOUGH = 0.5
"""Share of the distance that the best-covered shift has in common with the run, from which others count."""


@dataclass(frozen=True)
class Shift:
    """What is added to a record's positions (m), and how well the forces then correlate."""

    value: float  # m
    correlation: float
    other: float  # m, the next best one at least a quarter of a span away; nan for none
    other_correlation: float
    search: tuple[float, float]  # m


def find_shift(samples: Samples, run: Trajectory, begin: float, end: float, near: float | None) -> Shift:
    """The shift with the highest correlation of forces without delay, from begin to end (m) of a run.

    A line of equal spans correlates at every span: the next best shift says how sure the best one is.

    near: about the shift (m), if known. Raises InputError where a record has less than a span in common with
    the run, wherever it is shifted.
    """
    span = run.alignment.mean_length
    middle, reach = (0.0, SEARCH * span) if near is None else (near, NEAR * span)
    lags = middle + GRID * np.arange(-math.ceil(reach / GRID), math.ceil(reach / GRID) + 1)
    places = np.arange(begin, end, GRID)
    own = np.interp(places, run.position, zero_phase_low_pass(run.contact_force, run.time_step))
    # The record on a grid that reaches further on both sides: a shift by a step is one by an index.
    there = begin - lags[-1] + GRID * np.arange(len(places) + len(lags) - 1)
    pieces = [
        np.interp(there, samples.position[part], samples.in_place[part], left=np.nan, right=np.nan)
        for part in samples.slices
    ]
    # Lag k reads the record at places - lags[k], which begins at index len(lags) - 1 - k.
    found = np.array([_correlation(own, pieces, len(lags) - 1 - k) for k in range(len(lags))])
    correlations, distances = found[:, 0], GRID * found[:, 1]
    if not distances.max() >= span:
        first, last = samples.position.min(), samples.position.max()
        raise InputError(
            f"The record runs from {first:,.0f} to {last:,.0f} m and the evaluated run from {begin:,.0f} to "
            f"{end:,.0f} m, so they have less than a span in common; give about what is to be added to the "
            f"record's positions: --shift {0.5 * (begin + end - first - last):.0f}."
        )
    correlations[(distances < ENOUGH * distances.max()) | ~np.isfinite(correlations)] = -1.0
    edged = np.concatenate([[-math.inf], correlations, [-math.inf]])
    peaks = np.flatnonzero((correlations >= edged[:-2]) & (correlations >= edged[2:])).tolist()
    best = max(peaks, key=lambda k: correlations[k])
    rest = [k for k in peaks if abs(lags[k] - lags[best]) > 0.25 * span]
    second = max(rest, key=lambda k: correlations[k], default=None)
    value, correlation = _vertex(lags, correlations, best)
    other = (math.nan, math.nan) if second is None else (float(lags[second]), float(correlations[second]))
    return Shift(value, correlation, *other, (float(lags[0]), float(lags[-1])))


def _correlation(own: Array, pieces: list[Array], begin: int) -> tuple[float, int]:
    """Correlation of the run's force, (n,), with the record's from an index on, and the number of places."""
    others = [piece[begin : begin + len(own)] for piece in pieces]
    known: list[NDArray[np.bool_]] = [~np.isnan(each) for each in others]
    a = np.concatenate([own[here] for here in known])
    b = np.concatenate([other[here] for other, here in zip(others, known, strict=True)])
    if len(a) < 2 or a.std() == 0 or b.std() == 0:
        return math.nan, len(a)
    return float(np.corrcoef(a, b)[0, 1]), len(a)


def _vertex(lags: Array, values: Array, k: int) -> tuple[float, float]:
    if not 0 < k < len(lags) - 1 or values[k - 1] <= -1.0 or values[k + 1] <= -1.0:
        return float(lags[k]), float(values[k])
    before, here, after = values[k - 1 : k + 2]
    bend = before - 2 * here + after
    offset = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float(lags[k] + GRID * offset), float(here - 0.25 * (before - after) * offset)
