"""Synthetic records: paper 1's Experiments I-III by its Table 1, and a frequency sweep; sensor noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from .model import HEAD, SUPPORT, Parameters
from .record import Record
from .response import contact_force, rest_on_plate, under_plate

SAMPLING = 1000.0
"""Samples per second. Own choice: the paper doesn't say."""

DURATION = 20.0
"""Length of a record (s). Own choice."""

RUN_IN = 5.0
"""Motion before the record begins (s), after which the start has died away to 1 part in 10^6."""

DISPLACEMENT_NOISE = 1e-6
"""White noise of a laser displacement sensor, rms (m). Own choice, a good sensor: the paper doesn't say."""

FORCE_NOISE = 0.02
"""White noise of the load sensor, rms (N). Own choice."""


@dataclass(frozen=True)
class Excitation:
    """How the contact plate moves: amplitude (m), offset (m), and frequency (Hz), swept where two differ."""

    name: str
    amplitude: float
    offset: float
    frequency: float
    last_frequency: float | None = None  # a sweep rises to it, evenly in time, over the record

    def plate(self, time: Array, duration: float) -> Array:
        """Displacement of the plate (m); before time 0 a sweep stays at its first frequency."""
        phase = self.frequency * time
        if self.last_frequency is not None:
            rise = (self.last_frequency - self.frequency) / duration
            phase = phase + rise * np.maximum(time, 0.0) ** 2 / 2
        return np.asarray(self.offset + self.amplitude * np.sin(2 * np.pi * phase))


EXPERIMENTS = (
    Excitation("I", 0.99e-3, 54.3e-3, 1.4219),
    Excitation("II", 1.89e-3, 54.3e-3, 0.91017),
    Excitation("III", 2.98e-3, 53.9e-3, 0.90335),
)
"""y_p1 of paper 1's Table 1."""

FREQUENCY_SWEEP = Excitation("sweep", 0.99e-3, 54.3e-3, 0.3, 4.0)
"""Own choice: Experiment I's plate, swept from 0.3 to 4 Hz; the contact force stays above 0."""


def clean_record(
    excitation: Excitation,
    parameters: Parameters,
    *,
    time_step: float = 1 / SAMPLING,
    duration: float = DURATION,
) -> Record:
    """What ideal sensors would see once the start has died away. time_step, duration: s."""
    before = round(RUN_IN / time_step)
    count = round(duration / time_step) + 1
    time = time_step * np.arange(-before, count)
    plate = excitation.plate(time, duration)
    states = under_plate(parameters, plate, time_step, rest_on_plate(parameters, excitation.offset))
    force = contact_force(parameters, plate, states, time_step)
    return Record(time_step, plate[before:], states[before:, HEAD], states[before:, SUPPORT], force[before:])


def add_noise(
    record: Record,
    generator: np.random.Generator,
    *,
    displacement: float = DISPLACEMENT_NOISE,
) -> Record:
    """The record with white noise on every sensor: of displacements (rms, m), and FORCE_NOISE."""
    noise = displacement * generator.standard_normal((3, len(record.plate)))
    force = record.force
    if force is not None:
        force = force + FORCE_NOISE * generator.standard_normal(len(force))
    return Record(
        record.time_step,
        record.plate + noise[0],
        record.head + noise[1],
        record.support + noise[2],
        force,
        record.start,
    )
