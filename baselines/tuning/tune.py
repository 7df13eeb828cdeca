"""Tuning of a policy for a line: gains fitted speed by speed on training seeds, judged on selection seeds."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError
from panto_env.control.settings import RunSettings
from panto_env.policies import maker_of, parameters_of, policy_names

from ..benchmark.settings import SELECTION, TRAINING
from ..policies.lanes_law import TunableLaw
from .batch import Forces, Still, run_batch
from .gauss_newton import DAMPINGS, fit

Array = NDArray[np.float64]
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
