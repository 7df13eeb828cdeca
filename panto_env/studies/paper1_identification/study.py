"""Paper 1's identification (sections 2 to 4) on synthetic records of its experiments."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...base.arrays import Array
from ...catalog import load_pantograph
from ...identification import (
    EXPERIMENTS,
    IDENTIFIED,
    MEASURED,
    METHODS,
    OUTPUT_ERROR,
    SWEEP,
    Excitation,
    Fit,
    Identification,
    Record,
    add_noise,
    clean_record,
    excited_band,
    fit_equation_error,
    force_matches,
    identify,
    parameters_of,
    pool,
    run_trials,
)
from ...identification.model import Parameters
from ..study import Outcome, Report
from . import plots as draw
from . import tables as tables
from .published import PUBLISHED

TRIALS = 200
TASKS = (*((each, False) for each in EXPERIMENTS), (SWEEP, True))
"""Records whose coverage is counted: the experiments as printed, the sweep without its offset too."""

SAMPLINGS = (200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)
"""Samples a second; at the last, three-point derivatives are good to 0.5 % of every parameter."""

NOISES = (1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)
SEEDS = 5  # a point of a figure or a median
LAST_FREQUENCIES = (0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 2.0, 4.0)
"""Of sweeps from 0.3 Hz; the first is no sweep but a sine."""


def run(report: Report) -> Outcome:
    """Tables 1 to 5 and Figs 6 to 11 on synthetic records, coverage, and why k3 is so unsure."""
    truth = parameters_of(load_pantograph("identified-2dof"))
    records = (*EXPERIMENTS, SWEEP)
    report("experiments", 0.0)
    noisy = {each.name: add_noise(clean_record(each, truth), np.random.default_rng(0)) for each in records}
    with pool() as executor:
        pending = {
            each.name: [executor.submit(_identify, noisy[each.name], truth, free) for free in (False, True)]
            for each in records
        }
        by_rate = {
            each.name: [executor.submit(_errors, each, truth, rate) for rate in SAMPLINGS] for each in records
        }
        by_noise = {
            each.name: [executor.submit(_errors_by_noise, each, truth, free, level) for level in NOISES]
            for each, free in ((EXPERIMENTS[0], False), (SWEEP, True))
        }
        many = {each.name: executor.submit(_rsd, each, truth, True, 20 * SEEDS) for each in EXPERIMENTS}
        by_sweep = {
            free: [executor.submit(_rsd, _sweep(last), truth, free, SEEDS) for last in LAST_FREQUENCIES]
            for free in (False, True)
        }
        trials = run_trials(
            list(TASKS), truth, TRIALS, executor, report=lambda share: report(f"{TRIALS} trials", share)
        )
        kept = {name: both[0].result() for name, both in pending.items()}
        free = {name: both[1].result() for name, both in pending.items()}
        sampling = {name: np.array([each.result() for each in row]) for name, row in by_rate.items()}
        errors = {name: [each.result() for each in row] for name, row in by_noise.items()}
        noise = {name: {m: [each[m] for each in row] for m in METHODS} for name, row in errors.items()}
        medians = {name: each.result() for name, each in many.items()}
        sweeps = {free: [each.result()[-1] for each in row] for free, row in by_sweep.items()}
    fine = {name: rows[-1] for name, rows in sampling.items()}
    driven = {
        each.name: force_matches(noisy[each.name], kept[each.name].fits[OUTPUT_ERROR].parameters)
        for each in EXPERIMENTS
    }
    coverage = {_label(*task): {m: trials[k][m].coverage for m in METHODS} for k, task in enumerate(TASKS)}
    found = [
        tables.table1(truth),
        *(tables.table_of(kept[printed.name], printed, 2 + k) for k, printed in enumerate(PUBLISHED)),
        tables.table5(driven),
        tables.ranking(kept, medians),
        tables.cure(kept, free),
        tables.coverage_table([_label(*task) for task in TASKS], trials, TRIALS),
        tables.friction_table(truth),
    ]
    figures = {
        **{f"figure-{6 + k}": draw.record(noisy[each.name], each.name) for k, each in enumerate(EXPERIMENTS)},
        **{
            f"figure-{9 + k}": draw.match(noisy[each.name], driven[each.name], each.name)
            for k, each in enumerate(EXPERIMENTS)
        },
        "rsd-and-condition": draw.ranking(kept, medians),
        "stiffness-k3": draw.stiffness(
            {each.name: clean_record(each, truth) for each in (EXPERIMENTS[0], SWEEP)},
            LAST_FREQUENCIES,
            sweeps,
        ),
        "convergence": draw.convergence(SAMPLINGS, sampling, NOISES, noise),
        "coverage": draw.coverage(coverage, TRIALS),
    }
    return Outcome(
        title="Paper 1, identification, on synthetic records",
        comparisons=tuple(tables.comparisons(truth, fine, kept, medians, driven, coverage)),
        tables=tuple(found),
        figures=figures,
        numbers={
            "truth": truth,
            "as_printed": {name: _plain(found.fits) for name, found in kept.items()},
            "offset_free": {name: _plain(found.fits) for name, found in free.items()},
            "median_rsd_offset_free": medians,
            "sampling": {"rates": SAMPLINGS, "errors_percent": sampling},
            "noise": {"levels": NOISES, "largest_errors_percent": noise},
            "sweep_rsd_k3": {
                "last_frequencies": LAST_FREQUENCIES,
                "kept": sweeps[False],
                "free": sweeps[True],
            },
            "coverage": coverage,
        },
    )


def _label(excitation: Excitation, free_offset: bool) -> str:
    return f"{excitation.name}, offset {'free' if free_offset else 'kept'}"


def _plain(fits: dict[str, Any]) -> dict[str, Any]:
    return {method: fit.as_dict() for method, fit in fits.items()}


def _known(truth: Parameters) -> dict[str, float]:
    return {name: truth[name] for name in MEASURED}


def _sweep(last: float) -> Excitation:
    return replace(SWEEP, last_frequency=last)


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
    return {method: float(np.median(found)) if found else float("nan") for method, found in largest.items()}


def _rsd(excitation: Excitation, truth: Parameters, free_offset: bool, seeds: int) -> list[float]:
    """RSD (%) of the five, low-passed equation error, median over seeds."""
    clean = clean_record(excitation, truth)
    band = excited_band(clean)
    rows = []
    for seed in range(seeds):
        record = add_noise(clean, np.random.default_rng(seed))
        rows.append(fit_equation_error(record, _known(truth), band=band, free_offset=free_offset).rsd)
    medians: list[float] = np.median(rows, axis=0).tolist()
    return medians
