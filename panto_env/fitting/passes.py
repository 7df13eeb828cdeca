"""The two sides of a fit: a piece of a record as cosine coefficients of its force, and simulated passes.

Forces are compared by place, low-passed at 20 Hz without delay. The cosine transform of white noise is white,
so each coefficient tells something of its own; those of one band of frequencies have one variance, which is
estimated from what the fit leaves over. Slow ones are left out: drift of a sensor, wind, the driver.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..base.machine import cores
from ..metrics.low_pass import zero_phase_low_pass
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import DrawnLine, LineCondition
from ..plant.numerics import Numerics, Runs
from ..plant.pantograph.schema import PantographData
from ..plant.plant import Kept, Plant, go_on, keep
from ..plant.state import SAMPLE_ROWS, Row, Samples
from ..plant.train import Train
from ..records.record import Piece, local_speed

PER_SECOND = 50.0
"""Places at which forces are compared, per second of travel."""
HIGHEST = 18.0
"""Frequency (Hz) up to which they are: beyond it the 20 Hz low-pass leaves little."""
LONGEST = 2.0
"""Longest wave that is compared (spans)."""
BANDS = 6
"""Bands of frequencies, each with a variance of its own."""
CHANGES = 0.03
"""Relative deviation of a train's speed from its mean up to which it is fitted: the model's trains keep
theirs. Own choice."""


@dataclass(frozen=True)
class Measured:
    """What of one piece of a record is compared."""

    piece: Piece
    place: Array  # (places,): on the simulated line (m)
    offset: float  # of the record's positions from those on the simulated line (m)
    lowest: float  # frequency (Hz)

    @cached_property
    def smooth(self) -> Array:
        """Force of the record, low-passed (N), (samples,)."""
        return zero_phase_low_pass(self.piece.force, self.piece.time_step)

    @property
    def middle(self) -> float:
        """Middle of what is compared (m)."""
        return float(0.5 * (self.place[0] + self.place[-1]))

    def force(self, shift: float = 0.0, scale: float = 0.0) -> Array:
        """Measured force (N), (places,), where the record's positions are short.

        shift: by how much in the middle of what is compared (m). scale: by which share from there on.
        """
        position = self.piece.position - self.offset
        position = position + shift + scale * (position - self.middle)
        return between(self.smooth, np.interp(self.place, position, np.arange(len(position))))

    @cached_property
    def compared(self) -> Index:
        """Numbers of the coefficients that are compared."""
        frequency = np.arange(len(self.place)) * PER_SECOND / (2 * len(self.place))
        return np.flatnonzero((frequency >= self.lowest) & (frequency <= HIGHEST))

    @cached_property
    def band(self) -> Index:
        """Band of each coefficient that is compared, (coefficients,)."""
        return np.arange(len(self.compared)) * BANDS // len(self.compared)

    def coefficients(self, force: Array) -> Array:
        """Cosine coefficients that are compared, (..., coefficients), of forces, (..., places) (N)."""
        from scipy.fft import dct  # slow to import

        return np.asarray(dct(force, norm="ortho", axis=-1)[..., self.compared])

    def std(self, coefficients: Array) -> float:
        """Standard deviation (N) of the force that has these coefficients, (coefficients,)."""
        return float(np.sqrt(np.sum(coefficients**2) / len(self.place)))

    def back(self, coefficients: Array) -> Array:
        """Force (N), (..., places), that has these coefficients, (..., coefficients), and no others."""
        from scipy.fft import idct  # slow to import

        whole = np.zeros((*coefficients.shape[:-1], len(self.place)))
        whole[..., self.compared] = coefficients
        return np.asarray(idct(whole, norm="ortho"))


def measured(piece: Piece, offset: float, stretch: tuple[float, float], span: float) -> Measured:
    """Of a piece, what lies in a stretch of the simulated line (m).

    offset: as in ``Measured``; span: mean length of a span (m). Raises InputError where less than three spans
    remain, or the train's speed changes too much.
    """
    position = piece.position - offset
    begin, end = max(stretch[0], float(position[0])), min(stretch[1], float(position[-1]))
    if end - begin < 3 * span:
        raise InputError(
            f"It has only {max(end - begin, 0.0):.0f} m behind the spans in which a pass "
            f"settles; a fit takes at least three spans ({3 * span:.0f} m) there: give a longer record."
        )
    speed = local_speed(piece)  # of samples one by one it would be that of the odometer's steps
    speed = speed[(position >= begin) & (position <= end)]
    away = float(np.abs(speed / piece.speed - 1).max())
    if away > CHANGES:
        raise InputError(
            f"Its speed differs by up to {100 * away:.1f} % from the mean, and a fit takes at most "
            f"{100 * CHANGES:g} %; give a part of it at one speed."
        )
    place = np.arange(begin, end, piece.speed / PER_SECOND)
    return Measured(piece, place, offset, max(piece.speed / (LONGEST * span), 0.2))


def between(samples: Array, number: Array) -> Array:
    """Values of smooth samples, (..., n), at fractional numbers of them, (places,); cubic, by Lagrange.

    Linear ones would be 0.4 % too low at 18 Hz and 500 samples a second: too much for tensions.
    """
    first = np.clip(number.astype(int) - 1, 0, samples.shape[-1] - 4)
    t = number - first
    weights = (
        (1 - t) * (2 - t) * (3 - t) / 6,
        t * (2 - t) * (3 - t) / 2,
        t * (t - 1) * (3 - t) / 2,
        t * (t - 1) * (t - 2) / 6,
    )
    return np.asarray(sum(samples[..., first + k] * weight for k, weight in enumerate(weights)))


LANES = 8
"""Lanes of a plant, of which each core has one. They begin together, so fewer lanes compute less."""
LARGEST_FORCE = 2e3
"""Contact force (N) beyond which a computation has diverged."""


@dataclass(frozen=True)
class Variant:
    """One line and pantograph to be tried."""

    catenary: FlexibleCatenaryData
    line: DrawnLine
    pantograph: PantographData
    static_force: float  # N


class Passes:
    """Passes at one speed over variants of a line, from its first support on."""

    def __init__(
        self,
        catenary: FlexibleCatenaryData,
        pantograph: PantographData,
        condition: LineCondition,
        speed: float,
        distance: float,
        spans: int,
        numerics: Numerics,
    ) -> None:
        """speed: m/s; distance: of a pass (m); spans: of the line."""
        self._facts = (catenary, pantograph, condition), (distance, spans, numerics)
        self._fixed: dict[str, Any] = {
            "train": Train.of(pantograph),
            "spans": spans,
            "lanes": LANES,
            "numerics": numerics,
            "runs": Runs(speeds=(speed, speed), conditions=(condition,)),
            "varied": True,
        }
        self._idle: defaultdict[FlexibleCatenaryData, list[Plant]] = defaultdict(list)
        with self._lent(catenary) as first:
            self.speed, self.time_step = speed, first.time_step
        # Another damping must not have another grid and time step.
        same = {"time_step": first.time_step, "spacing": first.model.grid["spacing"]}
        self._fixed["numerics"] = numerics.model_copy(update=same)
        self.window = int(first.model.grid["window"])  # spans; 0: the whole line
        self.steps = int(distance / (speed * self.time_step))
        self.layout, self.alignment = catenary.layout(spans), first.alignment
        self.position = speed * self.time_step * (np.arange(self.steps) + 0.5)
        """Of the samples, (steps,) (m)."""

    def at(self, speed: float) -> Passes:
        """The same passes at another speed (m/s)."""
        before, behind = self._facts
        return Passes(*before, speed, *behind)

    @contextmanager
    def _lent(self, catenary: FlexibleCatenaryData) -> Iterator[Plant]:
        """A plant of a line, for one thread at a time; one that was given back where there is one."""
        idle = self._idle[catenary]
        plant = idle.pop() if idle else Plant(catenary, **self._fixed)
        yield plant
        idle.append(plant)

    def forces(self, variants: Sequence[Variant], begins: Array | None = None) -> Array:
        """Contact forces (N), (variants, steps). Raises InputError where a computation diverged.

        begins: (variants,): from which position on the force of each may differ from the first one's (m);
        before it, it is not computed anew. By default, all differ from the line's start on.
        """
        steps = np.zeros(len(variants), dtype=int)
        if begins is not None:
            steps = np.clip((begins / (self.speed * self.time_step)).astype(int), 0, self.steps)
        found, first = np.zeros((len(variants), self.steps)), variants[0].catenary
        late = [k for k in np.flatnonzero(steps).tolist() if variants[k].catenary == first]
        whole = defaultdict[FlexibleCatenaryData, list[int]](list)
        for k in sorted(set(range(len(variants))) - set(late)):
            whole[variants[k].catenary].append(k)
        shares = [(share, None) for own in whole.values() for share in _shares(own)]
        self._side_by_side(shares, variants, found)
        if late:
            of_late = _shares(sorted(late, key=lambda k: steps[k]))
            kept = self._kept(variants[0], [int(steps[share[0]]) for share in of_late])
            found[late] = found[0]
            self._side_by_side(list(zip(of_late, kept, strict=True)), variants, found)
        for catenary in set(self._idle) - {first}:
            del self._idle[catenary]
        return found

    def _side_by_side(
        self, shares: Sequence[tuple[list[int], Kept | None]], variants: Sequence[Variant], found: Array
    ) -> None:
        def run(share: tuple[list[int], Kept | None]) -> Array:
            own, kept = share
            with self._lent(variants[own[0]].catenary) as plant:
                return self._run(plant, [variants[k] for k in own], kept)

        with ThreadPoolExecutor(cores()) as pool:
            for (own, _), force in zip(shares, pool.map(run, shares), strict=True):
                found[own, self.steps - force.shape[1] :] = force

    def _kept(self, variant: Variant, steps: Sequence[int]) -> list[Kept]:
        kept = []
        with self._lent(variant.catenary) as plant:
            self._start(plant, [variant])
            table = self._samples(plant)
            for done, end in pairwise([0, *steps]):
                plant.advance_passively(end - done, table, 1)
                kept.append(keep(plant))
        return kept

    def _start(self, plant: Plant, variants: Sequence[Variant]) -> None:
        plant.start(
            np.arange(len(variants)),
            self.speed,
            [each.line for each in variants],
            [[each.pantograph] for each in variants],
            np.array([[each.static_force for each in variants]]),
        )

    def _run(self, plant: Plant, variants: Sequence[Variant], kept: Kept | None) -> Array:
        """Contact forces (N), (variants, steps), from a kept state on or from the line's start."""
        count, table = len(variants), self._samples(plant)
        if kept is None:
            self._start(plant, variants)
        else:
            go_on(plant, [each.line for each in variants], kept)
        first = int(plant.of(0, Row.STEP))
        plant.advance_passively(self.steps - first, table, count)
        force = table.rows[:count, first + 1 :, 0, Row.CONTACT_FORCE].copy()
        if not (np.isfinite(force).all() and np.abs(force).max(initial=0.0) < LARGEST_FORCE):
            raise InputError(
                "A simulated pass diverged while the line was fitted; check the pantograph, or free fewer "
                f"values: its contact force came to {np.abs(force).max():,.0f} N."
            )
        return force

    def _samples(self, plant: Plant) -> Samples:
        return Samples(
            rows=np.zeros((plant.lanes, self.steps + 1, 1, SAMPLE_ROWS)),
            uplift=np.zeros((plant.lanes, 0, self.steps + 1)),
            tension=np.zeros((plant.lanes, self.steps + 1, 0), dtype=np.float32),
            second=np.zeros((plant.lanes, 0, 1)),
        )


def _shares(which: Sequence[int]) -> list[list[int]]:
    """Numbers of variants in shares of even size, at most as many as a plant has lanes.

    Whatever the number of cores: lanes that are computed together round together.
    """
    count = -(-len(which) // LANES)
    return [share.tolist() for share in np.array_split(which, count)] if count else []
