"""Passes of many policies at once: lanes of one task, each with a policy and a seed of its own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.context import Context
from panto_env.control.lines import draws_line, on_drawn_line
from panto_env.control.settings import RunSettings, far_enough
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.spans import chosen_spans
from panto_env.plant.state import Row

from ..policies.lanes_law import LanesLaw, Observations

Array = NDArray[np.float64]
MOST_LANES = 256
"""Maximum number of lanes of one task: their records are kept in memory, some 6 MB per lane."""
KEPT_RATE = 100.0
"""Rate (1/s) of the samples kept of the contact force, which is low-passed at 20 Hz."""


class Still(LanesLaw):
    """The passive pantograph in a batch."""

    def forces(self, observations: Observations) -> Array:
        """Zero force (N), (lanes,)."""
        return np.zeros(len(observations))


class Forces(NamedTuple):
    """Contact forces of passes over the evaluated spans, low-passed according to EN 50317."""

    values: Array  # (laws, seeds, samples): N; nan where a pass ended early
    mean: Array  # (laws, seeds): N
    std: Array  # (laws, seeds): N


def run_batch(settings: RunSettings, laws: Sequence[LanesLaw], seeds: Sequence[int]) -> Forces:
    """Run each law under each seed, at the settings' single speed.

    Where the line is drawn from a family or a section, each seed draws its own. Passes of a law that cannot
    begin count as ended early. Raises InputError if no law can begin.
    """
    if draws_line(settings):
        lines = [on_drawn_line(settings, partial(np.random.default_rng, seed)) for seed in seeds]
        values = _one_length([_in_parts(own, laws, [seed]) for own, seed in zip(lines, seeds, strict=True)])
    else:
        values = _in_parts(settings, laws, seeds)
    return Forces(values, values.mean(axis=2), values.std(axis=2))


def _in_parts(settings: RunSettings, laws: Sequence[LanesLaw], seeds: Sequence[int]) -> Array:
    """Forces on one line, (laws, seeds, samples)."""
    at_once = max(1, MOST_LANES // len(seeds))
    parts = [_run(settings, laws[first : first + at_once], seeds) for first in range(0, len(laws), at_once)]
    return np.concatenate(parts)


def _one_length(forces: Sequence[Array]) -> Array:
    """Forces of lines of different lengths, each (laws, 1, samples), thinned to the fewest samples."""
    count = min(each.shape[2] for each in forces)
    kept = [each[..., np.rint(np.linspace(0, each.shape[2] - 1, count)).astype(int)] for each in forces]
    return np.concatenate(kept, axis=1)


def _run(settings: RunSettings, laws: Sequence[LanesLaw], seeds: Sequence[int]) -> Array:
    settings = far_enough(settings)
    task = Task(settings, lanes=len(laws) * len(seeds))
    task.reset(np.arange(task.lanes), lambda lane: np.random.default_rng(seeds[lane % len(seeds)]))
    context, results = task.context(0), task.results
    unable = _begin(laws, context, len(seeds))
    owned = [slice(k * len(seeds), (k + 1) * len(seeds)) for k in range(len(laws))]
    actions = np.zeros((task.lanes, context.actions))
    ended = np.zeros(task.lanes, dtype=np.bool_)
    early = ended.copy()
    while not ended.all():
        observations = results.observation
        for k, (law, its) in enumerate(zip(laws, owned, strict=True)):
            if k not in unable:
                actions[its, 0] = law.forces(observations[its])
        actions[:, 0] /= context.force_limit
        task.step(np.nan_to_num(np.clip(actions, -1, 1)), ended if ended.any() else None)
        early |= results.terminated
        ended |= results.terminated | results.truncated
    values = _low_passed(task)
    values[early] = np.nan
    values = values.reshape(len(laws), len(seeds), -1)
    values[list(unable)] = np.nan
    return values


def _begin(laws: Sequence[LanesLaw], context: Context, lanes: int) -> set[int]:
    """Begin all laws and return the indices of those that cannot. Raises InputError if none can."""
    unable: dict[int, InputError] = {}
    for k, law in enumerate(laws):
        try:
            law.begin(context, lanes)
        except InputError as error:
            unable[k] = error
    if len(unable) == len(laws):
        raise unable[0]
    return set(unable)


def _low_passed(task: Task) -> Array:
    """Low-passed contact force of the controlled pantograph over the evaluated spans, (lanes, samples), N.

    Each lane's samples are those in which its own train is inside the spans. If speeds drift, trains stay
    there for different times; each lane then gets as many samples as the fastest one, equally spaced in time.
    """
    time_step, alignment = task.plant.time_step, task.plant.alignment
    collector = task.episode.controlled[0]
    force = task.samples.rows[:, 1:, collector, Row.CONTACT_FORCE]
    middle = np.arange(force.shape[1]) + 0.5
    spans = chosen_spans(None, task.length.own_distance, alignment, task.plant.catenary.ends)
    assert spans is not None  # None stands for the choice "all" only
    places = [task.plant.position(lane, middle, collector) for lane in range(task.lanes)]
    inside = [alignment.within(own, spans) for own in places]
    count = min(int(own.sum()) for own in inside)
    chosen = [own[where] for own, where in zip(low_pass(force, time_step), inside, strict=True)]
    kept = np.array([own[np.rint(np.linspace(0, len(own) - 1, count)).astype(int)] for own in chosen])
    return np.asarray(kept[:, :: max(1, round(1 / (KEPT_RATE * time_step)))])
