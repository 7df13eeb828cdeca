"""One pass and what is kept of it; all passes on all cores."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np

from ...catalog import load_catenary, load_pantograph
from ...errors import InputError
from ...metrics import Figures
from ...simulation import simulate
from ...trajectory import Trajectory
from .cases import ACTUATORS, PANTOGRAPH, RUN_SPANS, SPANS, Case

PER_SPAN = (1, 2, 3, 10)
"""Components of the contact force that are kept, in periods a span; `shinkansen-simple` has 10 droppers."""


@dataclass(frozen=True)
class Result:
    """What is kept of a pass, over ``SPANS``."""

    case: Case
    figures: Figures
    raw_std: float  # of the unfiltered contact force (N)
    longest_loss: float  # longest time without contact (s)
    components: tuple[complex, ...]  # of the contact force, PER_SPAN: amplitude (N) and phase

    @property
    def mean_deviation(self) -> float:
        """CF over the distance: the mean of |F - F_N| (N)."""
        return self.figures.cost_function / self.figures.distance


def make(case: Case) -> Trajectory:
    """The whole record of a case."""
    if case.mean is not None:
        return _pressed(case.speed_kmh, case.line, case.mean)
    return _simulate(case)


def run(case: Case) -> Result:
    """Run a case."""
    return keep(case, make(case))


def keep(case: Case, record: Trajectory) -> Result:
    """What is kept of a record."""
    inside = _inside(record)
    force, position = record.contact_force[inside], record.position[inside]
    turns = position / record.span_length
    return Result(
        case,
        record.summary(SPANS),
        float(force.std()),
        longest(force <= 0) * record.time_step,
        tuple(complex(2 * np.mean(force * np.exp(-2j * np.pi * n * turns))) for n in PER_SPAN),
    )


def longest(lost: Any) -> int:
    """Most samples in a row that are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def run_all(cases: Sequence[Case], progress: Callable[[float], None]) -> dict[Case, Result]:
    """Run cases on all cores; ``progress`` is told the share done. Raises InputError if a worker dies."""
    workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    results: dict[Case, Result] = {}
    # Spawned, not forked: threads of Numba do not survive a fork.
    pool = ProcessPoolExecutor(min(workers, len(cases)), mp_context=get_context("spawn"))
    try:
        for future in as_completed([pool.submit(run, case) for case in cases]):
            result = future.result()
            results[result.case] = result
            progress(len(results) / len(cases))
    except BrokenProcessPool as error:
        raise InputError(
            "A worker process died; in a script, call the study under `if __name__ == '__main__':`."
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)
    return {case: results[case] for case in cases}


def _simulate(case: Case, pantograph: Any = PANTOGRAPH) -> Trajectory:
    line = load_catenary(case.line)
    return simulate(
        line,
        pantograph,
        case.speed_kmh,
        None if case.policy == "passive" else case.policy,
        actuator=ACTUATORS[case.actuator],
        control_interval=case.control_interval,
        distance=RUN_SPANS * line.span_length,
        record_droppers=False,
    )


def _pressed(speed_kmh: int, line: str, mean: float) -> Trajectory:
    """The passive pantograph under as much more static force as gives this mean force (N)."""
    as_it_is = load_pantograph(PANTOGRAPH)
    nominal = as_it_is.nominal_force(speed_kmh / 3.6)
    case = Case(speed_kmh, line=line)
    record = _simulate(case)
    passive_mean = record.contact_force[_inside(record)].mean()
    more = mean - passive_mean
    for _ in range(3):  # the mean is all but linear in the static force
        pantograph = as_it_is.model_copy(update={"static_force": as_it_is.static_force + more})
        record = _simulate(case, pantograph)
        more *= (mean - passive_mean) / (record.contact_force[_inside(record)].mean() - passive_mean)
    return dataclasses.replace(record, nominal_force=nominal)  # CF still counts from the paper's 54 N


def _inside(record: Trajectory) -> Any:
    first, last = SPANS
    lowest, highest = (first - 1) * record.span_length, last * record.span_length
    return (record.position >= lowest) & (record.position < highest)
