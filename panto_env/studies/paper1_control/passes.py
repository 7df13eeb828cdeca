"""Passes along the line and what is kept of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.pool import Progress, in_processes
from ...base.errors import InputError
from ...catalog import load_catenary, load_pantograph
from ...control import Task
from ...control.settings import RunSettings, run_settings
from ...metrics.figures import Figures
from ...metrics.low_pass import band_rms
from ...metrics.trajectory import Trajectory
from ...plant.pantograph.schema import PantographData
from ...policies import find_policy
from .cases import ACTUATORS, FINE, PANTOGRAPH, RUN_SPANS, SPANS, USUAL, Case

BANDS = ((0.0, 7.0), (7.0, 15.0), (15.0, 30.0))
"""Bands of frequency (Hz) into which the contact force is split; the mean belongs to none."""
LANES = 12
"""Passes made together in one process; from 16 on a task would take threads beside the processes."""


@dataclass(frozen=True)
class Result:
    """What is kept of a pass, over ``SPANS``."""

    case: Case
    figures: Figures
    raw_std: float  # of the unfiltered contact force (N)
    longest_loss: float  # longest time without contact (s)
    once_per_span: complex  # that part of the contact force: amplitude (N) and phase
    bands: tuple[float, ...]  # rms of the unfiltered contact force in BANDS (N)

    @property
    def mean_deviation(self) -> float:
        """CF over the distance: the mean of |F - F_N| (N)."""
        return self.figures.cost_function / self.figures.distance


def run_all(cases: Sequence[Case], progress: Progress) -> dict[Case, Result]:
    """Results of all cases, from all cores. Raises InputError if a worker process dies."""
    batches = [partial(run, batch) for batch in _batches(cases)]
    results = {result.case: result for batch in in_processes(batches, progress=progress) for result in batch}
    return {case: results[case] for case in cases}


def run(cases: Sequence[Case]) -> list[Result]:
    """Run cases that differ in their policy alone."""
    return [result_of(case, record) for case, record in zip(cases, records(cases), strict=True)]


def records(cases: Sequence[Case], pantograph: str | PantographData = PANTOGRAPH) -> list[Trajectory]:
    """Whole records of cases that differ in their policy alone: lanes of one task."""
    first = cases[0]
    line = load_catenary(first.line)
    settings: RunSettings = run_settings(
        {
            "catenary": line,
            "pantograph": pantograph,
            "speed_kmh": first.speed_kmh,
            "actuator": ACTUATORS[first.actuator],
            "control_interval": first.control_interval,
            "distance": line.alignment().support(RUN_SPANS),
        }
        | (FINE if first.fine else USUAL)
    )
    task = Task(settings, lanes=len(cases))
    policies = [find_policy(case.policy) for case in cases]
    for lane, policy in enumerate(policies):
        task.reset(lane, np.random.default_rng(0))
        policy.reset(task.context(lane))
    results = task.results
    action = np.zeros((len(cases), len(task.actuator.places)))
    while not results.truncated[0]:
        for lane, policy in enumerate(policies):
            action[lane] = policy.act(results.observation[lane])
        task.step(action)
        if results.terminated.any():
            ended = cases[int(np.argmax(results.terminated))]
            raise InputError(f"The pass {ended} left the valid range of the simulation; leave it out.")
    return [task.trajectory(lane, policy=case.policy) for lane, case in enumerate(cases)]


def passive_at_mean(speed_kmh: int, mean: float) -> Result:
    """The passive pantograph under as much more static force as gives this mean force (N).

    CF still counts from the nominal force that the pantograph has as it is.
    """
    case, pantograph = Case(speed_kmh), load_pantograph(PANTOGRAPH)
    (passive,) = records([case])
    passive_mean = _mean(passive)
    more = mean - passive_mean
    for _ in range(3):  # the mean is all but linear in the static force
        raised = pantograph.model_copy(update={"static_force": pantograph.static_force + more})
        (record,) = records([case], raised)
        more *= (mean - passive_mean) / (_mean(record) - passive_mean)
    return result_of(case, dataclasses.replace(record, nominal_force=passive.nominal_force))


def result_of(case: Case, record: Trajectory) -> Result:
    """What is kept of a record."""
    inside = record.inside(SPANS)
    force, turns = record.contact_force[inside], record.alignment.in_spans(record.position[inside])
    return Result(
        case,
        record.summary(SPANS),
        float(force.std()),
        longest(force <= 0) * record.time_step,
        complex(2 * np.mean(force * np.exp(-2j * np.pi * turns))),
        tuple(band_rms(force, record.time_step, *band) for band in BANDS),
    )


def longest(lost: NDArray[np.bool_]) -> int:
    """Most samples in a row that are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _batches(cases: Sequence[Case]) -> Iterator[tuple[Case, ...]]:
    """Cases that differ in their policy alone, LANES at a time, slow trains first: theirs take longest."""

    def plant(case: Case) -> tuple[Any, ...]:
        return case.speed_kmh, case.line, case.actuator, case.control_interval, case.fine

    for _, group in groupby(sorted(cases, key=plant), key=plant):
        same_plant = list(group)
        for first in range(0, len(same_plant), LANES):
            yield tuple(same_plant[first : first + LANES])


def _mean(record: Trajectory) -> float:
    return float(record.contact_force[record.inside(SPANS)].mean())
