"""From the motion of a pantograph to the contact force, with what to think of it.

Noise intensities by maximum likelihood from healthy runs, not by hand.

The likelihood of a record is that of its innovations (F. C. Schweppe, IEEE Trans. Information Theory 11:61,
1965, recalled); the true force is not needed, so that a train in service can be tuned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, suggest
from ..base.settings import Between, ranges_of
from ..plant.pantograph.schema import PantographData
from .innovations import Consistency, Verdict, consistency, judge, log_likelihood
from .kalman import (
    Filtered,
    Gains,
    force_variance,
    run_filter,
    smooth_force,
    smoothed_variance,
    steady_gains,
    time_varying_gains,
)
from .model import EstimatorSettings, Model, build_model
from .motion import Motion
from .plausibility import check_motion

SETTLING = 1.0
"""Time (s) after which a record's start is forgotten; figures and tests are of what comes later."""


@dataclass(frozen=True)
class Estimate:
    """The contact force of n samples."""

    time: Array  # (n,): s
    force: Array  # (n,): estimated contact force (N)
    deviation: float  # rms error (N) by the model at the end, all frequencies; it knows of noise alone
    first: int  # number of the first sample after the start has been forgotten
    filtered: Filtered
    model: Model
    consistency: Consistency
    verdict: Verdict


def estimate(
    motion: Motion, pantograph: PantographData, settings: EstimatorSettings | None = None
) -> Estimate:
    """Contact force from a motion by a Kalman filter, or, with a lag, by a fixed-lag smoother.

    Raises InputError, with the likely mistake, for a motion that can't be a pantograph's, and for settings
    that need what it does not hold.
    """
    settings = EstimatorSettings() if settings is None else settings
    check_motion(motion, pantograph)
    model = model_of(motion, pantograph, settings)
    gains = gains_of(model, settings, len(motion.head))
    filtered = filter_motion(model, gains, motion)
    lag = round(settings.lag / motion.time_step)
    force = smooth_force(model, filtered, lag) if lag else filtered.state @ model.force
    variance = smoothed_variance(model, gains, lag) if lag else force_variance(model, gains)
    first = first_settled(motion)
    tested = consistency(filtered, motion.time, first)
    suspension_error = -float(filtered.state[-1, -1]) if settings.suspension_drift > 0 else 0.0
    return Estimate(
        time=motion.time,
        force=force,
        deviation=math.sqrt(max(variance, 0.0)),
        first=first,
        filtered=filtered,
        model=model,
        consistency=tested,
        verdict=judge(tested, suspension_error),
    )


def first_settled(motion: Motion) -> int:
    """Number of the first sample after a motion's start has been forgotten."""
    return math.ceil(SETTLING / motion.time_step)


def model_of(motion: Motion, pantograph: PantographData, settings: EstimatorSettings) -> Model:
    """The estimator's model for a motion. Raises InputError where the motion lacks what the settings need."""
    if settings.observation != "displacements" and motion.head_velocity is None:
        raise InputError("The motion has no velocities; take the observation 'displacements'.")
    process = settings.force_model.process(motion.speed, motion.span)
    return build_model(pantograph, process, settings, motion.time_step)


def gains_of(model: Model, settings: EstimatorSettings, samples: int) -> Gains:
    """Gains of the kind that the settings name. Raises InputError where there is no steady one."""
    return steady_gains(model) if settings.gain == "steady" else time_varying_gains(model, samples)


def filter_motion(model: Model, gains: Gains, motion: Motion) -> Filtered:
    """Filter a motion from its first sample on."""
    measured = motion.measured(len(model.observed))
    return run_filter(model, gains, measured, motion.inputs, model.start(measured[0], motion.lift))


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


BANDS = (2.0, 5.0, 20.0)
"""Highest frequencies (Hz) of the bands 0-2, 0-5 and 0-20 Hz."""
ORDER = 4
"""Of the Butterworth low-pass that cuts a band out, run forward and backward, so that it delays nothing."""
MAXIMUM_DELAY = 0.1
"""Either way, that is looked for (s)."""
COHERENT = 0.5
"""Minimum coherence of a frequency whose phase counts for the delay."""


@dataclass(frozen=True)
class Score:
    """Of an estimate in a band from 0 Hz."""

    band: float  # its highest frequency (Hz)
    bias: float  # mean of estimate less truth (N)
    rms: float  # of estimate less truth without that mean (N)
    correlation: float  # -1..1, as they stand, delay included
    delay: float  # at which their cross-correlation is maximal (s); positive: the estimate is late
    whole_rms: float  # as rms, at all frequencies: noise and what is lost beyond the band count too (N)
    phase_delay: float  # mean over the band's coherent frequencies, by power (s); nan: none is coherent


def score(true: Array, estimated: Array, time_step: float, band: float, ends: float = 1.0) -> Score:
    """Compare two records of a force (N), (n,), in 0 to ``band`` (Hz); ``ends`` (s) are left out at each end.

    Raises InputError where they are too short, or too coarse for the band.
    """
    left_out = round(ends / time_step)
    if len(true) < 2 * left_out + round(4 / (band * time_step)) or not band < 0.5 / time_step:
        raise InputError(
            f"{len(true)} samples {1e3 * time_step:g} ms apart are too short or too coarse a record for "
            f"0 to {band:g} Hz; give a longer one, sampled more often."
        )
    inner = slice(left_out, len(true) - left_out)
    a, b = (_in_band(values, band, time_step) for values in (true, estimated))
    delay = _delay(a, b, time_step, left_out)
    a, b = a[inner], b[inner]
    error = b - a
    return Score(
        band=band,
        bias=float(error.mean()),
        rms=float(error.std()),
        correlation=float(np.corrcoef(a, b)[0, 1]),
        delay=delay,
        whole_rms=float((estimated - true)[inner].std()),
        phase_delay=_phase_delay(true[inner], estimated[inner], time_step, band, delay),
    )


class Phases(NamedTuple):
    """Estimate against truth at each frequency above 0, (k,)."""

    frequency: Array  # Hz
    delay: Array  # by phase, but for whole periods; positive: the estimate is late (s)
    coherence: Array  # 0..1
    weight: Array  # size of the cross-spectrum


def phases(true: Array, estimated: Array, time_step: float, about: float = 0.0) -> Phases:
    """Delay over frequency by the phase of the cross-spectrum (Welch's, of pieces of 2 s at most).

    about: a delay (s) by which the estimate is moved before: the pieces of both then hold the same, without
    which Welch's phases are some per cent too small.
    """
    from scipy.signal import csd, welch  # slow to import

    moved = round(about / time_step)
    kept = len(true) - abs(moved)
    a = true[max(0, -moved) :][:kept]
    b = estimated[max(0, moved) :][:kept]
    a, b = (values - values.mean() for values in (a, b))
    piece = {"fs": 1 / time_step, "nperseg": min(round(2 / time_step), len(a) // 2)}
    frequency, cross = csd(a, b, **piece)
    powers = welch(a, **piece)[1] * welch(b, **piece)[1]
    coherence = np.abs(cross) ** 2 / np.where(powers > 0, powers, np.inf)
    delay = moved * time_step - np.angle(cross[1:]) / (2 * np.pi * frequency[1:])
    return Phases(frequency[1:], delay, coherence[1:], np.abs(cross[1:]))


def _in_band(values: Array, band: float, time_step: float) -> Array:
    from scipy.signal import butter, sosfiltfilt  # slow to import

    return np.asarray(sosfiltfilt(butter(ORDER // 2, band, fs=1 / time_step, output="sos"), values))


def _delay(true: Array, estimated: Array, time_step: float, left_out: int) -> float:
    """Shift (s) of the estimate at which the two resemble each other most, between samples by a parabola."""
    most = min(round(MAXIMUM_DELAY / time_step), left_out)
    inner = slice(left_out, len(true) - left_out)
    shifts = np.arange(-most, most + 1)
    like = [
        np.corrcoef(true[inner], estimated[left_out + shift : len(true) - left_out + shift])[0, 1]
        for shift in shifts
    ]
    best = int(np.argmax(like))
    if best in (0, len(like) - 1):
        return float("nan")
    before, at, after = like[best - 1 : best + 2]
    return float((shifts[best] + (before - after) / (2 * (before - 2 * at + after))) * time_step)


def _phase_delay(true: Array, estimated: Array, time_step: float, band: float, about: float) -> float:
    found = phases(true, estimated, time_step, about if np.isfinite(about) else 0.0)
    used = (found.frequency <= band) & (found.coherence >= COHERENT)
    if not used.any():
        return float("nan")
    return float(np.average(found.delay[used], weights=found.weight[used]))
