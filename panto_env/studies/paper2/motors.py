"""Motors in the collector head (paper 2, section 4.3): what proportional control of the contact force buys.

The pantograph is ``own-motor-head``, the line ``en50318-2002``, the motors ``head-motor``. The paper says
that actuators on the articulated frame reach low frequencies only and those in the head suspension medium
ones; ``at_power`` and ``at_force_limit`` compare frame, head and both under equal terms.

Then one collector on a bench, controlled by a DC motor (Figs 14 and 15). The collector is half of the head,
on half of its suspension, whose foot stands still; one of the two motors acts on it. It runs under a contact
point that moves as that of the line: the strongest harmonics of the span in the height of the contact wire
over the pantograph, found by a pass along the line without motors. Paper 2 says neither how the collector was
excited nor what it touched.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...analysis.simulation import simulate
from ...base.arrays import Array
from ...base.errors import InputError
from ...base.plotting import legend_above, panels, series_colour
from ...base.table import Table
from ...catalog import load_catenary, load_pantograph
from ...control import Task
from ...control.observation import Context
from ...metrics.figures import Figures
from ...metrics.low_pass import band_rms
from ...metrics.trajectory import Trajectory
from ...plant.actuators import actuator_settings
from ...plant.actuators.motor import MotorActuator
from ...plant.actuators.motor.step import MotorArrays
from ...plant.line_condition import DrawnLine, LineCondition
from ...plant.numerics import Numerics, Runs
from ...plant.plant import Plant
from ...plant.state import Place, Row
from ...plant.train import Train
from ..study import Comparison, Figure, Outcome, Report, said

PANTOGRAPH, CATENARY, MOTOR = "own-motor-head", "en50318-2002", "head-motor"
PLACES = ("frame", "head", "both")
CONTROL_INTERVAL = 2.5e-3
"""Own choice (s): a controller of its own beside the motors, as the board of the paper's rig."""
BANDS = ((0.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0))
"""Bands of frequency (Hz) of the contact force, the mean in none."""
GAINS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Gains (N/N) among which that of the minimum sigma is taken under a limit of force."""
GAIN_RANGE = (0.05, 8.0)  # gains (N/N) among which one of a given power is looked for
MEAN_SHIFT = 0.015  # own choice, of the mean force: beyond it a smaller sigma is that of another mean
SPANS = (10, 19)  # spans that the figures cover: the start has died out before


class ForceFeedback:
    """Force proportional to what the contact force lacks of a mean, in every place where there are motors."""

    def __init__(self, gain: float, mean: float) -> None:
        """Take a gain (N/N) and the contact force that is aimed at (N)."""
        self.gain, self.mean, self.name = gain, mean, f"force feedback, gain {gain:g}"

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


@cache
def without_motors(speed_kmh: float) -> MotorPass:
    """The pantograph as it is, with no motors on it."""
    return _kept(simulate(CATENARY, PANTOGRAPH, speed_kmh, record_droppers=False), "", 0.0, 0.0, 0.0, 0.0)


def motor_pass(speed_kmh: float, place: str, gain: float, mean: float, motor: str = MOTOR) -> MotorPass:
    """A pass under ``ForceFeedback`` of this gain (N/N) towards a mean contact force (N).

    motor: a preset, or one with values. With a gain of 0 the motors are there and driven by the head.

    Raises InputError where the pass leaves the plant's valid range.
    """
    actuator = cast(MotorActuator, actuator_settings(motor)).model_copy(update={"place": place})
    policy = ForceFeedback(gain, mean)
    taken: list[tuple[float, Array]] = []  # time (s) and energy (J) at each of the two ends of SPANS

    def watch(task: Task) -> None:
        plant = task.plant
        begin, end = plant.alignment.limits(SPANS)
        if plant.of(0, Row.STEP) * plant.of(0, Row.STRIDE) >= (begin, end - 1e-6)[min(len(taken), 1)]:
            motors = cast(MotorArrays, plant.actuators)
            taken[1:] = [(plant.of(0, Row.STEP) * plant.time_step, motors.energy(0))]

    given: dict[str, Any] = {"actuator": actuator, "control_interval": CONTROL_INTERVAL, "watch": watch}
    record = simulate(CATENARY, PANTOGRAPH, speed_kmh, policy, record_droppers=False, **given)
    if record.terminated:
        reason = record.ending.removesuffix(".")
        raise InputError(f"With motors on the {place} a gain of {gain:g} is too much: {reason}; take less.")
    (start, before), (stop, after) = taken
    supplied, copper = ((after - before) / (stop - start)).T  # W, (places,)
    borne = actuator.continuous_force**2 / actuator.shorted_damping
    return _kept(record, place, gain, supplied.sum(), copper.sum(), copper.max() / borne)


def _kept(record: Trajectory, place: str, gain: float, *watts_and_heat: float) -> MotorPass:
    bands = rms_by_band(record.contact_force[record.inside(SPANS)], record.time_step)
    figures, kept = record.summary(SPANS), map(float, watts_and_heat)
    return MotorPass(record.speed_kmh, place, gain, record, figures, bands, *kept)


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


def places_table(title: str, passive: MotorPass, passes: Sequence[MotorPass]) -> Table:
    """Change of the contact force's rms by band, sigma, and what it took; the first row has no motors.

    Electrical: what the supply gives, net. Mechanical: magnitude of force times speed, as in the benchmark.
    Heat: of the hottest place's armatures, over what they bear; beyond 100 % no train could go on so.
    """
    taken = ("motors on", "gain", "electrical (W)", "mechanical (W)", "heat (%)", "rms (N)")
    headings = (*taken, "F_m (N)", "σ (N)", *(f"{low:g}–{high:g} Hz (%)" for low, high in BANDS))
    first = "none", *"–––––", f"{passive.figures.mean:.1f}", f"{passive.figures.std:.2f}"
    rows: list[tuple[str, ...]] = [(*first, *(f"{rms:.2f} N" for rms in passive.bands))]
    for one in passes:
        watts = f"{one.power:.1f}", f"{one.record.mechanical_power(SPANS):.1f}", f"{100 * one.heat:.0f}"
        forces = f"{one.figures.effort:.1f}", f"{one.figures.mean:.1f}", f"{one.figures.std:.2f}"
        changes = (f"{change:+.0f}" for change in _changes(passive, one))
        rows.append((one.place, f"{one.gain:.2f}", *watts, *forces, *changes))
    return Table(title, headings, rows)


def _changes(passive: MotorPass, one: MotorPass) -> list[float]:
    """Change of the force's rms in each band (%)."""
    return [100 * (after / before - 1) for after, before in zip(one.bands, passive.bands, strict=True)]


HARMONICS = 4  # of the span, in the motion: as many cosines as a line can have
HIGHEST = 17  # harmonic up to which they are looked for: 20 Hz at 250 km/h
PAD_STIFFNESS, PAD_DAMPING = 25e3, 165.0
"""Own choice, of a pad between collector and contact point (N/m, N s/m): half of a strip's spring, and half
of the damper 2 sqrt(T m) that the contact wire is to fast motion, since half of a head is tested."""
TIME_STEP = 1.25e-3
RUN_SPANS, SHOWN_SPANS = 24, 16
"""The bench runs for the time of so many spans, of which the last ones are shown."""


@dataclass(frozen=True)
class BenchRun:
    """The contact force of the collector under one gain."""

    gain: float  # N/N; nan without a motor
    time: Array  # (n,): s
    force: Array  # (n,): N
    motor_force: Array  # (n,): N
    bands: tuple[float, ...]  # rms of the contact force in BANDS (N)
    power: float  # of the motor from the supply, over the whole run (W)

    @property
    def std(self) -> float:
        """Standard deviation of the contact force (N)."""
        return float(self.force.std())

    @property
    def spectrum(self) -> tuple[Array, Array]:
        """Frequencies (Hz) and amplitudes (N) of the contact force about its mean (Fig. 15)."""
        parts = np.fft.rfft(self.force - self.force.mean()) / len(self.force)
        return np.fft.rfftfreq(len(self.force), TIME_STEP), 2 * np.abs(parts)


def motion_of_line(record: Trajectory) -> Array:
    """The harmonics of greatest velocity: amplitude (m), turns per metre, phase (turns), (HARMONICS, 3)."""
    inside = record.inside(SPANS)
    spans, height = record.alignment.in_spans(record.position[inside]), record.wire[inside]
    orders = np.arange(1, HIGHEST + 1)
    parts = 2 * np.mean((height - height.mean()) * np.exp(-2j * np.pi * np.outer(orders, spans)), axis=1)
    chosen = np.sort(np.argsort(-orders * np.abs(parts))[:HARMONICS])
    turns = orders[chosen] / record.alignment.mean_length
    return np.column_stack([np.abs(parts[chosen]), turns, np.angle(parts[chosen]) / (2 * np.pi)])


def bench_run(record: Trajectory, gain: float | None) -> BenchRun:
    """The collector under the contact point of a pass, and proportional control of this gain (N/N).

    None: without a motor. The target force is half of the mean of the pass.
    """
    target = 0.5 * float(record.contact_force[record.inside(SPANS)].mean())
    plant = _bench(record, target, gain is not None)
    span_time, steps = record.alignment.mean_length / record.speed, round(CONTROL_INTERVAL / TIME_STEP)
    controls, command = round(RUN_SPANS * span_time / CONTROL_INTERVAL), np.zeros((1, 1, 2))
    samples = plant.samples(steps * controls + 1)
    for _ in range(controls):
        command[0, 0, 1] = (gain or 0.0) * (target - plant.of(0, Row.CONTACT_FORCE))
        plant.advance(command, steps, samples)
    time = TIME_STEP * (np.arange(steps * controls) + 0.5)
    shown = time > time[-1] - SHOWN_SPANS * span_time
    rows, motors = samples.rows[0, 1:, 0][shown], plant.actuators
    force, motor_force = rows[:, Row.CONTACT_FORCE], rows[:, Row.HEAD_FORCE]
    supplied = motors.energy(0)[Place.HEAD, 0] if isinstance(motors, MotorArrays) else 0.0
    power = float(supplied) / (TIME_STEP * steps * controls)
    given = float("nan") if gain is None else gain
    return BenchRun(given, time[shown], force, motor_force, rms_by_band(force, TIME_STEP), power)


def _bench(record: Trajectory, target: float, driven: bool) -> Plant:
    """The bench at rest under a mean force (N), its contact point about to move as the line of a pass."""
    whole = load_pantograph(PANTOGRAPH)
    suspension = 0.5 * whole.stiffnesses[0]
    half = {
        "masses": (0.5 * whole.masses[0],),
        "stiffnesses": (suspension,),
        "dampings": (0.5 * whole.dampings[0],),
        # The suspension pulls back by what the pad gives way.
        "static_force": target * (PAD_STIFFNESS + suspension) / PAD_STIFFNESS,
        "aerodynamic_coefficient": 0.0,
        "contact_stiffness": PAD_STIFFNESS,
        "contact_damping": PAD_DAMPING,
    }
    even = {"mean_stiffness": 1e8, "stiffness_variation": 0.0}
    point = load_catenary("periodic-stiffness").model_copy(update=even)
    # A condition with room for as many waves; theirs are replaced by those of the motion.
    room = LineCondition(irregularity=1.0, wear_depth=1e-3, wear_wavelength=100.0)
    motor = actuator_settings(f"{MOTOR}:motors=1,force_limit=50" if driven else "ideal:place=head")
    train = Train.of(whole.model_copy(update=half), actuator=motor)
    plant = Plant(point, train, numerics=Numerics(time_step=TIME_STEP), runs=Runs(conditions=(room,)))
    plant.start(0, record.speed, [DrawnLine(room, motion_of_line(record))])
    return plant


SPEEDS_KMH = (250.0, 300.0)
WATTS, NEWTONS = 15.0, 50.0
"""Electrical power of all motors, and maximum force at each place, at which places are compared."""
BENCH_KMH, BENCH_GAINS = 250.0, (1.0, 2.0, 4.0)
HEAD_GAIN = 2.0  # of the proportional control on the whole pantograph, beside that of the bench (N/N)
LOW, MEDIUM = 0, (2, 3)
"""Bands, by their places in BANDS: what "low" and "medium" frequencies are taken to be."""
LARGE = 0.1  # share of the maximum harmonic from which on a harmonic counts as large
SHOWN = 3.0  # seconds of Fig. 14


def outcome(report: Report) -> Outcome:
    """Tables and statements on motors in the head and on the frame, and the bench's figures."""
    report("one collector on a bench", 0.0)
    record = without_motors(BENCH_KMH).record
    bench = [bench_run(record, gain) for gain in (None, *BENCH_GAINS)]
    tables, numbers = [], {}
    for k, speed_kmh in enumerate(SPEEDS_KMH):
        report(f"motors at {speed_kmh:g} km/h", 0.1 + 0.45 * k)
        passive, at = without_motors(speed_kmh), f"{speed_kmh:g} km/h"
        at_watts = [at_power(speed_kmh, place, WATTS) for place in PLACES]
        at_newtons = [at_force_limit(speed_kmh, place, NEWTONS) for place in PLACES]
        gained = [motor_pass(speed_kmh, "head", HEAD_GAIN, passive.figures.mean)]
        if k == 0:
            comparisons = _statements(passive, at_watts[0], at_watts[1], bench[0], bench[2])
        numbers[at] = {"none": _plain(passive)}
        for title, words, passes in (
            (f"Motors at {at} that take {WATTS:g} W", f"{WATTS:g} W", at_watts),
            (f"Motors of at most {NEWTONS:g} N at {at}", f"{NEWTONS:g} N", at_newtons),
            (f"Proportional control at {at} by the head's motors", f"gain {HEAD_GAIN:g}", gained),
        ):
            tables.append(places_table(title, passive, passes))
            numbers[at][words] = {one.place: _plain(one) for one in passes}
    of_bench = [{name: getattr(one, name) for name in ("gain", "std", "bands", "power")} for one in bench]
    return Outcome(
        "Paper 2, section 4.3: motors in the head",
        comparisons,
        tuple(tables),
        {"fig14-15-bench": _plot(bench)},
        {"motors": numbers, "bench": of_bench},
    )


def _statements(
    passive: MotorPass, frame: MotorPass, head: MotorPass, free: BenchRun, controlled: BenchRun
) -> tuple[Comparison, ...]:
    """The paper's words on where actuators work, at equal power, and on the bench."""
    on_frame, on_head = _changes(passive, frame), _changes(passive, head)
    names = {
        "at": f"at {passive.speed_kmh:g} km/h and {WATTS:g} W",
        "low": f"{BANDS[LOW][0]:g}-{BANDS[LOW][1]:g} Hz",
        "medium": f"{BANDS[MEDIUM[0]][0]:g}-{BANDS[MEDIUM[-1]][1]:g} Hz",
    }
    before, after = free.spectrum[1], controlled.spectrum[1]
    worst = float((after / np.maximum(before, 1e-9))[before > LARGE * before[1:].max()].max())
    return (
        said("motors-frame-low", on_frame[LOW], **names),
        said("motors-frame-medium", max(on_frame[k] for k in MEDIUM), **names),
        said("motors-head-medium", max(on_head[k] for k in MEDIUM), **names),
        said("bench-std", controlled.std / free.std, gain=controlled.gain),
        said("bench-harmonic", worst, gain=controlled.gain),
    )


def _plain(one: MotorPass) -> dict[str, object]:
    kept = {"gain": one.gain, "watts": one.power, "heat": one.heat, "bands": one.bands}
    return kept | {"largest_force": one.largest_force, "figures": one.figures.as_dict()}


def _plot(bench: Sequence[BenchRun]) -> Figure:
    """Fig. 14 and Fig. 15: contact force of the collector on the bench over time, and its spectrum."""
    figure, (over_time, over_frequency) = panels((10, 7), 2)
    for k, one in enumerate(bench):
        label = "without motor" if k == 0 else f"gain {one.gain:g}"
        style = {"color": "black" if k == 0 else series_colour(k), "linewidth": 1.2}
        shown = one.time < one.time[0] + SHOWN
        over_time.plot(one.time[shown] - one.time[0], one.force[shown], label=label, **style)
        frequency, amplitude = one.spectrum
        inside = (frequency > 0.2) & (frequency < BANDS[-1][1])
        over_frequency.plot(frequency[inside], amplitude[inside], **style)
    over_time.set(xlabel="time (s)", ylabel="contact force (N)", xlim=(0, SHOWN))
    over_frequency.set(xlabel="frequency (Hz)", ylabel="amplitude (N)", xlim=(0, BANDS[-1][1]))
    legend_above(over_time, 4)
    for axis in (over_time, over_frequency):
        axis.grid(color="0.92")
    words = f"line's motion at {BENCH_KMH:g} km/h, as Figs 14 and 15 of paper 2"
    figure.suptitle(f"One collector on a bench, {words}")
    return figure
