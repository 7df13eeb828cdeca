"""Paper 1's identification (sections 2 to 4) on synthetic records of its experiments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from ... import identification as ident
from ...analysis.pool import Job, in_processes
from ...base.arrays import Array
from ...base.table import Table
from ...identification import EXPERIMENTS, FILTERED, FREQUENCY_SWEEP, IDENTIFIED, METHODS, OUTPUT_ERROR, UNITS
from ...identification.performance import plot_matches, plot_record
from ..study import Comparison, Outcome, Report, over, said, tabled
from . import plots, published
from .published import PUBLISHED, TRUTH, best_performance, expected

Fits = Mapping[str, ident.Identification]
Rows = list[tuple[str | float, ...]]
SECONDS = 4.0  # shown of a record. Own choice: the paper's figures are not at hand, only their captions

SAMPLINGS = (200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)
"""Samples per second; at the last, three-point derivatives are good to 0.5 % of every parameter."""
NOISES = (1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)  # noise of the displacement sensors, rms (m)
SEEDS = 5  # noisy records behind each point of a figure
SEEDS_OF_MEDIAN = 100  # noisy records behind each median of the relative standard deviation
LAST_FREQUENCIES = (0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 2.0, 4.0)
"""Of frequency sweeps from 0.3 Hz (Hz); the first is no sweep but a sine."""
TRIALS = 200
COVERED = (*((excitation, False) for excitation in EXPERIMENTS), (FREQUENCY_SWEEP, True))
"""Records whose coverage is counted, and whether their offset is free: only the sweep allows that."""
BAR = 0.005  # share by which identified parameters may differ from the truth on records without noise
KNOWN = {name: TRUTH[name] for name in ident.MEASURED}
K3 = IDENTIFIED.index("k3")


def _jobs(noisy: Mapping[str, ident.Record]) -> dict[tuple[Any, ...], Job[Any]]:
    """What is computed of each record, of sweeps and over sampling and noise, by keys."""
    jobs: dict[tuple[Any, ...], Job[Any]] = {}
    for excitation in (*EXPERIMENTS, FREQUENCY_SWEEP):
        name = excitation.name
        for free in (False, True):
            jobs["record", name, free] = partial(ident.identify, noisy[name], KNOWN, free_offset=free)
        for rate in SAMPLINGS:
            jobs["sampling", name, rate] = partial(_errors_by_sampling, excitation, rate)
    for (excitation, free), level in product((COVERED[0], COVERED[-1]), NOISES):
        jobs["noise", excitation.name, level] = partial(_errors_by_noise, excitation, free, level)
    for excitation in EXPERIMENTS:
        jobs["median", excitation.name] = partial(_median_rsd, excitation, True, SEEDS_OF_MEDIAN)
    for last, free in product(LAST_FREQUENCIES, (False, True)):
        sweep = replace(FREQUENCY_SWEEP, last_frequency=last)
        jobs["sweep", last, free] = partial(_median_rsd, sweep, free, SEEDS)
    return jobs


def _errors(fit: ident.Fit) -> Array:
    """Errors (%), (5,)."""
    return np.asarray(100 * (fit.values / np.array([TRUTH[name] for name in IDENTIFIED]) - 1))


def _errors_by_sampling(excitation: ident.Excitation, rate: float) -> Array:
    """Errors (%), (5,), of the equations as printed on a clean record sampled at ``rate`` (1/s)."""
    record = ident.clean_record(excitation, TRUTH, time_step=1 / rate, duration=10.0)
    return _errors(ident.fit_equation_error(record, KNOWN))


def _errors_by_noise(excitation: ident.Excitation, free_offset: bool, level: float) -> dict[str, float]:
    """Largest error (%) of the five parameters by method, median over seeds; level: noise, rms (m)."""
    clean = ident.clean_record(excitation, TRUTH)
    largest: dict[str, list[float]] = {method: [] for method in METHODS}
    for seed in range(SEEDS):
        record = ident.add_noise(clean, np.random.default_rng(seed), displacement=level)
        for method, fit in ident.identify(record, KNOWN, free_offset=free_offset).fits.items():
            largest[method].append(float(np.abs(_errors(fit)).max()))
    return {method: float(np.median(errors or [np.nan])) for method, errors in largest.items()}


def _median_rsd(excitation: ident.Excitation, free_offset: bool, seeds: int) -> list[float]:
    """RSD (%) of the five, low-passed equation error, median over seeds."""
    clean = ident.clean_record(excitation, TRUTH)
    band = ident.excited_band(clean)
    records = (ident.add_noise(clean, np.random.default_rng(seed)) for seed in range(seeds))
    fits = [ident.fit_equation_error(each, KNOWN, band=band, free_offset=free_offset) for each in records]
    medians: list[float] = np.median([fit.rsd for fit in fits], axis=0).tolist()
    return medians


def run(report: Report) -> Outcome:
    """Tables 1 to 5 and Figs 6 to 11 on synthetic records, coverage, and why k3 is so unsure."""
    report("records", 0.0)
    clean = {each.name: ident.clean_record(each, TRUTH) for each in (*EXPERIMENTS, FREQUENCY_SWEEP)}
    noisy = {name: ident.add_noise(record, np.random.default_rng(0)) for name, record in clean.items()}
    jobs = _jobs(noisy)
    values = in_processes(list(jobs.values()), progress=over(report, "records", 0.0, 0.3))
    results = dict(zip(jobs, values, strict=True))
    trials = ident.run_trials(COVERED, TRUTH, TRIALS, progress=over(report, f"{TRIALS} trials", 0.3, 0.9))
    kept, free = ({name: results["record", name, free] for name in clean} for free in (False, True))
    names = [excitation.name for excitation in EXPERIMENTS]
    driven = {
        name: ident.force_matches(noisy[name], kept[name].fits[OUTPUT_ERROR].parameters) for name in names
    }
    coverage = {
        f"{each.name}, offset {'free' if free_ else 'kept'}": {
            method: by_method[method].coverage for method in METHODS
        }
        for (each, free_), by_method in zip(COVERED, trials, strict=True)
    }
    medians = {name: results["median", name] for name in names}
    sampling = {name: np.array([results["sampling", name, rate] for rate in SAMPLINGS]) for name in clean}
    noise = {
        excitation.name: {
            method: [results["noise", excitation.name, level][method] for level in NOISES]
            for method in METHODS
        }
        for excitation, _ in (COVERED[0], COVERED[-1])
    }
    sweeps = {free: [results["sweep", last, free][K3] for last in LAST_FREQUENCIES] for free in (False, True)}
    of_sweeps = {"last_frequencies": LAST_FREQUENCIES, "kept": sweeps[False], "free": sweeps[True]}
    report("plots", 0.9)
    title = "Experiment {}: synthetic record and model identified from it by output error"
    figures = {
        f"figure-{6 + k}": plot_record(
            noisy[name], f"Experiment {name}: contact force and displacements (synthetic)", SECONDS
        )
        for k, name in enumerate(names)
    }
    for k, name in enumerate(names):
        matches = noisy[name].time, driven[name], title.format(name)
        figures[f"figure-{9 + k}"] = plot_matches(*matches, 0.0, SECONDS)
    shown = {name: clean[name] for name in (names[0], FREQUENCY_SWEEP.name)}
    return Outcome(
        title="Paper 1, identification, on synthetic records",
        comparisons=tuple(_comparisons(kept, sampling["I"], medians, driven, coverage)),
        tables=tuple(_tables(kept, free, medians, driven, coverage)),
        plots=figures
        | {
            "rsd-and-condition": plots.ranking(kept, medians),
            "stiffness-k3": plots.stiffness(shown, LAST_FREQUENCIES, sweeps),
            "convergence": plots.convergence(SAMPLINGS, sampling, NOISES, noise),
            "coverage": plots.coverage(coverage, TRIALS),
        },
        numbers={
            "truth": TRUTH,
            "as_printed": _fits(kept),
            "offset_free": _fits(free),
            "median_rsd_offset_free": medians,
            "sampling": {"rates": SAMPLINGS, "errors_percent": sampling},
            "noise": {"levels": NOISES, "largest_errors_percent": noise},
            "sweep_rsd_k3": of_sweeps,
            "coverage": coverage,
        },
    )


def _fits(identified: Fits) -> dict[str, Any]:
    """Every fit as plain data, by record and method."""
    return {
        name: {method: fit.as_dict() for method, fit in identification.fits.items()}
        for name, identification in identified.items()
    }


def _tables(
    kept: Fits,
    free: Fits,
    medians: Mapping[str, Sequence[float]],
    driven: Mapping[str, Sequence[ident.Match]],
    coverage: Mapping[str, Mapping[str, Array]],
) -> Iterator[Table]:
    """Ours beside the paper's."""
    yield Table(
        "Table 1: the model (Table 2's parameters) under the printed y_p1",
        ("experiment", "data", "amplitude", "paper", "offset", "paper"),
        [
            (printed.name, f"{name} ({unit})", *values)
            for printed in PUBLISHED
            for name, unit, *values in expected(printed)
        ],
    )
    for k, printed in enumerate(PUBLISHED):
        fits = [kept[printed.name].fits[method] for method in METHODS]
        rows: Rows = []
        for place, name in enumerate(IDENTIFIED):
            ours = (float(each[place]) for fit in fits for each in (fit.values, fit.rsd))
            rows.append((f"{name} ({UNITS[name]})", printed.values[place], printed.rsd[place], *ours))
        conditions = (cell for fit in fits for cell in (fit.condition, ""))
        rows.append(("condition number", printed.condition, "", *conditions))
        headings = (heading for method in METHODS for heading in (method, "RSD (%)"))
        title = f"Table {2 + k}: Experiment {printed.name} (truth: Table 2's parameters; noise: own choice)"
        yield Table(title, ("parameter", "paper", "RSD (%)", *headings), rows)
    yield tabled(
        "Table 5: fitting performance and mean error",
        (
            ("experiment", lambda each: each[0].name),
            ("data", lambda each: each[2].channel),
            ("P_f (%)", lambda each: each[2].performance),
            ("paper", lambda each: each[0].performance[each[1]]),
            ("mean error (mm)", lambda each: 1e3 * each[2].mean_error),
            ("paper", lambda each: each[0].mean_error[each[1]]),
            ("most that its P_f allows", lambda each: published.largest_mean_error(*each[:2])),
        ),
        [(printed, k, match) for printed in PUBLISHED for k, match in enumerate(driven[printed.name])],
    )
    rows = []
    for printed in PUBLISHED:
        both = zip(medians[printed.name], printed.rsd, strict=True)
        deviations = (f"{ours:.3g} / {theirs:.3g}" for ours, theirs in both)
        ours_kept = kept[printed.name].fits[FILTERED].condition
        rows.append((printed.name, ours_kept, printed.condition, *deviations))
    deviations = (f"RSD {name} (%), ours / paper" for name in IDENTIFIED)
    title = "Ranking: condition number with offset kept, median RSD with offset free (low-passed)"
    yield Table(title, ("experiment", "condition number", "paper", *deviations), rows)
    rows = []
    for name, (label, identified), method in product(
        (EXPERIMENTS[0].name, FREQUENCY_SWEEP.name),
        (("kept", kept), ("free", free)),
        (FILTERED, OUTPUT_ERROR),
    ):
        fit = identified[name].fits.get(method)
        found = ["no solution"] * 5 if fit is None else [f"{value:.3g}" for value in fit.rsd]
        condition = "" if fit is None else f"{fit.dependence:.3g}"
        rows.append((f"{name}, offset {label}", method, *found, condition))
    yield Table(
        "Why k3 is unsure, and its cure: a sweep",
        ("record", "method", *(f"RSD {name} (%)" for name in IDENTIFIED), "condition, lengths 1"),
        rows,
    )
    yield Table(
        f"Truth inside its own 95 % interval, of {TRIALS} records",
        ("record", "method", *(f"{name} (%)" for name in IDENTIFIED)),
        [
            (label, method, *(f"{share:.1f}" for share in shares))
            for label, by_method in coverage.items()
            for method, shares in by_method.items()
        ],
    )
    yield tabled(
        "Table 1's forces under Table 2's parameters",
        (
            ("experiment", "{.name}"),
            ("force amplitude (N)", lambda printed: expected(printed)[0][2]),
            ("paper", lambda printed: printed.force[0]),
            ("dry friction that would explain it (N)", published.dry_friction),
            ("best P_f of y_p1 under the paper's force (%)", best_performance),
            ("paper", lambda printed: printed.performance[0]),
        ),
        PUBLISHED,
    )


def _comparisons(
    kept: Fits,
    clean: Array,
    medians: Mapping[str, Sequence[float]],
    driven: Mapping[str, Sequence[ident.Match]],
    coverage: Mapping[str, Mapping[str, Array]],
) -> Iterator[Comparison]:
    """All of them. clean: errors of Experiment I without noise over SAMPLINGS."""

    def about(what: str, ours: float, paper: float, within: float, **names: Any) -> Comparison:
        key, range_ = f"identification-{what}", {"low": paper - within, "high": paper + within}
        return said(key, ours, paper=paper, **range_, **names)

    for printed in PUBLISHED:  # Table 1: the model under the printed motion of the plate
        for series, unit, amplitude, their_amplitude, offset, their_offset in expected(printed):
            # Displacements: the last printed digit of both; force: the springs' measured values.
            near, far = (0.1 * their_amplitude, 0.03 * their_offset) if unit == "N" else (0.02, 0.1)
            names = {"name": printed.name, "series": series, "unit": unit}
            note = _amplitude_note(printed.name, series)
            yield about("amplitude", amplitude, their_amplitude, near, note=note, **names)
            yield about("offset", offset, their_offset, far, **names)
    for name, error in zip(IDENTIFIED, clean[-1], strict=True):  # Table 2's parameters, sampled fast enough
        true = TRUTH[name]
        yield about("clean", true * (1 + error / 100), true, BAR * abs(true), name=name, unit=UNITS[name])
    conditions = {printed.name: kept[printed.name].fits[FILTERED].condition for printed in PUBLISHED}
    theirs = {printed.name: printed.condition for printed in PUBLISHED}
    for name, paper in theirs.items():
        yield about("condition", conditions[name], paper, 0.5 * paper, name=name)
    for name in ("II", "III"):
        ratio = conditions[name] / conditions["I"]
        yield said("identification-conditions", ratio, name=name, paper=theirs[name] / theirs["I"])
    for printed in PUBLISHED:
        own = {"name": printed.name, "paper": printed.rsd[K3]}
        yield said("identification-rsd", medians[printed.name][K3], **own)
    matches = [match for each in driven.values() for match in each]
    yield said("identification-performance", min(match.performance for match in matches))
    yield said("identification-error", 1e3 * max(match.mean_error for match in matches))
    for printed in PUBLISHED:  # whether the printed tables fit together
        yield about("best", best_performance(printed), printed.performance[0], 10.0, name=printed.name)
    for printed in PUBLISHED:
        # mm: what the rounding of mean error, amplitude and P_f can hide
        paper, ours = printed.mean_error[0], published.largest_mean_error(printed, 0)
        yield said("identification-allowed", ours, name=printed.name, paper=paper, low=paper - 0.01)
    notes = {
        ident.PRINTED: "noise in the derivatives biases least squares; RSD knows nothing of it",
        FILTERED: "bias mostly gone, intervals too narrow: the residuals of both equations are unlike",
    }
    for method in METHODS:
        lowest = min(float(np.min(shares[method])) for shares in coverage.values())
        yield said("identification-coverage", lowest, method=method, note=notes.get(method, ""))


def _amplitude_note(experiment: str, name: str) -> str:
    if name == "f_1":
        return "Table 2's model takes a smaller force: see dry friction"
    if experiment == "I":
        return "at 1.42 Hz Table 2's masses lead: y_p3 moves farther than y_p1, the paper's less far"
    if name == "y_p3":
        return (
            "II and III have nearly one frequency, but y_p3 / y_p1 of 0.952 and 0.990: not one linear model"
        )
    return ""
