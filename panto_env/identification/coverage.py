"""How often 95 % confidence intervals hold the true parameters, over many noisy records."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from .experiments import Excitation, add_noise, clean_record
from .methods import identify
from .model import IDENTIFIED, MEASURED, Parameters

CHUNK = 10
"""Trials a task of one process."""


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
    tasks: list[tuple[Excitation, bool]],
    truth: Parameters,
    trials: int,
    executor: Executor,
    *,
    report: Callable[[float], None] = lambda share: None,
) -> list[dict[str, Trials]]:
    """Trials of each excitation, with or without free offset, by method; seeds 0 to ``trials`` - 1.

    The noise is that of ``add_noise``. executor: as ``workers.pool`` gives it. report: told the share done.
    """
    seeds = [range(first, min(first + CHUNK, trials)) for first in range(0, trials, CHUNK)]
    found: dict[tuple[int, int], dict[str, list[Array]]] = {}
    jobs = [(k, c) for k in range(len(tasks)) for c in range(len(seeds))]
    futures = {executor.submit(_chunk, *tasks[k], dict(truth), seeds[c]): (k, c) for k, c in jobs}
    for future in as_completed(futures):
        found[futures[future]] = future.result()
        report(len(found) / len(jobs))
    results = []
    for k in range(len(tasks)):
        methods = found[k, 0]
        rows = {m: np.array([row for c in range(len(seeds)) for row in found[k, c][m]]) for m in methods}
        results.append({m: Trials(*np.moveaxis(stack, 1, 0)) for m, stack in rows.items()})
    return results


def _chunk(
    excitation: Excitation, free_offset: bool, truth: Parameters, seeds: range
) -> dict[str, list[Array]]:
    """Values, standard deviations and whether inside, (3, 5) a trial, by method."""
    clean = clean_record(excitation, truth)
    known = {name: truth[name] for name in MEASURED}
    true = np.array([truth[name] for name in IDENTIFIED])
    rows: dict[str, list[Array]] = {}
    for seed in seeds:
        noisy = add_noise(clean, np.random.default_rng(seed))
        found = identify(noisy, known, free_offset=free_offset)
        for method, fit in found.fits.items():
            low, high = fit.interval.T
            inside = ((low <= true) & (true <= high)).astype(float)
            rows.setdefault(method, []).append(np.array([fit.values, fit.std, inside]))
        for method in found.failures:
            nothing = np.array([np.full(5, np.nan), np.full(5, np.nan), np.zeros(5)])
            rows.setdefault(method, []).append(nothing)
    return rows
