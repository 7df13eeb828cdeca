"""How often 95 % confidence intervals hold the true parameters, over many noisy records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..analysis.pool import Progress, in_processes
from ..base.arrays import Array
from .experiments import Excitation, add_noise, clean_record
from .methods import identify
from .model import IDENTIFIED, MEASURED, Parameters

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
    seeds = [range(first, min(first + TRIALS_PER_JOB, trials)) for first in range(0, trials, TRIALS_PER_JOB)]
    jobs = [
        partial(_run_seeds, excitation, free_offset, dict(truth), some)
        for excitation, free_offset in experiments
        for some in seeds
    ]
    parts = in_processes(jobs, progress=progress)
    results = []
    for first in range(0, len(parts), len(seeds)):
        of_experiment = parts[first : first + len(seeds)]
        rows = {
            method: np.array([row for part in of_experiment for row in part[method]])
            for method in of_experiment[0]
        }
        results.append({method: Trials(*np.moveaxis(stack, 1, 0)) for method, stack in rows.items()})
    return results


def _run_seeds(
    excitation: Excitation, free_offset: bool, truth: Parameters, seeds: range
) -> dict[str, list[Array]]:
    """By method, per trial: values, standard deviations and whether inside, (3, 5)."""
    clean = clean_record(excitation, truth)
    known = {name: truth[name] for name in MEASURED}
    true = np.array([truth[name] for name in IDENTIFIED])
    rows: dict[str, list[Array]] = {}
    for seed in seeds:
        noisy = add_noise(clean, np.random.default_rng(seed))
        identified = identify(noisy, known, free_offset=free_offset)
        for method, fit in identified.fits.items():
            low, high = fit.interval.T
            inside = ((low <= true) & (true <= high)).astype(float)
            rows.setdefault(method, []).append(np.array([fit.values, fit.std, inside]))
        for method in identified.failures:
            nothing = np.array([np.full(5, np.nan), np.full(5, np.nan), np.zeros(5)])
            rows.setdefault(method, []).append(nothing)
    return rows
