"""Noise intensities by maximum likelihood from healthy runs, not by hand.

The likelihood of a record is that of its innovations (F. C. Schweppe, IEEE Trans. Information Theory 11:61,
1965, recalled); the true force is not needed, so that a train in service can be tuned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, suggest
from ..base.settings import Between, ranges_of
from ..plant.pantograph.schema import PantographData
from .estimate import filter_motion, first_settled, model_of
from .innovations import log_likelihood
from .kalman import steady_gains
from .motion import Motion
from .plausibility import check_motion
from .settings import EstimatorSettings

FINE = 0.01
"""Relative change of values below which they count as found."""
ALIKE = 1e-6
"""Difference of the log-likelihood of a sample below which two values count as equally likely."""
MOST_EVALUATIONS = 1000


@dataclass(frozen=True)
class Tuning:
    """What maximum likelihood found."""

    settings: EstimatorSettings
    values: dict[str, float]  # by name
    log_likelihood: float  # per sample that counts
    before: float  # of the settings that it began with, per sample that counts
    at_bounds: tuple[str, ...]  # names that ended at an end of their range: the records do not determine them


def tune(
    motions: Sequence[Motion],
    pantograph: PantographData,
    settings: EstimatorSettings,
    names: Sequence[str],
) -> Tuning:
    """Values of settings, by name, that make the motions of healthy runs most likely.

    names: as "frame_intensity" or, of the force model, "force_model.intensity". The steady filter is run over
    each motion; its first second, in which the start is forgotten, does not count.

    Raises InputError for motions that can't be a pantograph's, unknown names, or where the search does not
    end.
    """
    from scipy.optimize import minimize  # slow to import

    if not motions:
        raise InputError("Tuning needs at least one healthy run.")
    for motion in motions:
        check_motion(motion, pantograph)
    ranges = [_range(settings, name) for name in names]
    bounds = [(math.log(each.low), math.log(each.high)) for each in ranges]
    begin = np.array([math.log(_get(settings, name)) for name in names])
    samples = sum(len(motion.head) - first_settled(motion) for motion in motions)

    def cost(logarithms: Array) -> float:
        return -_log_likelihood(motions, pantograph, _changed(settings, names, logarithms)) / samples

    before = -cost(begin)
    found = minimize(
        cost,
        begin,
        method="Nelder-Mead",
        bounds=bounds,
        options={"xatol": FINE, "fatol": ALIKE, "maxfev": MOST_EVALUATIONS},
    )
    if not found.success:
        raise InputError(
            f"The search for the most likely settings does not end ({found.message}); name fewer."
        )
    tuned = _changed(settings, names, found.x)
    ends = zip(names, found.x, bounds, strict=True)
    return Tuning(
        settings=tuned,
        values={name: _get(tuned, name) for name in names},
        log_likelihood=-float(found.fun),
        before=before,
        at_bounds=tuple(name for name, x, (low, high) in ends if min(x - low, high - x) < FINE),
    )


def _log_likelihood(
    motions: Sequence[Motion], pantograph: PantographData, settings: EstimatorSettings
) -> float:
    total = 0.0
    for motion in motions:
        model = model_of(motion, pantograph, settings)
        filtered = filter_motion(model, steady_gains(model), motion)
        total += log_likelihood(filtered, first_settled(motion))
    return total


def _table(settings: EstimatorSettings, name: str) -> tuple[Any, str]:
    """The settings that hold a name, and its last part. Raises InputError for an unknown name."""
    holder: Any = settings.force_model if name.startswith("force_model.") else settings
    key = name.removeprefix("force_model.")
    field = type(holder).model_fields.get(key)
    if field is None or not list(ranges_of(field.rebuild_annotation())):
        known = [key for key, each in _numbers(settings)] + [
            f"force_model.{key}" for key, each in _numbers(settings.force_model)
        ]
        raise InputError(f"Unknown value '{name}' to tune: {suggest(name, known)}.")
    return holder, key


def _numbers(settings: Any) -> list[tuple[str, Any]]:
    fields = type(settings).model_fields.items()
    return [(key, field) for key, field in fields if list(ranges_of(field.rebuild_annotation()))]


def _range(settings: EstimatorSettings, name: str) -> Between:
    """The range of a value, above 0."""
    holder, key = _table(settings, name)
    (between,) = ranges_of(type(holder).model_fields[key].rebuild_annotation())
    return Between(max(between.low, 1e-6 * between.high), between.high)


def _get(settings: EstimatorSettings, name: str) -> float:
    holder, key = _table(settings, name)
    value: float = getattr(holder, key)
    if value <= 0:
        raise InputError(f"'{name}' is {value:g}, which can't be tuned; begin with a value above 0.")
    return value


def _changed(settings: EstimatorSettings, names: Sequence[str], logarithms: Array) -> EstimatorSettings:
    outer: dict[str, Any] = {}
    inner: dict[str, float] = {}
    for name, logarithm in zip(names, logarithms, strict=True):
        holder, key = _table(settings, name)
        (inner if holder is settings.force_model else outer)[key] = math.exp(logarithm)
    force = settings.force_model.model_copy(update=inner)
    return settings.model_copy(update=outer | {"force_model": force})
