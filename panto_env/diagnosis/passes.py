"""The contact force that a diagnosis is made from: what an estimator on the train makes of its sensors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from pydantic import ValidationError

from ..base.arrays import Array, from_kmh, to_kmh
from ..base.errors import InputError
from ..base.record_columns import equal_step
from ..estimation.estimate import estimate
from ..estimation.model import EstimatorSettings
from ..estimation.motion import Motion, check_motion, measure, on_frame, warn_of_wind
from ..metrics.figures import FIRST_SETTLED
from ..metrics.low_pass import CUTOFF, zero_phase_low_pass
from ..metrics.trajectory import Trajectory
from ..plant.alignment import Alignment
from ..plant.pantograph.schema import PantographData
from ..records.record import repeated

RATE = 500.0
"""Samples of a sensor per second, own choice: as many as a fast simulation has, to look at 20 Hz."""
ESTIMATOR = EstimatorSettings(observation="displacements", gain="steady", lag=0.1)
"""Displacements are what is cheap to measure, and a diagnosis can wait. The gain is steady because the first
spans, where it would learn, are not judged."""
FEWEST_SAMPLES = 20
"""Samples below which a record has no time step to speak of."""
EVEN = 0.01
"""Relative difference up to which clock and positions are as a run states."""


def known_pantograph(run: Trajectory) -> PantographData:
    """The pantograph that an estimator takes a run's for: as known in the run, or as designed, by its values.

    Raises InputError where the run does not hold them.
    """
    try:
        known = run.settings.get("known_pantograph")
        return PantographData.model_validate(known) if known else run.designed.pantograph
    except (KeyError, ValidationError) as error:
        raise InputError(
            f"The run does not hold the masses and springs of its pantograph '{run.pantograph}', without "
            "which no force can be estimated; give its name or its TOML file with --pantograph."
        ) from error


def check_clock(run: Trajectory) -> None:
    """Raise InputError unless time and position go in equal steps, as large as the run states."""
    step = equal_step(run.time, FEWEST_SAMPLES, "to estimate a force")
    if not abs(step / run.time_step - 1) <= EVEN:
        raise InputError(
            f"Samples are {step:.4g} s apart, not {run.time_step:.4g} s as the run states: is its time in s?"
        )
    if not np.isfinite(run.position).all():
        raise InputError("Its position is no number somewhere; leave the run out.")
    if not np.abs(np.diff(run.position) / run.stride - 1).max() <= EVEN:
        mean = to_kmh(float(np.ptp(run.position) / np.ptp(run.time)))
        raise InputError(
            f"Its positions go at {mean:.4g} km/h in the mean, not evenly at the {run.speed_kmh:.4g} km/h "
            "that it states; leave the run out."
        )


def estimated_force(run: Trajectory, seed: int, pantograph: PantographData | None = None) -> Array:
    """Contact force (N), (n,), of a run's samples, to 20 Hz, as a smoother on the train estimates it.

    Sensors show displacements of head and frame with the noise of ``measure``. seed: of that; pantograph: as
    the estimator knows it, by default that of the catalogue which the run names. Raises InputError, with the
    likely mistake, where no force can be estimated.
    """
    known = known_pantograph(run) if pantograph is None else pantograph
    warn_of_wind(run)
    recorded = Motion(
        time_step=run.time_step,
        head=run.head,
        frame=run.frame,
        head_velocity=None,
        frame_velocity=None,
        frame_force=on_frame(run),
        head_force=run.head_force,
        lift=run.nominal_force,
        speed=run.speed,
        span=run.alignment.mean_length,
        start=float(run.time[0]),
    )
    check_motion(recorded, known)  # before there is noise, which would hide a dead sensor
    none = np.zeros(len(run.time))  # of what is not looked at, and need not have been recorded
    seen = replace(run, head_velocity=none, frame_velocity=none, contact_force=none)
    motion = replace(measure(seen, rate=RATE, seed=seed), head_velocity=None, frame_velocity=None)
    force = estimate(motion, known, ESTIMATOR).force
    return zero_phase_low_pass(np.interp(run.time, motion.time, force), run.time_step)


STEP = 0.5
"""Distance of the places at which forces are looked at (m), at most."""
PER_WAVE = 2.5
"""Places in the shortest wave that the force has, v / 20 Hz, at least."""
SPEEDS = 0.01
"""Relative difference of speed up to which passes can be compared: what 0.5 % does to a force is as much as
the noise of its estimate, at 250 km/h."""
LEAD = 1
"""Spans before those that are judged: what is predicted from its past wants a past."""
END = 10.0
"""Distance (m) before the end of a run that is not judged: a filter without delay needs what follows."""
FEWEST = 3
"""Healthy passes: each is held against the mean of the others."""


@dataclass(frozen=True)
class Passes:
    """Forces of several passes along spans that all of them cover; the first leads in, and is not judged."""

    force: Array  # (passes, places): estimated (N)
    alignment: Alignment  # of the line
    first: int  # spans before the first place
    per_span: int  # places in a span, as many in each
    droppers: Array  # (droppers,): positions along the line (m)
    line: str
    speed: float  # mean (m/s)
    wave_speed: float  # of the contact wire (m/s)

    @property
    def position(self) -> Array:
        """Of all places (m), (places,)."""
        return places_of(self.alignment, self.first, self.per_span, self.force.shape[1])

    @property
    def lead(self) -> int:
        """Places before those that are judged."""
        return LEAD * self.per_span

    def only(self, *numbers: int) -> Passes:
        """Some of the passes, counted from 0."""
        return replace(self, force=self.force[list(numbers)])

    @property
    def span(self) -> float:
        """Mean length of a span (m)."""
        return self.alignment.mean_length

    @property
    def step(self) -> float:
        """Mean distance between two places (m)."""
        return self.span / self.per_span


def places_per_span(span: float, speed_kmh: float) -> int:
    """Number of places in a span (m), so many that a train's force is known between them."""
    return math.ceil(span / min(STEP, from_kmh(speed_kmh) / CUTOFF / PER_WAVE) - 1e-9)


def places_of(alignment: Alignment, first: int, per_span: int, count: int) -> Array:
    """Positions (m), (count,), of places, so many in each span, from a number of spans on."""
    return np.asarray(alignment.support(first + np.arange(count) / per_span))


def side_by_side(
    runs: Sequence[Trajectory],
    healthy: Sequence[Trajectory],
    seed: int = 0,
    pantograph: PantographData | None = None,
) -> tuple[Passes, Passes]:
    """The runs to be judged, and the healthy ones, from the tenth span on: before, their start is felt.

    seed: of the sensors' noise; pantograph: as ``estimated_force`` takes it. Raises InputError where runs are
    too few or too short, are not of one line and speed, cannot be a pantograph's, or one stands there twice.
    """
    if len(healthy) < FEWEST:
        raise InputError(
            f"What healthy passes have in common takes at least {FEWEST} of them, not {len(healthy)}; "
            "give more with --healthy."
        )
    named = {f"Run {k}": run for k, run in enumerate(runs, start=1)}
    named |= {f"Healthy run {k}": run for k, run in enumerate(healthy, start=1)}
    everything = list(named.values())
    for name, run in named.items():
        if run.terminated:
            raise InputError(f"{run.ending} A run that ended early cannot be judged.")
        if run.followers:
            raise InputError(
                f"{name} is of {len(run.train)} pantographs, which feel each other's waves; a line is judged "
                "from runs of one pantograph."
            )
        with _named(name):
            check_clock(run)
    first, speed = everything[0], float(np.mean([run.speed_kmh for run in healthy]))
    for run in everything:
        _check_alike(run, first, speed)
    for _ in repeated((run.catenary, run.head) for run in everything):
        raise InputError("One run stands there twice, which says nothing new; give each once.")
    alignment, span = first.alignment, first.alignment.mean_length
    last = min(alignment.last_whole_span(run.distance - END) for run in everything)
    if last < FIRST_SETTLED:
        raise InputError(
            f"The shortest run ends at {min(run.distance for run in everything):.4g} m, but a run's start is "
            f"felt up to span {FIRST_SETTLED - 1}, and a whole span after it is required: run "
            f"{alignment.support(FIRST_SETTLED) + END:g} m or more."
        )
    per_span = places_per_span(span, speed)
    before = FIRST_SETTLED - 1 - LEAD
    places = places_of(alignment, before, per_span, (last - before) * per_span)
    forces = list[Array]()
    random = np.random.default_rng(seed)
    for name, run in named.items():
        with _named(name):
            own = estimated_force(run, int(random.integers(2**63)), pantograph)
        forces.append(np.interp(places, run.position, own))
    force = np.array(forces)
    droppers = next((run.dropper_position for run in everything if len(run.dropper_position)), np.zeros(0))
    if not len(droppers):
        raise InputError(
            "No run says where the line's droppers are; record one run with them, as `panto simulate` does."
        )
    facts = (alignment, before, per_span, droppers, first.catenary, from_kmh(speed), first.line.wave_speed)
    return Passes(force[: len(runs)], *facts), Passes(force[len(runs) :], *facts)


@contextmanager
def _named(run: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{run}: {error}") from error


def _check_alike(run: Trajectory, first: Trajectory, speed: float) -> None:
    """Raise InputError for a run that can't be compared with the others, whose mean speed is given (km/h)."""
    if run.catenary != first.catenary or not run.alignment.same_spans(first.alignment):
        raise InputError(
            f"Passes of different lines, '{run.catenary}' and '{first.catenary}', cannot be compared; give "
            "healthy passes of the line that is judged."
        )
    if abs(run.speed_kmh / speed - 1) > SPEEDS:
        raise InputError(
            f"Passes at {run.speed_kmh:.4g} and {speed:.4g} km/h cannot be compared: speeds may differ by "
            f"{100 * SPEEDS:g} %."
        )
