"""The oracle of one pass: searches from several starts, and the best one's commands, replayed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from panto_env import Trajectory
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.base.shown import shown
from panto_env.metrics.figures import Figures
from panto_env.metrics.low_pass import zero_phase_low_pass

from .problem import Problem
from .solver import Descent, Progress, descend

STARTS = ("zero", "periodic", "random")
"""No force; the best of what repeats from span to span, itself searched for; noise."""
HARMONICS = 14
"""Of the span in what repeats."""
PERIODIC_ITERATIONS = 15
RANDOM_FORCE, RANDOM_TIME = 20.0, 0.05
"""Rms of the noise (N), and the time over which it is smoothed (s)."""
HOP_FORCE = 5.0
"""Rms of the noise (N) by which the best knots are shaken for a hop."""
DECIMALS = 2
"""Of the commands (N) that are replayed and kept."""
METHOD = 2
"""Version of the search: one more wherever other commands come of it, so that nothing older is kept."""
MEAN_TOLERANCE = 1e-3
"""Maximum difference of the mean force from the passive run's, as a share of it."""


@dataclass(frozen=True)
class Oracle:
    """What was found for one pass."""

    problem: Problem
    searches: tuple[Descent, ...]  # in the order of the starts; that for the periodic start stands before it
    commands: Array  # (count, places): of the best, from step ``problem.begin`` on (N)
    run: Trajectory  # the whole pass as ``simulate`` has it under these commands
    figures: Figures  # of it over the evaluated spans
    forces: tuple[Array, Array]  # passive and with the commands, filtered in place (N), of the whole pass

    @property
    def best(self) -> Descent:
        """The search whose commands these are."""
        return min(self.searches, key=_std)

    @property
    def change(self) -> float:
        """Of σ against the passive run, as a share of it."""
        return self.figures.std / self.problem.figures.std - 1.0


def find(
    problem: Problem,
    starts: Sequence[str] = STARTS[:1],
    progress: Progress | None = None,
    neighbour: Oracle | None = None,
    hops: int = 0,
) -> Oracle:
    """The best of searches from starts, each one of ``STARTS``. progress: as of ``descend``.

    hops: so often the best knots so far are shaken and searched from anew (basin hopping: Wales and Doye,
    J. Phys. Chem. A 101 (1997) 5111): droppers that slacken and tighten leave many shallow optima.
    neighbour: of the same cell under another seed, from whose knots the only search then starts: lines of one
    condition differ little. Raises InputError where the pass that was found ends early or has another mean
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
            f"The oracle's mean force is {figures.mean:.2f} N, not {mean:.2f} N as that of the passive run; "
            "search from other starts."
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
    """The search from a start, and before it the one for that start."""
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
    """Forces that repeat from span to span, and steady ones, (knots of all places, directions).

    Sines and cosines of ``HARMONICS`` of the span at the ends of the control intervals.
    """
    passive = problem.passive
    time = (problem.begin + 1.0 + np.arange(problem.count)) * problem.interval
    turns = passive.alignment.in_spans(np.interp(time, passive.time, passive.position))
    waves = [np.ones_like(turns)]
    for harmonic in range(1, HARMONICS + 1):
        waves += [np.cos(2 * np.pi * harmonic * turns), np.sin(2 * np.pi * harmonic * turns)]
    return np.kron(np.stack(waves, axis=1), np.eye(problem.places))


def noise(problem: Problem, force: float = RANDOM_FORCE, draw: int = 0) -> Array:
    """Smooth noise of so much force (rms, N), (count, places) (N), the same for the same pass and draw."""
    length = max(1, round(RANDOM_TIME / problem.interval))
    white = np.random.default_rng([problem.seed, draw]).standard_normal(
        (problem.count + length, problem.places)
    )
    total = np.cumsum(white, axis=0)
    return np.asarray(force / np.sqrt(length) * (total[length:] - total[:-length]))
