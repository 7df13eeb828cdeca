"""Oracle of one pass: searches from several starts; the commands of the best one are replayed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from panto_env import Trajectory
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError, shown
from panto_env.metrics.figures import Figures
from panto_env.metrics.low_pass import zero_phase_low_pass

from .problem import Problem
from .solver import Descent, Progress, descend

STARTS = ("zero", "periodic", "random")
"""Starts of a search: zero force; the best force that repeats from span to span; noise."""
HARMONICS = 14
"""Number of harmonics of the span in a force that repeats."""
PERIODIC_ITERATIONS = 15
RANDOM_FORCE, RANDOM_TIME = 20.0, 0.05
"""Rms of the noise (N), and the time over which it is smoothed (s)."""
HOP_FORCE = 5.0
"""Rms of the noise (N) that is added to the best knots for a hop."""
DECIMALS = 2
"""Decimals of the commands (N) that are replayed and stored."""
METHOD = 2
"""Version of the search; raised by changes that give other commands, so that older results are redone."""
MEAN_TOLERANCE = 1e-3
"""Maximum difference of the mean force from the passive run's, as a share of it."""


@dataclass(frozen=True)
class Oracle:
    """Outcome of the searches for one pass."""

    problem: Problem
    searches: tuple[Descent, ...]  # by start; before the periodic one stands the search for its start
    commands: Array  # (count, places): of the best search, from step ``problem.begin`` on (N)
    run: Trajectory  # the whole pass under these commands, from ``simulate``
    figures: Figures  # of the run over the evaluated spans
    forces: tuple[Array, Array]  # passive and controlled contact force of the whole pass, without delay (N)

    @property
    def best(self) -> Descent:
        """The search that reached the minimum σ."""
        return min(self.searches, key=_std)

    @property
    def change(self) -> float:
        """Relative change of σ from the passive run."""
        return self.figures.std / self.problem.figures.std - 1.0


def find(
    problem: Problem,
    starts: Sequence[str] = STARTS[:1],
    progress: Progress | None = None,
    neighbour: Oracle | None = None,
    hops: int = 0,
) -> Oracle:
    """Search from each of the starts (see ``STARTS``) and return the best. progress: see ``descend``.

    hops: number of further searches, each from the best knots so far plus noise (basin hopping: Wales and
    Doye, J. Phys. Chem. A 101 (1997) 5111): droppers that slacken and tighten leave many shallow optima.
    neighbour: oracle of the same cell under another seed; the only search then starts from its knots, since
    lines of one condition differ little. Raises InputError if the pass ends early or has a different mean
    force.
    """
    if neighbour is None:
        searches = [search for start in starts for search in _searches(problem, start, progress)]
    else:
        name = f"seed {neighbour.problem.seed}"
        searches = [descend(problem, name, neighbour.best.knots, progress=progress)]
    for hop in range(1, hops + 1):
        shaken = min(searches, key=_std).knots + noise(problem, HOP_FORCE, hop)
        searches.append(descend(problem, f"hop {hop}", problem.knots.within(shaken), progress=progress))
    best = min(searches, key=_std)
    commands = np.round(problem.knots.commands(best.knots), DECIMALS)
    run = problem.replay(commands)
    if run.terminated:
        raise InputError(f"The oracle's pass has no figures. {run.ending}")
    figures, mean = run.summary(problem.chosen), problem.figures.mean
    if abs(figures.mean - mean) > MEAN_TOLERANCE * mean:
        raise InputError(
            f"The oracle's mean force is {figures.mean:.2f} N, but the passive run's is {mean:.2f} N; search "
            "from other starts."
        )
    passive = problem.passive
    forces = (
        zero_phase_low_pass(passive.contact_force, passive.time_step),
        zero_phase_low_pass(run.contact_force, run.time_step),
    )
    return Oracle(problem, tuple(searches), commands, run, figures, forces)


def _std(search: Descent) -> float:
    return search.std


def _searches(problem: Problem, start: str, progress: Progress | None) -> Iterator[Descent]:
    """The search from a start, preceded by the search for that start if it has one."""
    knots: Array = np.zeros((problem.count, problem.places))
    if start == "periodic":
        repeated = descend(
            problem,
            "repeated",
            knots,
            basis=span_periodic(problem),
            iterations=PERIODIC_ITERATIONS,
            progress=progress,
        )
        yield repeated
        knots = repeated.knots
    elif start == "random":
        knots = problem.knots.within(noise(problem))
    elif start != "zero":
        raise InputError(f"A start must be one of {', '.join(STARTS)}, not {shown(start)}.")
    yield descend(problem, start, knots, progress=progress)


def span_periodic(problem: Problem) -> Array:
    """Basis of forces that repeat from span to span, constants included, (knots of all places, directions).

    Sines and cosines of the span's first ``HARMONICS`` harmonics at the ends of the control intervals.
    """
    passive = problem.passive
    time = (problem.begin + 1.0 + np.arange(problem.count)) * problem.interval
    turns = passive.alignment.in_spans(np.interp(time, passive.time, passive.position))
    waves = [np.ones_like(turns)]
    for harmonic in range(1, HARMONICS + 1):
        waves += [np.cos(2 * np.pi * harmonic * turns), np.sin(2 * np.pi * harmonic * turns)]
    return np.kron(np.stack(waves, axis=1), np.eye(problem.places))


def noise(problem: Problem, force: float = RANDOM_FORCE, draw: int = 0) -> Array:
    """Smooth noise (N), (count, places), with this rms force (N); the same for the same pass and draw."""
    length = max(1, round(RANDOM_TIME / problem.interval))
    white = np.random.default_rng([problem.seed, draw]).standard_normal(
        (problem.count + length, problem.places)
    )
    total = np.cumsum(white, axis=0)
    return np.asarray(force / np.sqrt(length) * (total[length:] - total[:-length]))
