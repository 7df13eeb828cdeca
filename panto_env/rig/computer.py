"""The program of a rig's real-time computer: measured force in, displacement to command out."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.simulation import simulate
from ..backend import bind, pack
from ..base.arrays import Array, from_kmh
from ..base.errors import InputError
from ..catalog import load_catenary
from ..metrics.figures import SpanChoice
from ..metrics.low_pass import in_band
from ..metrics.trajectory import Trajectory
from ..plant.catenary.protocol import check_speeds
from ..plant.catenary.rig import Rig, RigData
from ..plant.catenary.rig.step import RigRow, sample
from ..plant.line_condition import DrawnLine, LineCondition
from ..plant.numerics import Numerics, Runs
from ..plant.state import Ending, reason


def load_rig(source: Any) -> RigData:
    """A rig of the catalogue, of a TOML file, or already loaded. Raises InputError for what is no rig."""
    data = load_catenary(source)
    if not isinstance(data, RigData):
        raise InputError(f"'{data.name}' is a line and not a rig; take a rig, such as 'rig-flexible'.")
    return data


class RigComputer:
    """Computes, sample by sample, where a line's contact point is under the force that is measured.

    ``step`` is to be called once in each sampling interval of the rig's computer. It allocates nothing that
    lasts and does the same work at each call, wherever the train is; memory does not grow. It goes through a
    compiled kernel, which ``__init__`` compiles or reads from disk, so that no call waits for that.
    """

    def __init__(
        self,
        rig: Any,
        speed_kmh: float,
        *,
        force: float,
        spans: int | None = None,
        numerics: Numerics | None = None,
    ) -> None:
        """Build the line, at rest under a force (N) at its start.

        rig: a rig of the catalogue, its TOML file, or ``RigData``. spans: of the line; by default as many as
        it has. Raises InputError for what is not valid.
        """
        data, speed = load_rig(rig), from_kmh(speed_kmh)
        self.interval = data.computer.interval
        """Between two calls of ``step`` (s)."""
        condition = LineCondition()
        runs = Runs((speed, speed), self.interval, (condition,))
        self._model = model = Rig(
            data, lanes=1, collectors=1, spans=spans or data.spans, numerics=numerics or Numerics(), runs=runs
        )
        check_speeds(data.name, model.wave_speed, [speed])
        self._drawn, self._start_force, self._range = DrawnLine(condition), force, data.load_cell.force_range
        self._free_uplift = data.free_uplift
        self._stride, self._limit = speed * self.interval, model.usual_end
        self._own = model.wire.table[0]
        self._sample = bind(sample, pack(model.line, model.wire), 0.0, 0.0)
        self.reset()
        self._sample(force, 0.0)  # the first call of a kernel takes longer than all others
        self.reset()

    def reset(self) -> None:
        """Put the line at rest at its start again."""
        self._model.settle(0, self._drawn, self._start_force)
        self._own[RigRow.STRIDE] = self._stride * self._model.time_step / self.interval

    @property
    def position(self) -> float:
        """Where the train is along the line (m)."""
        return float(self._own[RigRow.STEPS] * self._own[RigRow.STRIDE])

    @property
    def ended(self) -> bool:
        """Whether the train has come to the end of the line."""
        return self.position > self._limit - 2 * self._stride

    def step(self, force: float, displacement: float = 0.0) -> float:
        """Displacement to command next (m), from where the contact point is at rest.

        force: of the collectors, upwards, measured now (N). displacement: of the cylinder, measured
        now (m), from the same zero; only ``compensation = "adaptive"`` looks at it. Raises InputError, and
        leaves the line as it is, for a force that is no number or beyond the load cell's range, for a
        displacement that is no number, and at the line's end; and where the line has left its valid range.
        """
        if not abs(force) <= self._range:  # nor is NaN
            raise InputError(
                f"The measured force must lie within the load cell's range of ±{self._range:g} N, not at "
                f"{force:g} N; stop the rig."
            )
        if not math.isfinite(displacement):
            raise InputError(
                f"The measured displacement must be a number, not {displacement:g}; stop the rig."
            )
        if self.ended:
            raise InputError(f"The train is at the end of the line, at {self.position:.1f} m; call reset.")
        command: float = self._sample(force, displacement)
        if self._own[RigRow.STOPPED] > 0:
            ending = Ending(int(self._own[RigRow.STOPPED]))
            raise InputError(
                f"The computed line left its valid range at {self.position:.1f} m: "
                f"{reason(ending, self._free_uplift)}; stop the rig."
            )
        return command


SLEEP_UNTIL = 2e-4
"""Time before a deadline (s) until which the process sleeps; from then on it looks at the clock."""


@dataclass(frozen=True)
class Timing:
    """Times of a computer's steps, in one run against the clock."""

    interval: float  # s
    steps: Array  # (samples,): time that a step took (s)
    late: Array  # (samples,): how late it began (s)

    @property
    def missed(self) -> int:
        """Steps that were not done when the next one was due."""
        return int(np.count_nonzero(self.steps + self.late > self.interval))

    @property
    def headroom(self) -> float:
        """Intervals over the median step: how much more could be computed, were there no jitter."""
        return self.interval / float(np.median(self.steps))

    def of_step(self, share: float) -> float:
        """Time (s) within which this share of the steps was done."""
        return float(np.quantile(self.steps, share))


def against_the_clock(computer: RigComputer, seconds: float) -> Timing:
    """Step a computer at its interval for so long, under a force as of a pantograph, by the wall clock.

    At the line's end it begins anew. Python's garbage collector is off meanwhile, as a rig's program would
    have it. Raises InputError for a time without a step.
    """
    count, interval = round(seconds / computer.interval), computer.interval
    if count < 1:
        raise InputError(
            f"Against the clock a rig's computer must run for {interval:g} s or longer, a step of its own, "
            f"not for {seconds:g} s."
        )
    steps, late = np.zeros(count), np.zeros(count)
    force = 120 + 40 * np.sin(2 * np.pi * 1.2 * interval * np.arange(count))
    enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        start = time.perf_counter() + interval
        for k in range(count):
            due = start + k * interval
            while (left := due - time.perf_counter()) > 0:
                if left > SLEEP_UNTIL:
                    time.sleep(left - SLEEP_UNTIL)
            if computer.ended:
                computer.reset()
            begin = time.perf_counter()
            computer.step(force[k])
            steps[k], late[k] = time.perf_counter() - begin, begin - due
    finally:
        if enabled:
            gc.enable()
    return Timing(interval, steps, late)


BANDS = ((0.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, 40.0))
"""Bands (Hz) of a table."""
NARROW, HIGHEST = 2.5, 60.0
"""Width (Hz) of the bands by which the highest frequency followed is found, and where they end."""
FOLLOWED = 0.10
"""Error, as a share of the reference's rms in a band, up to which it is followed."""
SLOWEST_STEP = 2.5e-4
"""Time step (s) of both by default: the same, so that they differ by the rig alone."""


@dataclass(frozen=True)
class Band:
    """A band of frequency of one quantity."""

    low: float  # Hz
    high: float  # Hz
    reference: float  # rms, in the quantity's unit
    rig: float  # likewise
    error: float  # rms of the difference over the reference's rms


@dataclass(frozen=True)
class Pair:
    """A run on a rig and the same on the line itself."""

    reference: Trajectory
    rig: Trajectory
    spans: SpanChoice

    def bands(
        self, quantity: str = "contact_force", edges: Sequence[tuple[float, float]] = BANDS
    ) -> list[Band]:
        """Bands (Hz) of a quantity, an attribute of ``Trajectory``."""
        reference, rig = self.signals(quantity)
        found = []
        for low, high in edges:
            true, ours = (in_band(each, self.reference.time_step, low, high) for each in (reference, rig))
            size = rms(true)
            found.append(Band(low, high, size, rms(ours), rms(ours - true) / size if size else np.nan))
        return found

    def signals(self, quantity: str) -> tuple[Array, Array]:
        """A quantity of both, (samples,), over the spans, without its mean."""
        inside = self.reference.inside(self.spans)
        length = min(len(self.reference.time), len(self.rig.time))
        one, two = (getattr(run, quantity)[:length][inside[:length]] for run in (self.reference, self.rig))
        return one - one.mean(), two - two.mean()

    def followed(self) -> float:
        """Highest frequency (Hz) up to which each narrow band of the force is followed within a tenth."""
        edges = [(low, low + NARROW) for low in np.arange(0.0, HIGHEST, NARROW).tolist()]
        for band in self.bands(edges=edges):
            if not band.error <= FOLLOWED:
                return band.low
        return HIGHEST

    def first_lost(self) -> Band:
        """The first narrow band that is not followed, or the last one of all."""
        low = min(self.followed(), HIGHEST - NARROW)
        return self.bands(edges=[(low, low + NARROW)])[0]


def compare(
    rig: RigData, reference: Any, pantograph: Any, speed_kmh: float, spans: SpanChoice = None, **settings: Any
) -> Pair:
    """Run a pantograph on a rig and under a reference line; settings: of both runs.

    Raises InputError where either run ends early.
    """
    settings = {"time_step": SLOWEST_STEP, "record_droppers": False} | settings
    runs = [simulate(line, pantograph, speed_kmh, **settings) for line in (reference, rig)]
    for run in runs:
        if run.terminated:
            raise InputError(f"'{run.pantograph}' on '{run.catenary}' has nothing to compare: {run.ending}")
    return Pair(runs[0], runs[1], spans)


def rms(signal: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(signal**2)))
