"""Estimated memory and computing time of a run; too large a run is refused before it begins."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..base import machine
from ..base.arrays import Array, from_kmh
from ..base.errors import InputError, beside
from ..plant.catenary import CATENARIES
from ..plant.catenary.schema import MOST_SPANS
from ..plant.plant import Plant
from ..plant.speed import ahead, largest_drift, largest_lag
from ..plant.state import SAMPLE_ROWS
from .settings import RunSettings, speed_range

COPIES = 2
"""Copies of a record in memory: the arrays of the run, and the trajectory."""
SHARE = 0.7
"""Maximum share of the machine's memory for records."""
STEP, NUMBER = 1e-6, 0.5e-9
"""Computing time (s) of a time step, and for each number of the state (of a wire, of a delay line)."""
LONGEST = 12 * 3600.0
"""Maximum computing time of a run (s)."""
FEW_LANES = 1024
"""Number of lanes that fit into any machine; the memory of more is checked before they are created."""
REMEDY = "take a shorter distance, fewer spans, a higher speed or a longer time step"


class Cost(NamedTuple):
    """Cost of a run, or of several at once."""

    steps: float  # of the plant, in the longest episode of a lane
    memory: float  # bytes, of the record
    seconds: float  # of computing, on one core

    def check(self, what: str, remedy: str = "") -> None:
        """Raise InputError where the cost exceeds the machine's memory, or the time ``LONGEST``.

        what: name of the run for the message; remedy: an additional way out, beginning with ", or".
        """
        there = machine.memory()
        if self.memory > SHARE * there:
            time = f", and to compute it {in_words(self.seconds)}" if self.seconds else ""
            raise InputError(
                f"The record of {what} would take {gigabytes(self.memory)}, but this machine has "
                f"{gigabytes(there)} of memory{time}; {REMEDY}{remedy}."
            )
        if self.seconds > LONGEST:
            raise InputError(
                f"To compute {what} would take {in_words(self.seconds)}, but the maximum for a run is "
                f"{in_words(LONGEST)}; {REMEDY}{remedy}."
            )


def check_record(needed: float, what: str) -> None:
    """Raise InputError unless the machine has the memory (bytes) for a record."""
    Cost(0.0, needed, 0.0).check(what)


def arrays_of(fields: Any) -> Iterable[np.ndarray[Any, Any]]:
    """The arrays of a named tuple, at any depth."""
    for each in fields:
        if isinstance(each, np.ndarray):
            yield each
        elif isinstance(each, tuple):
            yield from arrays_of(each)


def gigabytes(size: float) -> str:
    """A size (bytes) with its unit."""
    return f"{size / 1e9:,.1f} GB" if size < 1e18 else f"{size / 1e9:.1e} GB"


def in_words(seconds: float) -> str:
    """An approximate duration with its unit, from years to seconds."""
    for unit, length in (("years", 365.25 * 86400), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length:
            count = seconds / length
            return f"about {count:,.0f} {unit}" if count < 1e9 else f"about {count:.1e} {unit}"
    return f"about {seconds:.0f} seconds"


def spans(settings: RunSettings) -> int | None:
    """Number of spans: as given, or as many as the distance needs, at least the line's own; None: its own."""
    line = settings.line
    if settings.spans is not None or settings.distance is None:
        more = 0 if line.ends else math.ceil(settings.settle)
        return line.spans + more if settings.spans is None and more else settings.spans
    before = settings.run_in + settings.settle
    last: int = math.ceil(line.alignment().in_spans(settings.distance + settings.train.length) + before)
    most, clear = (line.spans, 0) if line.ends else (MOST_SPANS, 1)  # a train may run up to a line's end
    if not line.ends and last >= line.spans:
        clear = CATENARIES[line.kind].clear_spans(line, settings.numerics, settings.runs, last)
    needed = last + clear
    if needed > most:
        longest = line.alignment().support(max(math.floor(most - clear - before), 0))
        behind = f", behind {before:g} spans before the run," if before else ""
        raise InputError(
            f"distance must be at most {longest:,g} m on line '{line.name}'{behind} not "
            f"{beside(settings.distance, longest, ',.6g')} m."
        )
    return max(line.spans, needed)


def whole_steps(control_interval: float, time_step: float) -> int:
    """Time steps in a control interval. Raises InputError where that is not a whole number."""
    steps = round(control_interval / time_step)
    if steps < 1 or abs(steps * time_step - control_interval) > 1e-9:
        raise InputError(
            f"control_interval must be a whole number of time steps of {1e3 * time_step:g} ms, "
            f"not {1e3 * control_interval:g} ms."
        )
    return steps


def new_plant(settings: RunSettings, lanes: int) -> Plant:
    """The plant of a run with a number of lanes. Raises InputError where they do not fit into memory."""
    make_plant = partial(
        Plant,
        settings.line,
        settings.train,
        spans=spans(settings),
        numerics=settings.numerics,
        runs=settings.runs,
        bilateral=settings.bilateral,
        varied=settings.pantograph_scatter > 0,
        drifting=settings.drift_rows,
    )
    if lanes > FEW_LANES:
        few, there = make_plant(lanes=FEW_LANES), machine.memory()
        needed = lanes / FEW_LANES * sum(each.nbytes for each in arrays_of(few.arrays))
        if needed > SHARE * there:
            raise InputError(
                f"{lanes:,} lanes would take {gigabytes(needed)}, but this machine has {gigabytes(there)} of "
                "memory; take fewer."
            )
    return make_plant(lanes=lanes)


def cost_of(plant: Plant, steps: float, record: bool, record_droppers: bool) -> Cost:
    """Cost of a run of time steps in all lanes of a plant; record: whether all of them are recorded.

    Raises InputError where it is too large.
    """
    supports, lanes = len(plant.model.supports), plant.lanes
    near = min(supports, int(plant.model.grid.get("window", supports)) + 2)  # the others take no memory
    droppers = len(plant.model.droppers) if record_droppers else 0
    columns = SAMPLE_ROWS + near + droppers
    memory = COPIES * lanes * ((steps if record else 0) + 1.0) * columns * np.dtype(float).itemsize
    moving = sum(array.size for array in arrays_of((plant.model.wire, plant.actuators.table)))
    cost = Cost(steps, memory, steps * (lanes * STEP + moving * NUMBER))
    remedy = ", or keep no dropper's tension (record_droppers=False)" if droppers else ""
    cost.check(f"{steps:,.0f} time steps with {supports} supports and {droppers} droppers", remedy)
    return cost


class EpisodeLength:
    """Length of the episodes of a task, which depends on each lane's speed, run-in and drift."""

    def __init__(self, settings: RunSettings, plant: Plant) -> None:
        """Raises InputError for a distance, control interval or speed that is not possible on the plant."""
        self._drift, self._profile, self._plant = settings.drift, settings.speed_profile, plant
        self.settling = plant.alignment.support(settings.settle)  # m
        given = settings.distance
        train = plant.train.length
        if train >= plant.model.usual_end:
            raise InputError(
                f"The train's last pantograph is {train:g} m behind the first, and line "
                f"'{plant.catenary.name}' with {plant.spans} spans has {plant.model.usual_end:g} m for it; "
                "set more spans, or smaller distances."
            )
        # Of the first collector; the last one is to run as far as is given.
        self.distance = plant.model.usual_end if given is None else float(given) + self.settling + train
        if self.distance > plant.model.length:
            raise InputError(
                f"distance must be at most {plant.model.length - train:g} m on {plant.spans} spans, "
                f"not {beside(self.distance - train, plant.model.length - train, '.6g')} m; set more spans."
            )
        self.own_distance = self.distance - train  # of the last collector
        self.control_interval = settings.control_interval
        self.control_steps = whole_steps(settings.control_interval, plant.time_step)
        self.speed_range = self.check_speeds(settings.speed_kmh)
        stride = self.speed_range[1] * self.control_interval
        if self.distance < stride - 1e-9:
            raise InputError(
                f"distance must be at least the {stride:.4g} m that a train covers in one control interval "
                f"of {1e3 * self.control_interval:g} ms, not {self.distance:g} m."
            )
        # In the slowest run, after the longest run-in.
        slow = settings.speeds[0]
        run_in = np.ceil(plant.alignment.support(settings.run_in) / (slow * self.control_interval))
        lag = largest_lag(self._drift)  # of a train by its drift (m)
        self._late = math.ceil(lag / (slow * self.control_interval)) * self.control_steps
        self.most_plant_steps = float(self.plant_steps(slow, run_in)) + self._late

    def check_speeds(self, speed_kmh: Any) -> tuple[float, float]:
        """Lowest and highest speed (m/s) of a number or a range (km/h); InputError if not valid here."""
        low, high = map(from_kmh, speed_range(speed_kmh))
        drift = largest_drift(self._drift)
        least, most = (low, high) if self._profile is None else self._profile.range
        for speed in (least - drift, most + drift):
            self._plant.check_speed(speed)
        return low, high

    def plant_steps(
        self, speed: Any, run_in: Any = 0, drift: Array | None = None, distance: float | None = None
    ) -> Any:
        """Plant steps to an episode's end: whole control steps that cover the distance and stay on the line.

        speed: m/s, a number or an array. run_in: control steps before the episode begins. drift: of each
        speed, as in ``Plant.start``. distance: m, by default the whole episode's.
        """
        distance = self.distance if distance is None else distance
        stride = speed * self.control_interval
        if drift is not None:
            each = zip(stride, run_in, drift, strict=True)
            return np.array([self._drifting_steps(*one, distance) for one in each])
        needed = run_in + np.ceil(distance / stride - 1e-9)
        possible = self._plant.model.length / stride + 1e-9
        return np.maximum(1, np.floor(np.minimum(needed, possible))) * self.control_steps

    def _drifting_steps(self, stride: float, run_in: float, drift: Array, distance: float) -> int:
        """``plant_steps`` of one train with drift; stride: mean distance in a control step (m)."""
        lag, slowest, begin = largest_lag(self._drift), stride, stride * run_in
        if self._profile is not None:
            slowest = self._profile.range[0] * self.control_interval
            begin += ahead(drift[None], np.array([[run_in * self.control_steps]]))[0, 0]
        farthest = min(self._plant.model.length, begin + lag + distance) + lag
        steps = np.arange(math.ceil(farthest / slowest) + 1.0)
        position = stride * steps + ahead(drift[None], steps[None] * self.control_steps)[0]  # increasing
        needed = np.searchsorted(position, position[int(run_in)] + distance - 1e-9)
        possible = np.searchsorted(position, self._plant.model.length + 1e-9) - 1
        return max(1, min(int(needed), int(possible))) * self.control_steps

    @property
    def most_control_steps(self) -> int:
        """Control steps of the longest possible episode, at the lowest speed."""
        slow = self.speed_range[0] if self._profile is None else self._profile.range[0]
        return (int(self.plant_steps(slow)) + self._late) // self.control_steps
