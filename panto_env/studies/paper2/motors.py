"""Motors in the collector head (paper 2, section 4.3): what proportional control of the contact force buys.

The pantograph is ``own-motor-head``, the line ``en50318-2002``, the motors ``head-motor``. The paper says
that actuators on the articulated frame reach low frequencies only and those in the head suspension medium
ones;
``at_power`` and ``at_force_limit`` compare frame, head and both under equal terms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...analysis.simulation import simulate
from ...base.arrays import Array
from ...base.errors import InputError
from ...base.table import Table
from ...control import Task
from ...control.observation import Context
from ...control.settings import far_enough, run_settings
from ...metrics.figures import Figures
from ...metrics.low_pass import band_rms
from ...metrics.trajectory import Trajectory
from ...plant.actuators import actuator_settings
from ...plant.actuators.motor import MotorActuator
from ...plant.actuators.motor.schema import MotorPower, motor_power
from ...plant.actuators.motor.step import MotorArrays
from ...plant.state import Place, Row

PANTOGRAPH, CATENARY, MOTOR = "own-motor-head", "en50318-2002", "head-motor"
PLACES = ("frame", "head", "both")
CONTROL_INTERVAL = 2.5e-3
"""Own choice (s): a controller of its own beside the motors, as the board of the paper's rig."""
BANDS = ((0.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0))
"""Bands of frequency (Hz) of the contact force, the mean in none."""
GAINS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Gains (N/N) among which that of the minimum sigma is taken under a limit of force."""
GAIN_RANGE = (0.05, 8.0)
"""Gains (N/N) among which one of a given power is looked for."""
MEAN_SHIFT = 0.015
"""Own choice, of the mean force: beyond it a smaller sigma is that of another mean."""
SPANS = (10, 19)
"""Spans that the figures cover: the start has died out before."""


class ForceFeedback:
    """Force proportional to what the contact force lacks of a mean, in every place where there are motors."""

    def __init__(self, gain: float, mean: float) -> None:
        """Take a gain (N/N) and the contact force that is aimed at (N)."""
        self.gain, self.mean = gain, mean

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._context = context

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        lacking = self.mean - self._context.layout.read(observation, "contact force")
        share = min(max(self.gain * lacking / self._context.force_limit, -1.0), 1.0)
        return np.full(self._context.actions, share)


@dataclass(frozen=True)
class MotorPass:
    """A pass, its figures over ``SPANS``, and what the motors took there."""

    speed_kmh: float
    place: str  # among PLACES, or "" without motors
    gain: float  # N/N
    record: Trajectory
    figures: Figures
    bands: tuple[float, ...]  # rms of the unfiltered contact force in BANDS (N)
    power: float  # mean of all motors from the supply, what they give back taken off (W)
    copper: float  # of it lost in the armatures (W)
    heat: float  # heat of the hottest place's armatures over what they bear for as long as one likes

    @property
    def largest_force(self) -> float:
        """Of the motors of one place, over SPANS (N)."""
        inside = self.record.inside(SPANS)
        forces = self.record.frame_force[inside], self.record.head_force[inside]
        return float(max(np.abs(force).max() for force in forces))


def rms_by_band(force: Array, time_step: float) -> tuple[float, ...]:
    """Rms (N) of a force in each of ``BANDS``."""
    return tuple(band_rms(force, time_step, *band) for band in BANDS)


def spectrum(force: Array, time_step: float) -> tuple[Array, Array]:
    """Frequencies (Hz) and amplitudes (N) of a force about its mean, sampled every ``time_step`` (s)."""
    parts = np.fft.rfft(force - force.mean()) / len(force)
    amplitude = 2 * np.abs(parts)
    return np.fft.rfftfreq(len(force), time_step), amplitude


def without_motors(speed_kmh: float) -> MotorPass:
    """The pantograph as it is, with no motors on it."""
    return _kept(simulate(CATENARY, PANTOGRAPH, speed_kmh, record_droppers=False), "", 0.0, 0.0, 0.0, 0.0)


def motor_pass(speed_kmh: float, place: str, gain: float, mean: float, motor: str = MOTOR) -> MotorPass:
    """A pass under ``ForceFeedback`` of this gain (N/N) towards a mean contact force (N).

    motor: a preset, or one with values. With a gain of 0 the motors are there and driven by the head.

    Raises InputError where the pass leaves the plant's valid range.
    """
    actuator = cast(MotorActuator, actuator_settings(motor)).model_copy(update={"place": place})
    task = Task(
        far_enough(
            run_settings(
                {
                    "catenary": CATENARY,
                    "pantograph": PANTOGRAPH,
                    "speed_kmh": speed_kmh,
                    "actuator": actuator,
                    "control_interval": CONTROL_INTERVAL,
                }
            )
        )
    )
    task.reset(0, np.random.default_rng(0))
    policy, results, plant = ForceFeedback(gain, mean), task.results, task.plant
    policy.reset(task.context(0))
    motors = cast(MotorArrays, plant.actuators)
    begin, end = plant.alignment.limits(SPANS)
    taken: list[tuple[float, Array]] = []  # time (s) and energy (J) at each of the two ends of SPANS
    while not (results.truncated[0] or results.terminated[0]):
        task.step(policy.act(results.observation[0])[None])
        if plant.of(0, Row.STEP) * plant.of(0, Row.STRIDE) >= (begin, end - 1e-6)[min(len(taken), 1)]:
            taken = [*taken[:1], (plant.of(0, Row.STEP) * plant.time_step, motors.energy(0))]
    record = task.trajectory(0, policy=f"force feedback, gain {gain:g}", last=True)
    if record.terminated:
        reason = record.ending.removesuffix(".")
        raise InputError(f"With motors on the {place} a gain of {gain:g} is too much: {reason}; take less.")
    (start, before), (stop, after) = taken
    supplied, copper = ((after - before) / (stop - start)).T  # W, (places,)
    borne = actuator.continuous_force**2 / actuator.shorted_damping
    return _kept(record, place, gain, supplied.sum(), copper.sum(), copper.max() / borne)


def _kept(record: Trajectory, place: str, gain: float, power: float, copper: float, heat: float) -> MotorPass:
    bands, figures = (
        rms_by_band(record.contact_force[record.inside(SPANS)], record.time_step),
        record.summary(SPANS),
    )
    watts = float(power), float(copper)
    return MotorPass(record.speed_kmh, place, gain, record, figures, bands, *watts, float(heat))


def at_power(speed_kmh: float, place: str, watts: float) -> MotorPass:
    """The pass whose motors take this much from the supply on average (W), within 1 %, by its gain.

    Raises InputError where no gain in ``GAIN_RANGE`` does.
    """
    from scipy.optimize import brentq  # slow to import

    mean, found = without_motors(speed_kmh).figures.mean, dict[float, MotorPass]()

    def lacking(logarithm: float) -> float:
        found[logarithm] = motor_pass(speed_kmh, place, math.exp(logarithm), mean, MOTOR)
        return math.log(max(found[logarithm].power, 1e-6) / watts)

    ends = [math.log(gain) for gain in GAIN_RANGE]
    if lacking(ends[0]) > 0 or lacking(ends[1]) < 0:
        low, high = (found[end].power for end in ends)
        raise InputError(
            f"Motors on the {place} take {low:.3g} to {high:.3g} W with gains from {GAIN_RANGE[0]:g} to "
            f"{GAIN_RANGE[1]:g} at {speed_kmh:g} km/h, never {watts:g} W; take a power between."
        )
    brentq(lacking, *ends, xtol=2e-3)
    nearest = min(found.values(), key=lambda one: abs(math.log(max(one.power, 1e-6) / watts)))
    if abs(nearest.power / watts - 1) > 0.01:
        raise InputError(
            f"No gain was found for {watts:g} W on the {place}: the power jumps there; take another power."
        )
    return nearest


def at_force_limit(speed_kmh: float, place: str, newtons: float, gains: Sequence[float] = GAINS) -> MotorPass:
    """The pass of minimum sigma among gains, with motors of this maximum force (N) at each place.

    Raises InputError where every gain moves the mean force by more than ``MEAN_SHIFT``.
    """
    mean = without_motors(speed_kmh).figures.mean
    passes = [motor_pass(speed_kmh, place, gain, mean, f"{MOTOR}:force_limit={newtons:g}") for gain in gains]
    kept = [one for one in passes if abs(one.figures.mean / mean - 1) <= MEAN_SHIFT]
    if not kept:
        raise InputError(
            f"Motors on the {place} of {newtons:g} N move the mean force by more than {100 * MEAN_SHIFT:g} % "
            f"with every gain among {', '.join(f'{gain:g}' for gain in gains)}; take smaller ones."
        )
    return min(kept, key=lambda one: one.figures.std)


def recorded_power(one: MotorPass, place: Place) -> MotorPower:
    """Current, voltage and watts over a whole pass, from its record; the pantograph has two masses."""
    motor, record = cast(MotorActuator, actuator_settings(MOTOR)), one.record
    if place == Place.FRAME:
        return motor_power(motor, record.frame_force, record.frame_velocity, record.time_step)
    apart = record.head_velocity - record.frame_velocity
    return motor_power(motor, record.head_force, apart, record.time_step)


def places_table(title: str, passive: MotorPass, passes: Sequence[MotorPass]) -> Table:
    """Change of the contact force's rms by band, sigma, and what it took; the first row has no motors.

    Electrical: what the supply gives, net. Mechanical: magnitude of force times speed, as in the benchmark.
    Heat: of the hottest place's armatures, over what they bear; beyond 100 % no train could go on so.
    """
    headings = [
        "motors on",
        "gain",
        "electrical (W)",
        "mechanical (W)",
        "heat (%)",
        "rms (N)",
        "F_m (N)",
        "σ (N)",
    ]
    headings += [f"{low:g}–{high:g} Hz (%)" for low, high in BANDS]
    first: list[Any] = ["none", *"–––––", f"{passive.figures.mean:.1f}", f"{passive.figures.std:.2f}"]
    rows = [(*first, *(f"{rms:.2f} N" for rms in passive.bands))]
    for one in passes:
        figures, pairs = one.figures, zip(one.bands, passive.bands, strict=True)
        changes = (f"{100 * (rms / before - 1):+.0f}" for rms, before in pairs)
        rows.append(
            (
                one.place,
                f"{one.gain:.2f}",
                f"{one.power:.1f}",
                f"{one.record.mechanical_power(SPANS):.1f}",
                f"{100 * one.heat:.0f}",
                f"{figures.effort:.1f}",
                f"{figures.mean:.1f}",
                f"{figures.std:.2f}",
                *changes,
            )
        )
    return Table(title, tuple(headings), tuple(rows))
