"""Paper 1's identification (sections 2 to 4) on synthetic records of its experiments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.arrays import Array
from ...base.table import Table
from ...catalog import load_pantograph
from ...identification import (
    EXPERIMENTS,
    FREQUENCY_SWEEP,
    METHODS,
    OUTPUT_ERROR,
    Excitation,
    Identification,
    Match,
    Record,
    Trials,
    add_noise,
    clean_record,
    force_matches,
    parameters_of,
    run_trials,
)
from ...identification.model import Parameters
from ..study import Outcome, Report
from . import plots, tables
from .published import LAST_FREQUENCIES, NOISES, PUBLISHED, RECORDS, SAMPLINGS, Computed, compute
from .tables import comparisons

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRIALS = 200
COVERED = (*((excitation, False) for excitation in EXPERIMENTS), (FREQUENCY_SWEEP, True))
"""Records whose coverage is counted, and whether their offset is free: only the sweep allows that."""


def run(report: Report) -> Outcome:
    """Tables 1 to 5 and Figs 6 to 11 on synthetic records, coverage, and why k3 is so unsure."""
    truth = parameters_of(load_pantograph("identified-2dof"))
    report("records", 0.0)
    noisy = {
        excitation.name: add_noise(clean_record(excitation, truth), np.random.default_rng(0))
        for excitation in RECORDS
    }
    computed = compute(noisy, truth, lambda done, total: report("records", 0.3 * done / total))
    trials = run_trials(
        COVERED,
        truth,
        TRIALS,
        progress=lambda done, total: report(f"{TRIALS} trials", 0.3 + 0.6 * done / total),
    )
    driven = {
        excitation.name: force_matches(
            noisy[excitation.name], computed.offset_kept[excitation.name].fits[OUTPUT_ERROR].parameters
        )
        for excitation in EXPERIMENTS
    }
    coverage = {
        _label(*experiment): {method: by_method[method].coverage for method in METHODS}
        for experiment, by_method in zip(COVERED, trials, strict=True)
    }
    report("plots", 0.9)
    return Outcome(
        title="Paper 1, identification, on synthetic records",
        comparisons=tuple(comparisons(truth, computed, driven, coverage)),
        tables=_tables(truth, computed, driven, trials),
        plots=_plots(truth, noisy, computed, driven, coverage),
        numbers={
            "truth": truth,
            "as_printed": _fits(computed.offset_kept),
            "offset_free": _fits(computed.offset_free),
            "median_rsd_offset_free": computed.medians,
            "sampling": {"rates": SAMPLINGS, "errors_percent": computed.sampling},
            "noise": {"levels": NOISES, "largest_errors_percent": computed.noise},
            "sweep_rsd_k3": {
                "last_frequencies": LAST_FREQUENCIES,
                "kept": computed.sweep_rsd[False],
                "free": computed.sweep_rsd[True],
            },
            "coverage": coverage,
        },
    )


def _tables(
    truth: Parameters,
    computed: Computed,
    driven: Mapping[str, list[Match]],
    trials: list[dict[str, Trials]],
) -> tuple[Table, ...]:
    kept = computed.offset_kept
    return (
        tables.motion_table(truth),
        *(tables.parameters_table(kept[printed.name], printed, 2 + k) for k, printed in enumerate(PUBLISHED)),
        tables.performance_table(driven),
        tables.ranking_table(kept, computed.medians),
        tables.frequency_sweep_table(kept, computed.offset_free),
        tables.coverage_table([_label(*experiment) for experiment in COVERED], trials, TRIALS),
        tables.friction_table(truth),
    )


def _plots(
    truth: Parameters,
    noisy: Mapping[str, Record],
    computed: Computed,
    driven: Mapping[str, list[Match]],
    coverage: Mapping[str, Mapping[str, Array]],
) -> dict[str, Figure]:
    """By file name."""
    names = [excitation.name for excitation in EXPERIMENTS]
    clean = {record.name: clean_record(record, truth) for record in (EXPERIMENTS[0], FREQUENCY_SWEEP)}
    return {
        **{f"figure-{6 + k}": plots.record(noisy[name], name) for k, name in enumerate(names)},
        **{f"figure-{9 + k}": plots.match(noisy[name], driven[name], name) for k, name in enumerate(names)},
        "rsd-and-condition": plots.ranking(computed.offset_kept, computed.medians),
        "stiffness-k3": plots.stiffness(clean, LAST_FREQUENCIES, computed.sweep_rsd),
        "convergence": plots.convergence(SAMPLINGS, computed.sampling, NOISES, computed.noise),
        "coverage": plots.coverage(coverage, TRIALS),
    }


def _label(excitation: Excitation, free_offset: bool) -> str:
    return f"{excitation.name}, offset {'free' if free_offset else 'kept'}"


def _fits(identified: Mapping[str, Identification]) -> dict[str, Any]:
    """Every fit as plain data, by record and method."""
    return {
        name: {method: fit.as_dict() for method, fit in identification.fits.items()}
        for name, identification in identified.items()
    }
