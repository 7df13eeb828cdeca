"""One collector on a bench, controlled by a DC motor (paper 2, Figs 14 and 15).

The collector is half of the head of ``own-motor-head``, on half of its suspension, whose foot stands still;
one of the two motors acts on it. It runs under a contact point that moves as that of the line: the strongest
harmonics of the span in the height of the contact wire over the pantograph, found by a pass along the line
without motors. Paper 2 says neither how the collector was excited nor what it touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import Array
from ...base.plotting import legend_above, series_colour
from ...catalog import load_catenary, load_pantograph
from ...metrics.trajectory import Trajectory
from ...plant.actuators import actuator_settings
from ...plant.actuators.motor.step import MotorArrays
from ...plant.line_condition import DrawnLine, LineCondition
from ...plant.numerics import Numerics, Runs
from ...plant.plant import Plant
from ...plant.state import Place, Row
from ...plant.train import Train
from ..study import Comparison, Outcome, Report
from .motors import (
    BANDS,
    CATENARY,
    CONTROL_INTERVAL,
    MOTOR,
    PANTOGRAPH,
    PLACES,
    SPANS,
    MotorPass,
    at_force_limit,
    at_power,
    motor_pass,
    places_table,
    rms_by_band,
    spectrum,
    without_motors,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


HARMONICS = 4
"""Of the span, in the motion: as many cosines as a line can have."""
HIGHEST = 17
"""Harmonic up to which they are looked for: 20 Hz at 250 km/h."""
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
    motion: Array  # (n,): of the contact point (m)
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
        """Frequencies (Hz) and amplitudes (N) of the contact force (Fig. 15)."""
        return spectrum(self.force, TIME_STEP)


def line_pass(speed_kmh: float) -> Trajectory:
    """The pass without motors whose contact point moves as the bench's."""
    return simulate(CATENARY, PANTOGRAPH, speed_kmh, record_droppers=False)


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
    plant, waves = _bench(record, target, gain is not None)
    span_time, steps = record.alignment.mean_length / record.speed, round(CONTROL_INTERVAL / TIME_STEP)
    controls, command = round(RUN_SPANS * span_time / CONTROL_INTERVAL), np.zeros((1, 1, 2))
    samples = plant.samples(steps * controls + 1)
    for _ in range(controls):
        command[0, 0, 1] = (gain or 0.0) * (target - plant.of(0, Row.CONTACT_FORCE))
        plant.advance(command, steps, samples)
    time = TIME_STEP * (np.arange(steps * controls) + 0.5)
    shown = time > time[-1] - SHOWN_SPANS * span_time
    rows = samples.rows[0, 1:, 0][shown]
    turns = np.outer(time[shown] * record.speed, waves[:, 1]) + waves[:, 2]
    motors = plant.actuators
    supplied = motors.energy(0)[Place.HEAD, 0] if isinstance(motors, MotorArrays) else 0.0
    return BenchRun(
        gain=float("nan") if gain is None else gain,
        time=time[shown],
        motion=np.cos(2 * np.pi * turns) @ waves[:, 0],
        force=rows[:, Row.CONTACT_FORCE],
        motor_force=rows[:, Row.HEAD_FORCE],
        bands=rms_by_band(rows[:, Row.CONTACT_FORCE], TIME_STEP),
        power=float(supplied) / (TIME_STEP * steps * controls),
    )


def _bench(record: Trajectory, target: float, driven: bool) -> tuple[Plant, Array]:
    """The bench at rest under a mean force (N), and the waves that the contact point goes through."""
    whole = load_pantograph(PANTOGRAPH)
    suspension = 0.5 * whole.stiffnesses[0]
    collector = whole.model_copy(
        update={
            "masses": (0.5 * whole.masses[0],),
            "stiffnesses": (suspension,),
            "dampings": (0.5 * whole.dampings[0],),
            # The suspension pulls back by what the pad gives way.
            "static_force": target * (PAD_STIFFNESS + suspension) / PAD_STIFFNESS,
            "aerodynamic_coefficient": 0.0,
            "contact_stiffness": PAD_STIFFNESS,
            "contact_damping": PAD_DAMPING,
        }
    )
    point = load_catenary("periodic-stiffness").model_copy(
        update={"mean_stiffness": 1e8, "stiffness_variation": 0.0}
    )
    # A condition with room for as many waves; theirs are replaced by those of the motion.
    room = LineCondition(irregularity=1.0, wear_depth=1e-3, wear_wavelength=100.0)
    motor = actuator_settings(f"{MOTOR}:motors=1,force_limit=50" if driven else "ideal:place=head")
    plant = Plant(
        point,
        Train.of(collector, actuator=motor),
        numerics=Numerics(time_step=TIME_STEP),
        runs=Runs(conditions=(room,)),
    )
    waves = motion_of_line(record)
    plant.start(0, record.speed, [DrawnLine(room, waves)])
    return plant, waves


SPEEDS_KMH = (250.0, 300.0)
WATTS, NEWTONS = 15.0, 50.0
"""Electrical power of all motors, and maximum force at each place, at which places are compared."""
BENCH_KMH, BENCH_GAINS = 250.0, (1.0, 2.0, 4.0)
HEAD_GAIN = 2.0
"""Of the proportional control on the whole pantograph, beside that of the bench (N/N)."""
LOW, MEDIUM = 0, (2, 3)
"""Bands, by their places in BANDS: what "low" and "medium" frequencies are taken to be."""
LARGE = 0.1
"""Share of the maximum harmonic from which on a harmonic counts as large."""
SHOWN = 3.0
"""Seconds of Fig. 14."""


def outcome(report: Report) -> Outcome:
    """Tables and statements on motors in the head and on the frame, and the bench's figures."""
    report("one collector on a bench", 0.0)
    record = line_pass(BENCH_KMH)
    bench = [bench_run(record, gain) for gain in (None, *BENCH_GAINS)]
    tables, numbers, powered = [], {}, {}
    for k, speed_kmh in enumerate(SPEEDS_KMH):
        report(f"motors at {speed_kmh:g} km/h", 0.1 + 0.45 * k)
        passive = without_motors(speed_kmh)
        at_watts = [at_power(speed_kmh, place, WATTS) for place in PLACES]
        at_newtons = [at_force_limit(speed_kmh, place, NEWTONS) for place in PLACES]
        gained = motor_pass(speed_kmh, "head", HEAD_GAIN, passive.figures.mean)
        powered[speed_kmh] = (passive, dict(zip(PLACES, at_watts, strict=True)))
        at = f"{speed_kmh:g} km/h"
        tables += [
            places_table(f"Motors at {at} that take {WATTS:g} W", passive, at_watts),
            places_table(f"Motors of at most {NEWTONS:g} N at {at}", passive, at_newtons),
            places_table(f"Proportional control at {at} by the head's motors", passive, [gained]),
        ]
        named = (
            (f"{WATTS:g} W", at_watts),
            (f"{NEWTONS:g} N", at_newtons),
            (f"gain {HEAD_GAIN:g}", [gained]),
        )
        numbers[at] = {"none": _plain(passive)} | {
            words: {one.place: _plain(one) for one in passes} for words, passes in named
        }
    return Outcome(
        title="Paper 2, section 4.3: motors in the head",
        comparisons=(*_statements(*powered[SPEEDS_KMH[0]]), *_bench_statements(bench)),
        tables=tuple(tables),
        plots={"fig14-15-bench": _plot(bench)},
        numbers={
            "motors": numbers,
            "bench": [
                {"gain": one.gain, "std": one.std, "bands": one.bands, "power": one.power} for one in bench
            ],
        },
    )


def _statements(passive: MotorPass, passes: dict[str, MotorPass]) -> tuple[Comparison, ...]:
    """The paper's words on where actuators work, at equal power."""
    changes = {place: _changes(passive, one) for place, one in passes.items()}
    medium = {place: max(change[k] for k in MEDIUM) for place, change in changes.items()}
    at = f"at {passive.speed_kmh:g} km/h and {WATTS:g} W"
    low, high = BANDS[LOW], (BANDS[MEDIUM[0]][0], BANDS[MEDIUM[-1]][1])
    words = {place: f"motors on the {place} {at}: change of the force" for place in ("frame", "head")}
    band = {"low": f"{low[0]:g}-{low[1]:g} Hz", "medium": f"{high[0]:g}-{high[1]:g} Hz, the worse half"}
    frame_words = "on the frame, effectiveness is limited to the low frequency range"
    head_words = "in the head suspension it is more effective in the medium frequency range"
    return (
        Comparison(
            f"{words['frame']}, {band['low']}", "%", changes["frame"][LOW], frame_words, -100.0, -20.0
        ),
        Comparison(f"{words['frame']}, {band['medium']}", "%", medium["frame"], frame_words, -10.0, 25.0),
        Comparison(f"{words['head']}, {band['medium']}", "%", medium["head"], head_words, -100.0, -20.0),
    )


def _bench_statements(bench: Sequence[BenchRun]) -> tuple[Comparison, ...]:
    free, controlled = bench[0], bench[2]
    note = f"gain {controlled.gain:g}; the paper prints neither the gain nor what the collector touched"
    words = "reduction of the contact force fluctuation with active control (Figs 14 and 15)"
    before, after = free.spectrum[1], controlled.spectrum[1]
    worst = float((after / np.maximum(before, 1e-9))[before > LARGE * before[1:].max()].max())
    return (
        Comparison(
            "σ on the bench, with control over without", "", controlled.std / free.std, words, 0.0, 0.9, note
        ),
        Comparison("the same of the large harmonic that is reduced least", "", worst, words, 0.0, 1.0, note),
    )


def _changes(passive: MotorPass, one: MotorPass) -> list[float]:
    """Change of the force's rms in each band (%)."""
    return [100 * (after / before - 1) for after, before in zip(one.bands, passive.bands, strict=True)]


def _plain(one: MotorPass) -> dict[str, object]:
    return {
        "gain": one.gain,
        "watts": one.power,
        "heat": one.heat,
        "bands": one.bands,
        "largest_force": one.largest_force,
        "figures": one.figures.as_dict(),
    }


def _plot(bench: Sequence[BenchRun]) -> Figure:
    """Fig. 14 and Fig. 15: contact force of the collector on the bench over time, and its spectrum."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    over_time, over_frequency = figure.subplots(2, 1)
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
    figure.suptitle(
        f"One collector on a bench, line's motion at {BENCH_KMH:g} km/h, as Figs 14 and 15 of paper 2"
    )
    return figure
