"""Synthetic records: paper 1's Experiments I-III by its Table 1, and a frequency sweep; sensor noise."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..analysis.pool import Progress, in_processes
from ..base.arrays import Array
from .methods import identify
from .model import HEAD, IDENTIFIED, MEASURED, SUPPORT, Parameters, matrices
from .record import Record
from .response import contact_force, polynomials, respond

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
    a, b = matrices(parameters)
    at_rest = np.asarray(np.linalg.solve(a, -b[:, 0] * excitation.offset))
    states = respond(a, b, polynomials(plate, time_step), time_step, at_rest)
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
    plate, head, support = np.array(list(record.displacements.values())) + noise
    force = record.force
    if force is not None:
        force = force + FORCE_NOISE * generator.standard_normal(len(force))
    return Record(record.time_step, plate, head, support, force, record.start)


TRIALS_PER_JOB = 10
"""So many trials go to a process at a time."""


@dataclass(frozen=True)
class Trials:
    """Identifications of many noisy records of one experiment by one method, all parameters free."""

    values: Array  # (trials, 5): identified, nan where the method found nothing
    std: Array  # (trials, 5): as the method has it
    inside: Array  # (trials, 5): 1 where the truth lies inside its own 95 % interval, else 0

    @property
    def coverage(self) -> Array:
        """(5,): share of trials (%) whose interval holds the truth; finding nothing is a miss."""
        return np.asarray(100 * self.inside.mean(axis=0))


def run_trials(
    experiments: Sequence[tuple[Excitation, bool]],
    truth: Parameters,
    trials: int,
    *,
    progress: Progress | None = None,
) -> list[dict[str, Trials]]:
    """Trials of each excitation, with or without free offset, by method, on all cores.

    The noise is that of ``add_noise`` with seeds 0 to ``trials`` - 1.
    """
    starts = range(0, trials, TRIALS_PER_JOB)
    chunks = [range(start, min(start + TRIALS_PER_JOB, trials)) for start in starts]
    jobs = [
        partial(_run_seeds, excitation, free_offset, dict(truth), seeds)
        for excitation, free_offset in experiments
        for seeds in chunks
    ]
    parts = in_processes(jobs, progress=progress)
    results = []
    for first in range(0, len(parts), len(chunks)):
        own = parts[first : first + len(chunks)]
        rows = {method: np.concatenate([part[method] for part in own]) for method in own[0]}
        results.append({method: Trials(*np.moveaxis(stack, 1, 0)) for method, stack in rows.items()})
    return results


def _run_seeds(
    excitation: Excitation, free_offset: bool, truth: Parameters, seeds: range
) -> dict[str, list[Array]]:
    """By method, per trial: values, standard deviations and whether inside, (3, 5)."""
    clean = clean_record(excitation, truth)
    known = {name: truth[name] for name in MEASURED}
    true = np.array([truth[name] for name in IDENTIFIED])
    nothing = np.array([np.full(5, np.nan), np.full(5, np.nan), np.zeros(5)])
    rows = defaultdict[str, list[Array]](list)
    for seed in seeds:
        noisy = add_noise(clean, np.random.default_rng(seed))
        identified = identify(noisy, known, free_offset=free_offset)
        for method, fit in identified.fits.items():
            low, high = fit.interval.T
            rows[method].append(np.array([fit.values, fit.std, (low <= true) & (true <= high)]))
        for method in identified.failures:
            rows[method].append(nothing)
    return rows
