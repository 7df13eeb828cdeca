"""What the study computes: identifications of noisy records, and errors over sampling, noise and sweep."""

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
from ...identification.model import Parameters

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
