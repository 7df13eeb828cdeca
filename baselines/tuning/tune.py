"""Passes of many policies at once: lanes of one task, each with a policy and a seed of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.lines import draws_line, on_drawn_line
from panto_env.control.settings import RunSettings, far_enough
from panto_env.metrics.figures import chosen_spans
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.state import Row
from panto_env.policies import maker_of, parameters_of, policy_names

from ..benchmark.settings import SELECTION, TRAINING
from ..policies.lanes_law import Array, LanesLaw, Observations, TunableLaw

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
        each = [_in_parts(own, laws, [seed]) for own, seed in zip(lines, seeds, strict=True)]
        values = np.concatenate(_one_length(each), axis=1)
    else:
        values = _in_parts(settings, laws, seeds)
    return Forces(values, values.mean(axis=2), values.std(axis=2))


def _in_parts(settings: RunSettings, laws: Sequence[LanesLaw], seeds: Sequence[int]) -> Array:
    """Forces on one line, (laws, seeds, samples)."""
    at_once = max(1, MOST_LANES // len(seeds))
    parts = [_run(settings, laws[first : first + at_once], seeds) for first in range(0, len(laws), at_once)]
    return np.concatenate(parts)


def _one_length(forces: Sequence[Array]) -> list[Array]:
    """Forces, each (..., samples), thinned to the samples of the shortest, equally spaced."""
    count = min(each.shape[-1] for each in forces)
    return [each[..., np.rint(np.linspace(0, each.shape[-1] - 1, count)).astype(int)] for each in forces]


def _run(settings: RunSettings, laws: Sequence[LanesLaw], seeds: Sequence[int]) -> Array:
    settings = far_enough(settings)
    task = Task(settings, lanes=len(laws) * len(seeds))
    task.reset(np.arange(task.lanes), lambda lane: np.random.default_rng(seeds[lane % len(seeds)]))
    context, results = task.context(0), task.results
    unable: dict[int, InputError] = {}
    for k, law in enumerate(laws):
        try:
            law.begin(context, len(seeds))
        except InputError as error:
            unable[k] = error
    if len(unable) == len(laws):
        raise unable[0]
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
    passed = zip(low_pass(force, time_step), places, strict=True)
    kept = np.array(_one_length([own[alignment.within(at, spans)] for own, at in passed]))
    return np.asarray(kept[:, :: max(1, round(1 / (KEPT_RATE * time_step)))])


Residuals = Callable[[Array], Array]
"""Function from candidates, (candidates, gains), to residuals, (candidates, residuals).

Residuals of a candidate that fails are nan or huge."""
DAMPINGS = (1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Dampings of an iteration's candidates, in units of the curvature of the sum of squares."""
ENOUGH = 1e-3
"""Relative gain of an iteration below which the fit ends."""


@dataclass(frozen=True)
class Fit:
    """Outcome of a fit."""

    gains: Array  # (gains,)
    history: tuple[float, ...]  # sum of squares at the start and after each iteration


def fit(residuals: Residuals, start: Array, steps: Array, iterations: int, ridge: float = 0.0) -> Fit:
    """Least squares from a start, (gains,): differences by ``steps``, then the best of several dampings.

    Gains are scaled by ``steps``, also for the damping and for ``ridge``, the weight of (gain / step)^2 per
    gain. An iteration evaluates 1 + gains candidates for the differences, then one per damping, and takes the
    one with the minimum sum of squares; the fit ends when that is no better than before. Raises InputError if
    the start has no finite residuals.
    """
    gains, history, size = np.asarray(start, dtype=float), list[float](), len(start)
    for _ in range(iterations):
        values = residuals(gains + np.concatenate([np.zeros((1, size)), np.diag(steps)]))
        residual = values[0]
        if not np.isfinite(residual).all():
            raise InputError("The tuning cannot start: a pass with its initial gains ends early.")
        objective = float(residual @ residual + ridge * np.sum((gains / steps) ** 2))
        history = history or [objective]
        usable = np.asarray(np.isfinite(values[1:]).all(axis=1))
        if not usable.any():
            break
        jacobian = np.where(usable[:, None], values[1:] - residual, 0.0).T
        hessian = jacobian.T @ jacobian + ridge * np.eye(size)
        gradient = jacobian.T @ residual + ridge * gains / steps
        typical = np.trace(hessian) / size
        moves = [np.linalg.solve(hessian + each * typical * np.eye(size), -gradient) for each in DAMPINGS]
        candidates = gains + np.array(moves) * np.where(usable, steps, 0.0)
        reached = residuals(candidates)
        objectives = (reached**2).sum(axis=1) + ridge * ((candidates / steps) ** 2).sum(axis=1)
        best = int(np.argmin(np.where(np.isfinite(objectives), objectives, np.inf)))
        if not objectives[best] < objective:
            break
        gains = candidates[best]
        history.append(float(objectives[best]))
        if objectives[best] > (1 - ENOUGH) * objective:
            break
    return Fit(gains, tuple(history))


SPEEDS_KMH = (200.0, 225.0, 250.0, 275.0, 300.0, 325.0, 350.0)
SEEDS = 4
"""Default number of training seeds: more make a fit slower, and lines of one condition differ little."""
SELECTION_SEEDS = 5
PASSES = 4000
"""Maximum number of passes per speed, the same for every policy. A fit that stops improving ends earlier."""
MEAN_TOLERANCE, MEAN_WEIGHT = 0.015, 0.04
"""A mean force this far (-) from the passive one adds this weight to (sigma / passive sigma)^2."""
RIDGE = 1e-5
"""Penalty on a gain of one step: without it, gains that have hardly any effect would grow."""


@dataclass(frozen=True)
class Tuned:
    """Gains at one speed, and their effect."""

    speed_kmh: float
    gains: tuple[float, ...]
    history: tuple[float, ...]  # objective at the start and after each iteration
    passes: int  # number of passes simulated
    std_change: float  # relative change of sigma from passive, mean over selection seeds (-)
    mean_change: float  # relative change of the mean force from passive, likewise (-)


def tunable(name: str, washout: float = 0.0) -> type[TunableLaw]:
    """Class of the policy with this name. Raises InputError if it can't be tuned, or not with a washout."""
    maker = maker_of(name) if name in policy_names() else None
    if _has_gains(maker, washout):
        return maker
    able = []
    for each in policy_names():
        with suppress(InputError):  # a plug-in that can't be loaded
            able += [each] if _has_gains(maker_of(each), washout) else []
    what = f"no gains to tune{' with a washout' if washout else ''}"
    raise InputError(f"'{name}' has {what}; policies with gains are {', '.join(able)}.")


def _has_gains(maker: Any, washout: float) -> TypeGuard[type[TunableLaw]]:
    """Whether it makes a law with gains, and with a washout if there is one."""
    law = isinstance(maker, type) and issubclass(maker, TunableLaw)
    return law and (washout == 0.0 or "washout" in parameters_of(maker))


def tune_at(policy: str, settings: RunSettings, speed_kmh: float, seeds: int, passes: int) -> Tuned:
    """Tune a policy for the settings' line, pantograph, actuator and sensors, at one speed (km/h).

    seeds: number of training seeds. passes: maximum number of passes. Training runs with ``accuracy="fast"``,
    the selection seeds run with the accuracy of the settings.
    """
    kind, training = tunable(policy), TRAINING[:seeds]
    at_speed = settings.model_copy(update={"speed_kmh": (speed_kmh, speed_kmh)})
    fast = at_speed.model_copy(update={"accuracy": "fast"})
    passive = run_batch(fast, [Still()], training)
    used = len(training)

    def residuals(candidates: Array) -> Array:
        nonlocal used
        used += len(candidates) * len(training)
        laws = [kind(gains=tuple(each.tolist())) for each in candidates]
        return residuals_of(run_batch(fast, laws, training), passive)

    steps, first = np.array(list(kind.TUNED.values())).T
    iterations = max(1, passes // ((1 + len(first) + len(DAMPINGS)) * len(training)))
    found = fit(residuals, first, steps, iterations, RIDGE)
    gains = tuple(found.gains.tolist())
    selection = SELECTION[:SELECTION_SEEDS]
    reached = run_batch(at_speed, [Still(), kind(gains=gains)], selection)
    std_change = float(np.mean(reached.std[1] / reached.std[0]) - 1)
    mean_change = float(np.mean(reached.mean[1] / reached.mean[0]) - 1)
    return Tuned(speed_kmh, gains, found.history, used, std_change, mean_change)


def residuals_of(forces: Forces, passive: Forces) -> Array:
    """Residuals of laws, (laws, residuals), whose squares sum to the mean over seeds of the objective.

    The objective is (sigma / passive sigma)^2 plus a penalty for a mean force other than the passive one.
    """
    laws, seeds, samples = forces.values.shape
    deviation = (forces.values - forces.mean[..., None]) / passive.std[..., None] / np.sqrt(seeds * samples)
    off = np.sqrt(MEAN_WEIGHT / seeds) / MEAN_TOLERANCE * (forces.mean / passive.mean - 1)
    return np.concatenate([deviation.reshape(laws, -1), off], axis=1)
