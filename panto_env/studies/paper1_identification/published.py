"""What paper 1 prints of its identification (Tables 1 to 5), and what its Table 1 says of its Table 2."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...analysis.pool import Job, Progress, in_processes
from ...base.arrays import Array
from ...identification import (
    EXPERIMENTS,
    FREQUENCY_SWEEP,
    IDENTIFIED,
    MEASURED,
    METHODS,
    Excitation,
    Fit,
    Identification,
    Record,
    add_noise,
    clean_record,
    excited_band,
    fit_equation_error,
    identify,
)
from ...identification.model import Parameters, matrices


@dataclass(frozen=True)
class Published:
    """One experiment; displacements of y_p1, y_p2, y_p3 in mm as printed."""

    name: str
    frequency: float  # Hz
    force: tuple[float, float]  # amplitude, offset (N)
    amplitudes: tuple[float, float, float]  # mm
    offsets: tuple[float, float, float]  # mm
    values: tuple[float, ...]  # c1T, c2, m3, c3, k3 (SI), Tables 2 to 4
    rsd: tuple[float, ...]  # %
    condition: float
    performance: tuple[float, float, float]  # %, Table 5
    mean_error: tuple[float, float, float]  # mm, Table 5


PUBLISHED = (
    Published(
        "I", 1.4219, (1.83, 30.7862), (0.99, 0.99, 0.97), (54.3, 53.4, 51.2),
        (12.31, 0.11, 10.38, 50.92, 611.85), (2.8, 4.2, 15.6, 16.3, 102.4), 112.46,
        (75.5, 74.9, 75.6), (0.27, 0.26, 0.25),
    ),
    Published(
        "II", 0.91017, (2.03, 30.7913), (1.89, 1.88, 1.80), (54.3, 53.4, 51.1),
        (12.68, 0.31, 10.72, 51.92, 624.17), (5.5, 7.4, 20.3, 41.6, 155.4), 448.00,
        (66.1, 64.4, 65.9), (0.33, 0.32, 0.33),
    ),
    Published(
        "III", 0.90335, (2.23, 30.7682), (2.98, 2.96, 2.95), (53.9, 52.9, 50.9),
        (13.01, 0.74, 10.88, 52.30, 630.53), (8.4, 12.6, 29.2, 68.1, 188.7), 504.22,
        (63.6, 63.2, 64.3), (0.77, 0.76, 0.75),
    ),
)  # fmt: skip


def per_plate(parameters: Parameters, frequency: float) -> tuple[complex, complex, complex]:
    """Force (N/m), y_p2 and y_p3 per metre of plate motion at a frequency (Hz), complex: Eqs 1 and 2."""
    a, b = matrices(parameters)
    s = 2j * np.pi * frequency
    head, support, *_ = np.linalg.solve(s * np.eye(4) - a, b[:, 0] + s * b[:, 1])
    return complex((parameters["k1T"] + s * parameters["c1T"]) * (1 - head)), complex(head), complex(support)


@dataclass(frozen=True)
class Motion:
    """Of one series under the printed motion of the plate: the model's, then the printed one (N or mm)."""

    name: str  # "f_1", "y_p2" or "y_p3"
    amplitude: float
    offset: float
    printed_amplitude: float
    printed_offset: float

    @property
    def unit(self) -> str:
        """Of all four."""
        return "N" if self.name == "f_1" else "mm"


def expected(parameters: Parameters, printed: Published) -> tuple[Motion, Motion, Motion]:
    """The contact force f_1, then y_p2 and y_p3."""
    moving, still = per_plate(parameters, printed.frequency), per_plate(parameters, 0.0)

    def motion(name: str, series: int, scale: float, amplitude: float, offset: float) -> Motion:
        return Motion(
            name,
            scale * abs(moving[series]) * printed.amplitudes[0],
            scale * still[series].real * printed.offsets[0],
            amplitude,
            offset,
        )

    return (
        motion("f_1", 0, 1e-3, *printed.force),
        motion("y_p2", 1, 1.0, printed.amplitudes[1], printed.offsets[1]),
        motion("y_p3", 2, 1.0, printed.amplitudes[2], printed.offsets[2]),
    )


def best_performance(parameters: Parameters, printed: Published) -> float:
    """Largest P_f (%) of y_p1 that a model can reach if driven by Table 1's force, whatever its phase.

    Offset left out. With one phase free, two sinusoids differ at least by the difference of their amplitudes.
    """
    modelled = 1e3 * printed.force[0] / abs(per_plate(parameters, printed.frequency)[0])  # mm
    return float(100 * (1 - abs(modelled - printed.amplitudes[0]) / printed.amplitudes[0]))


def dry_friction(parameters: Parameters, printed: Published) -> float:
    """Dry friction (N) that would raise the model's force to Table 1's amplitude, by harmonic balance.

    A friction F_c against the velocity adds 4 F_c / pi to the part of the force in phase with it.
    """
    force = 1e-3 * printed.amplitudes[0] * per_plate(parameters, printed.frequency)[0]
    missing = np.sqrt(printed.force[0] ** 2 - force.real**2) - force.imag
    return float(np.pi / 4 * missing)


def largest_mean_error(printed: Published, channel: int) -> float:
    """Largest mean error (mm) that the printed P_f and amplitude allow: no mean exceeds its rms (Eq. 9)."""
    return (1 - printed.performance[channel] / 100) * printed.amplitudes[channel] / float(np.sqrt(2))


SAMPLINGS = (200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)
"""Samples per second; at the last, three-point derivatives are good to 0.5 % of every parameter."""
NOISES = (1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)
"""Noise of the displacement sensors, rms (m)."""
SEEDS = 5
"""Noisy records behind each point of a figure."""
SEEDS_OF_MEDIAN = 100
"""Noisy records behind each median of the relative standard deviation."""
LAST_FREQUENCIES = (0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 2.0, 4.0)
"""Of frequency sweeps from 0.3 Hz (Hz); the first is no sweep but a sine."""
RECORDS = (*EXPERIMENTS, FREQUENCY_SWEEP)
NOISY = ((EXPERIMENTS[0], False), (FREQUENCY_SWEEP, True))
"""Records whose errors over the noise are shown, and whether their offset is free."""


@dataclass(frozen=True)
class Computed:
    """Everything but the trials, by the name of the excitation where there are several."""

    offset_kept: dict[str, Identification]  # of one noisy record each, as the paper prints it
    offset_free: dict[str, Identification]  # the same records, their offset free
    sampling: dict[str, Array]  # errors (%), (SAMPLINGS, 5), without noise, as printed
    noise: dict[str, dict[str, list[float]]]  # largest error (%) by method, over NOISES
    medians: dict[str, list[float]]  # RSD (%), (5,), offset free, low-passed
    sweep_rsd: dict[bool, list[float]]  # RSD (%) of k3 by whether the offset is free, over LAST_FREQUENCIES


def compute(noisy: Mapping[str, Record], truth: Parameters, progress: Progress) -> Computed:
    """All of it, on all cores. noisy: records by the name of their excitation."""
    jobs: dict[Hashable, Job[Any]] = {}
    for excitation in RECORDS:
        name = excitation.name
        for free in (False, True):
            jobs["record", name, free] = partial(_identify, noisy[name], truth, free)
        for rate in SAMPLINGS:
            jobs["sampling", name, rate] = partial(_errors, excitation, truth, rate)
    for excitation, free in NOISY:
        for level in NOISES:
            jobs["noise", excitation.name, level] = partial(_errors_by_noise, excitation, truth, free, level)
    for excitation in EXPERIMENTS:
        jobs["median", excitation.name] = partial(_median_rsd, excitation, truth, True, SEEDS_OF_MEDIAN)
    for last in LAST_FREQUENCIES:
        for free in (False, True):
            jobs["sweep", last, free] = partial(_median_rsd, _sweep_to(last), truth, free, SEEDS)
    results = dict(zip(jobs, in_processes(list(jobs.values()), progress=progress), strict=True))
    names = [excitation.name for excitation in RECORDS]
    return Computed(
        offset_kept={name: results["record", name, False] for name in names},
        offset_free={name: results["record", name, True] for name in names},
        sampling={name: np.array([results["sampling", name, rate] for rate in SAMPLINGS]) for name in names},
        noise={
            excitation.name: {
                method: [results["noise", excitation.name, level][method] for level in NOISES]
                for method in METHODS
            }
            for excitation, _ in NOISY
        },
        medians={excitation.name: results["median", excitation.name] for excitation in EXPERIMENTS},
        sweep_rsd={
            free: [results["sweep", last, free][IDENTIFIED.index("k3")] for last in LAST_FREQUENCIES]
            for free in (False, True)
        },
    )


def _known(truth: Parameters) -> dict[str, float]:
    return {name: truth[name] for name in MEASURED}


def _sweep_to(last: float) -> Excitation:
    return replace(FREQUENCY_SWEEP, last_frequency=last)


def _identify(record: Record, truth: Parameters, free_offset: bool) -> Identification:
    return identify(record, _known(truth), free_offset=free_offset)


def _errors(excitation: Excitation, truth: Parameters, rate: float) -> Array:
    """Errors (%), (5,), of the equations as printed on a clean record sampled at ``rate`` (1/s)."""
    record = clean_record(excitation, truth, time_step=1 / rate, duration=10.0)
    return _relative(fit_equation_error(record, _known(truth)), truth)


def _relative(fit: Fit, truth: Parameters) -> Array:
    return np.asarray(100 * (fit.values / np.array([truth[name] for name in IDENTIFIED]) - 1))


def _errors_by_noise(
    excitation: Excitation, truth: Parameters, free_offset: bool, level: float
) -> dict[str, float]:
    """Largest error (%) of the five parameters by method, median over seeds; level: noise, rms (m)."""
    clean = clean_record(excitation, truth)
    largest: dict[str, list[float]] = {method: [] for method in METHODS}
    for seed in range(SEEDS):
        record = add_noise(clean, np.random.default_rng(seed), displacement=level)
        for method, fit in _identify(record, truth, free_offset).fits.items():
            largest[method].append(float(np.abs(_relative(fit, truth)).max()))
    return {method: _median(errors) for method, errors in largest.items()}


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _median_rsd(excitation: Excitation, truth: Parameters, free_offset: bool, seeds: int) -> list[float]:
    """RSD (%) of the five, low-passed equation error, median over seeds."""
    clean = clean_record(excitation, truth)
    band = excited_band(clean)
    rows = []
    for seed in range(seeds):
        record = add_noise(clean, np.random.default_rng(seed))
        rows.append(fit_equation_error(record, _known(truth), band=band, free_offset=free_offset).rsd)
    medians: list[float] = np.median(rows, axis=0).tolist()
    return medians
