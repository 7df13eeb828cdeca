"""Gauss-Newton on the knots, within the actuator's limits and at the passive run's mean force.

Each iteration takes the response of the filtered force to every knot from the true plant, minimises the sum
of squares of its linear model under the limits and the mean (a quadratic programme, solved by OSQP: Stellato
et al., Math. Prog. Comp. 12 (2020) 637), and goes along that way as far as the true plant agrees. What
is found is a local optimum that is reached: a bound on what control can reach, not a proof that
there is nothing better.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, eye_array, kron

from panto_env import Trajectory
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError, shown
from panto_env.metrics.figures import Figures
from panto_env.metrics.low_pass import zero_phase_low_pass

from ..policies.mpc import quadratic_solver
from .problem import Limits, Problem

SHARES = (1.0, 0.6, 0.3, 0.1)  # shares of a step that are tried, all at once
DAMPING = 0.1
"""Initial weight of the step's own size, relative to the mean square of the response to one knot."""
DAMPINGS = (0.03, 0.3, 3.0, 30.0)
"""Factors on the last damping, tried in each iteration: for large steps the linear model is wrong."""
MEAN_TOLERANCE = 5e-4
"""Maximum difference of the mean force from the passive run's at the end of a search, as a share of it."""
MEAN_WEIGHT = 2.0  # weight of the mean's error (N) in the merit; a lower mean by 1 N lowers σ by a few tenths
MEAN_STIFFNESS = 1e3
"""Weight of the mean's squared error, relative to σ squared; hundredths of a newton remain."""
WORTH, ENOUGH = 2e-2, 5e-4
"""Relative gains of an iteration: below the first the response is measured anew; if it was new, the search
ends below the second."""
MOST_ITERATIONS = 20
OSQP = {"verbose": False, "eps_abs": 1e-4, "eps_rel": 1e-4, "max_iter": 10_000}


@dataclass(frozen=True)
class Iteration:
    """State of the search after an iteration."""

    number: int
    std: float  # σ of the filtered force (N)
    mean: float  # N
    at_limits: float  # share of the knots at a limit of force or rate
    step: float  # share taken of the last step


@dataclass(frozen=True)
class Descent:
    """One search from one start."""

    start: str
    knots: Array  # (count, places): N
    iterations: tuple[Iteration, ...]

    @property
    def std(self) -> float:
        """σ reached (N)."""
        return self.iterations[-1].std


Progress = Callable[[str, Iteration], None]


def descend(
    problem: Problem,
    start: str,
    knots: Array,
    *,
    basis: Array | None = None,
    iterations: int = MOST_ITERATIONS,
    progress: Progress | None = None,
) -> Descent:
    """Search from knots, (count, places) (N), that keep the limits; start: name of these knots.

    basis: (knots of all places, directions), to search only these combinations. progress: called with each
    iteration. The merit, σ plus a weighted error of the mean, falls from iteration to iteration. If the mean
    is not met after ``iterations``, up to as many more follow.
    """
    one = problem.knots.limits(problem.count)
    # Of the knots of all actuators, (count, places), flattened row by row.
    matrix = csc_matrix(kron(one.matrix, eye_array(problem.places)))
    limits = Limits(matrix, np.repeat(one.bound, problem.places))
    force, damping = problem.forces(knots[None])[0], DAMPING
    found: list[Iteration] = []

    def note(share: float) -> None:
        at_limits = problem.knots.at_limits(knots)
        found.append(Iteration(len(found), float(force.std()), float(force.mean()), at_limits, share))
        if progress is not None:
            progress(start, found[-1])

    def measured() -> Array:
        return problem.response(knots) if basis is None else problem.response_along(knots, basis)

    note(0.0)
    response, fresh = measured(), True
    while len(found) <= iterations or (not _mean_met(problem, force) and len(found) <= 2 * iterations):
        before = merit(problem, force)
        weights = damping * np.array(DAMPINGS)
        best_steps = _best_steps(problem, response, force, knots.ravel(), limits, basis, weights)
        steps = np.array([share * step for step in best_steps for share in SHARES])
        tried = knots + (steps if basis is None else steps @ basis.T).reshape(-1, *knots.shape)
        forces = problem.forces(tried)
        merits = [merit(problem, each) for each in forces]
        best = int(np.argmin(merits))
        share = SHARES[best % len(SHARES)] if merits[best] < before else 0.0
        if share > 0:
            change = (forces[best] - force)[:: problem.every]
            response = corrected(response, steps[best], change)
            knots, force = tried[best], forces[best]
            damping = weights[best // len(SHARES)]
        else:
            damping = weights[-1]
        note(share)
        gain = (before - merit(problem, force)) / before
        if gain < ENOUGH and fresh and _mean_met(problem, force):
            break
        fresh = gain < WORTH
        if fresh:
            response = measured()
    return Descent(start, knots, tuple(found))


def merit(problem: Problem, force: Array) -> float:
    """Merit (N), to minimise: σ of a filtered force, (samples,), plus the weighted error of its mean."""
    return float(force.std() + MEAN_WEIGHT * abs(force.mean() - problem.figures.mean))


def _mean_met(problem: Problem, force: Array) -> bool:
    """Whether the mean of a filtered force, (samples,) (N), is that of the passive run."""
    required = problem.figures.mean
    return abs(float(force.mean()) - required) <= MEAN_TOLERANCE * required


def _best_steps(
    problem: Problem,
    response: Array,
    force: Array,
    knots: Array,
    limits: Limits,
    basis: Array | None,
    dampings: Array,
) -> list[Array]:
    """Best steps along each direction (N) within the limits, one for each damping: see ``DAMPING``.

    They minimise a quadratic model: squares of the filtered force, (samples,) (N), about its mean, and of the
    mean's error. response: (rows, directions) (N/N); knots: the present ones, flat (N). Without a basis each
    direction is a knot. Raises InputError if OSQP finds no step.
    """
    compared = force[:: problem.every]
    mean = response.mean(axis=0)
    stiffness = MEAN_STIFFNESS * len(compared)
    missing = problem.figures.mean - float(force.mean())
    about_mean = response - mean
    plain = about_mean.T @ about_mean
    size = float(np.trace(plain)) / len(plain)
    plain += stiffness * np.outer(mean, mean)
    gradient = about_mean.T @ (compared - compared.mean()) - stiffness * missing * mean
    now = limits.matrix @ knots
    matrix = limits.matrix if basis is None else csc_matrix(limits.matrix @ basis)
    steps = []
    for damping in dampings:
        hessian = plain + damping * size * np.eye(len(plain))
        scale = 1.0 / float(np.diag(hessian).max())
        solver = quadratic_solver("An oracle")
        low, high = -limits.bound - now, limits.bound - now
        solver.setup(csc_matrix(np.triu(scale * hessian)), scale * gradient, matrix, low, high, **OSQP)
        answer = solver.solve(raise_error=False)
        if answer.x is None or not np.isfinite(answer.x).all():
            raise InputError(f"The search for an oracle stopped: OSQP says '{answer.info.status}'.")
        steps.append(np.asarray(answer.x))
    return steps


def corrected(response: Array, step: Array, change: Array) -> Array:
    """The response with the smallest correction that gives the change, (rows,), of a step, (directions,) (N).

    Broyden's formula: Broyden, Math. Comp. 19 (1965) 577.
    """
    return np.asarray(response + np.outer(change - response @ step, step) / (step @ step))


STARTS = ("zero", "periodic", "random")
"""Starts of a search: zero force; the best force that repeats from span to span; noise."""
HARMONICS = 14  # number of harmonics of the span in a force that repeats
PERIODIC_ITERATIONS = 15
RANDOM_FORCE, RANDOM_TIME = 20.0, 0.05  # rms of the noise (N), and the time over which it is smoothed (s)
HOP_FORCE = 5.0  # rms of the noise (N) that is added to the best knots for a hop
DECIMALS = 2  # decimals of the commands (N) that are replayed and stored
METHOD = 2
"""Version of the search; raised by changes that give other commands, so that older results are redone."""
MEAN_TOLERANCE_OF_RUN = 1e-3  # maximum difference of the mean force from the passive run's, as a share of it


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
        return _best(self.searches)

    @property
    def change(self) -> float:
        """Relative change of σ from the passive run."""
        return self.figures.std / self.problem.figures.std - 1.0


def _best(searches: Sequence[Descent]) -> Descent:
    return min(searches, key=lambda search: search.std)


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
        shaken = _best(searches).knots + noise(problem, HOP_FORCE, hop)
        searches.append(descend(problem, f"hop {hop}", problem.knots.within(shaken), progress=progress))
    commands = np.round(problem.knots.commands(_best(searches).knots), DECIMALS)
    run = problem.replay(commands)
    if run.terminated:
        raise InputError(f"The oracle's pass has no figures. {run.ending}")
    figures, mean = run.summary(problem.chosen), problem.figures.mean
    if abs(figures.mean - mean) > MEAN_TOLERANCE_OF_RUN * mean:
        raise InputError(
            f"The oracle's mean force is {figures.mean:.2f} N, but the passive run's is {mean:.2f} N; search "
            "from other starts."
        )
    passive, own = (
        zero_phase_low_pass(each.contact_force, each.time_step) for each in (problem.passive, run)
    )
    return Oracle(problem, tuple(searches), commands, run, figures, (passive, own))


def _searches(problem: Problem, start: str, progress: Progress | None) -> Iterator[Descent]:
    """The search from a start, preceded by the search for that start if it has one."""
    knots: Array = np.zeros((problem.count, problem.places))
    if start == "periodic":
        basis, most = span_periodic(problem), PERIODIC_ITERATIONS
        repeated = descend(problem, "repeated", knots, basis=basis, iterations=most, progress=progress)
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
    random = np.random.default_rng([problem.seed, draw])
    total = np.cumsum(random.standard_normal((problem.count + length, problem.places)), axis=0)
    return np.asarray(force / np.sqrt(length) * (total[length:] - total[:-length]))
