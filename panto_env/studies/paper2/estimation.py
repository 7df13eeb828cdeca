"""Paper 2's estimator (section 4.1): how well each way finds the contact force, and which parameters besides.

The pantograph that the estimators know differs from the simulated one by 5 % rms in every mass, spring and
damper; sensors have the noise of the preset "realistic". Figures are medians over seeds of mismatch and
noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...analysis.pool import Progress, in_processes
from ...analysis.simulation import simulate
from ...base.arrays import Array
from ...catalog import load_pantograph
from ...estimation.estimate import BANDS, Score, estimate, score
from ...estimation.force import FORCE_MODELS, RandomWalk, as_force_model
from ...estimation.model import PAPER2, EstimatorSettings
from ...estimation.motion import DISPLACEMENT_NOISE, VELOCITY_NOISE, Motion, measure
from ...estimation.parameters import (
    LIFT,
    Parameters,
    estimate_parameters,
    frame_parameters,
    information,
    parameter_names,
)
from ...estimation.unknown_input import inertia_corrected, unknown_input
from ...metrics.trajectory import Trajectory
from ...plant.pantograph.build import with_scatter
from ...plant.pantograph.schema import PantographData

CATENARY, PANTOGRAPH = "en50318-2002", "own-two-mass"
"""The paper's line with both wires and droppers, and its rig's pantograph, static load 120 N."""
SPEEDS_KMH = (150.0, 200.0, 250.0, 300.0, 350.0)
SPEED_KMH = 250.0
"""That of the paper's Figs 11 and 12."""
MISMATCH = 0.05
SEEDS = 3
TIME_STEP = 5e-4
"""Of the simulation (s): two steps to a sample."""
START = 2.0
"""Time (s) in which pass and filters forget their start."""
OBSERVATIONS = ("displacements and velocities", "displacements")
CUTOFFS = {OBSERVATIONS[0]: 80.0, OBSERVATIONS[1]: 50.0}
"""Low-pass of what has no filter's model (Hz): about the minimum error at all frequencies over all speeds."""
LAG = 0.1
"""Of the smoother (s)."""
FREE = 1e5
"""Intensity of a random walk (N/s^0.5) of which next to nothing is believed."""
NOISES = (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4)
"""Of displacements, rms (m)."""


@dataclass(frozen=True)
class Case:
    """One way to estimate the force of one pass, median over seeds."""

    speed_kmh: float
    condition: str
    observation: str
    method: str
    scores: tuple[Score, ...]  # by band
    least_correlation: tuple[float, ...]  # of any seed, by band


def run(speed_kmh: float, condition: str = "new") -> Trajectory:
    """A passive pass along the line."""
    return simulate(
        CATENARY, PANTOGRAPH, speed_kmh, time_step=TIME_STEP, line_condition=condition, record_droppers=False
    )


def known_pantograph(seed: int) -> PantographData:
    """The pantograph as an estimator knows it, not as it is."""
    return with_scatter(load_pantograph(PANTOGRAPH), MISMATCH, np.random.default_rng(seed))


def filtered(force_model: str, lag: float, motion: Motion, known: PantographData, observation: str) -> Array:
    """Contact force (N), (n,), by a Kalman filter with this belief, or a smoother."""
    settings = EstimatorSettings(
        observation=observation,
        force_model=as_force_model(force_model),
        lag=lag,
    )
    return estimate(motion, known, settings).force


def by_unknown_input(motion: Motion, known: PantographData, observation: str) -> Array:
    """Contact force (N), (n,), of which nothing is believed, low-passed."""
    settings = EstimatorSettings(observation=observation)
    return unknown_input(motion, known, settings, cutoff=CUTOFFS[observation])


def by_inertia(motion: Motion, known: PantographData, observation: str) -> Array:
    """Contact force (N), (n,), from the suspension less the head's inertia, low-passed."""
    velocities = observation == OBSERVATIONS[0]
    return inertia_corrected(motion, known, velocities=velocities, cutoff=CUTOFFS[observation])


METHODS: dict[str, Callable[[Motion, PantographData, str], Array]] = {
    **{f"filter, {name}": partial(filtered, name, 0.0) for name in FORCE_MODELS},
    f"smoother, {1e3 * LAG:g} ms": partial(filtered, "random-walk", LAG),
    "unknown input": by_unknown_input,
    "inertia-corrected": by_inertia,
}


def settled_scores(motion: Motion, force: Array) -> tuple[Score, ...]:
    """Of an estimate (N), (n,), once all has forgotten its start, by band."""
    assert motion.contact_force is not None
    kept = slice(round(START / motion.time_step), None)
    return tuple(score(motion.contact_force[kept], force[kept], motion.time_step, band) for band in BANDS)


def cases(
    speeds_kmh: Sequence[float] = SPEEDS_KMH, condition: str = "new", progress: Progress | None = None
) -> list[Case]:
    """Every method, with both sets of observations, at every speed, on all cores."""
    runs = {speed: run(speed, condition) for speed in speeds_kmh}
    keys = [(speed, seed) for speed in speeds_kmh for seed in range(SEEDS)]
    jobs = [partial(_assess, measure(runs[speed], seed=seed), seed) for speed, seed in keys]
    found = dict(zip(keys, in_processes(jobs, progress=progress), strict=True))
    return [
        _median(
            (speed, condition, observation, method),
            [found[speed, seed][observation, method] for seed in range(SEEDS)],
        )
        for speed in speeds_kmh
        for observation in OBSERVATIONS
        for method in METHODS
    ]


def _assess(motion: Motion, seed: int) -> dict[tuple[str, str], tuple[Score, ...]]:
    known = known_pantograph(seed)
    return {
        (observation, method): settled_scores(motion, find(motion, known, observation))
        for observation in OBSERVATIONS
        for method, find in METHODS.items()
    }


def _median(which: tuple[float, str, str, str], seeds: Sequence[tuple[Score, ...]]) -> Case:
    scores, lowest = [], []
    for of_band in zip(*seeds, strict=True):
        medians = np.median([list(vars(each).values()) for each in of_band], axis=0)
        scores.append(Score(*medians.tolist()))
        lowest.append(min(each.correlation for each in of_band))
    return Case(*which, tuple(scores), tuple(lowest))


def over_noise(trajectory: Trajectory) -> Mapping[tuple[str, float], Score]:
    """Scores in 0 to 20 Hz by observation and noise of displacements (m), velocities' in proportion."""
    found = {}
    for noise in NOISES:
        velocity = noise / DISPLACEMENT_NOISE * VELOCITY_NOISE
        motion = measure(trajectory, displacement_noise=noise, velocity_noise=velocity)
        for observation in OBSERVATIONS:
            settings = EstimatorSettings(
                observation=observation,
                displacement_noise=noise,
                velocity_noise=velocity,
            )
            force = estimate(motion, known_pantograph(0), settings).force
            found[observation, noise] = settled_scores(motion, force)[-1]
    return found


@dataclass(frozen=True)
class ParameterInformation:
    """Parameters as the extended filter found them, and how well a pass can determine them at all."""

    known: PantographData
    found: Parameters
    bounds: Mapping[str, float]  # minimum relative standard deviation of each alone, by name
    scale: float  # minimum relative standard deviation of all frame parameters and the lift by one factor


def parameter_information(trajectory: Trajectory) -> ParameterInformation:
    """Parameters by the extended filter, and how well the pass can determine each."""
    motion, true = measure(trajectory), load_pantograph(PANTOGRAPH)
    settings = EstimatorSettings(observation=OBSERVATIONS[1])
    found = estimate_parameters(motion, known_pantograph(0), settings)
    free = settings.model_copy(update={**PAPER2, "force_model": RandomWalk(intensity=FREE)})
    names = (*parameter_names(true), LIFT)
    single = np.diag(information(motion, true, free, names)) ** -0.5
    together = information(motion, true, free, (*frame_parameters(true), LIFT))
    return ParameterInformation(
        known=known_pantograph(0),
        found=found,
        bounds=dict(zip(names, single.tolist(), strict=True)),
        scale=float(np.linalg.eigvalsh(together)[0] ** -0.5),
    )
