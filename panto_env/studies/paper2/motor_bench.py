"""One collector on a bench, controlled by a DC motor (paper 2, Figs 14 and 15).

The collector is half of the head of ``own-motor-head``, on half of its suspension, whose foot stands still;
one of the two motors acts on it. It runs under a contact point that moves as that of the line: the strongest
harmonics of the span in the height of the contact wire over the pantograph, found by a pass along the line
without motors. Paper 2 says neither how the collector was excited nor what it touched.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import Array
from ...catalog import load_catenary, load_pantograph
from ...metrics.trajectory import Trajectory
from ...plant.actuators import actuator_settings
from ...plant.actuators.motor.step import MotorArrays
from ...plant.line_condition import DrawnLine, LineCondition
from ...plant.numerics import Numerics, Runs
from ...plant.plant import Plant
from ...plant.state import Place, Row
from ...plant.train import Train
from .motors import CATENARY, CONTROL_INTERVAL, MOTOR, PANTOGRAPH, SPANS, rms_by_band, spectrum

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
