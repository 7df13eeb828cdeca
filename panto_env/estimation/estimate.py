"""From the motion of a pantograph to the contact force: filtered, judged, scored, drawn.

Noise intensities are found by maximum likelihood from healthy runs: that of a record is that of its
innovations (F. C. Schweppe, IEEE Trans. Information Theory 11:61, 1965, recalled), so the true force is not
needed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, suggest
from ..base.plotting import BLUE, LIMIT, ORANGE, legend_above, stacked
from ..base.settings import ranges_of
from ..metrics.low_pass import zero_phase_low_pass
from ..plant.pantograph.schema import PantographData
from .innovations import Consistency, Verdict, consistency, judge, log_likelihood, window_bound
from .kalman import (
    Filtered,
    Gains,
    force_variance,
    run_filter,
    smooth_force,
    steady_gains,
    time_varying_gains,
)
from .model import EstimatorSettings, Model, build_model
from .motion import Motion, check_motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    settings = settings or EstimatorSettings()
    check_motion(motion, pantograph)
    model = model_of(motion, pantograph, settings)
    steady = settings.gain == "steady"
    gains = steady_gains(model) if steady else time_varying_gains(model, len(motion.head))
    filtered = filter_motion(model, gains, motion)
    lag = round(settings.lag / motion.time_step)
    force = smooth_force(model, filtered, lag) if lag else filtered.state @ model.force
    first = first_settled(motion)
    tested = consistency(filtered, motion.time, first)
    suspension_error = -float(filtered.state[-1, -1]) if settings.suspension_drift > 0 else 0.0
    return Estimate(
        time=motion.time,
        force=force,
        deviation=math.sqrt(max(force_variance(model, gains, lag), 0.0)),
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
    known = {
        prefix + key: next(ranges_of(field.rebuild_annotation()), None)
        for prefix, holder in (("", settings), ("force_model.", settings.force_model))
        for key, field in type(holder).model_fields.items()
    }
    ranges = {name: between for name, between in known.items() if between is not None}
    for name in names:
        if name not in ranges:
            raise InputError(f"Unknown value '{name}' to tune: {suggest(name, list(ranges))}.")
    first = {name: attrgetter(name)(settings) for name in names}
    for name, value in first.items():
        if value <= 0:
            raise InputError(f"'{name}' is {value:g}, which can't be tuned; begin with a value above 0.")
    lows = [max(ranges[name].low, 1e-6 * ranges[name].high) for name in names]
    bounds = [(math.log(low), math.log(ranges[name].high)) for low, name in zip(lows, names, strict=True)]
    begin = np.array([math.log(value) for value in first.values()])
    samples = sum(len(motion.head) - first_settled(motion) for motion in motions)

    def settings_of(logarithms: Array) -> EstimatorSettings:
        of_force, outer = dict[str, Any](), dict[str, Any]()
        for name, value in zip(names, map(math.exp, logarithms), strict=True):
            (of_force if "." in name else outer)[name.removeprefix("force_model.")] = value
        return settings.model_copy(
            update={"force_model": settings.force_model.model_copy(update=of_force)} | outer
        )

    def cost(logarithms: Array) -> float:
        tried, total = settings_of(logarithms), 0.0
        for motion in motions:
            model = model_of(motion, pantograph, tried)
            filtered = filter_motion(model, steady_gains(model), motion)
            total += log_likelihood(filtered, first_settled(motion))
        return -total / samples

    before = -cost(begin)
    options = {"xatol": FINE, "fatol": ALIKE, "maxfev": MOST_EVALUATIONS}
    found = minimize(cost, begin, method="Nelder-Mead", bounds=bounds, options=options)
    if not found.success:
        raise InputError(
            f"The search for the most likely settings does not end ({found.message}); name fewer."
        )
    tuned = settings_of(found.x)
    ends = zip(names, found.x, bounds, strict=True)
    return Tuning(
        settings=tuned,
        values={name: attrgetter(name)(tuned) for name in names},
        log_likelihood=-float(found.fun),
        before=before,
        at_bounds=tuple(name for name, x, (low, high) in ends if min(x - low, high - x) < FINE),
    )


BANDS = (2.0, 5.0, 20.0)
"""Highest frequencies (Hz) of the bands 0-2, 0-5 and 0-20 Hz."""
ORDER = 4
"""Of the Butterworth low-pass that cuts a band out, run forward and backward, so that it delays nothing."""
ENDS = 1.0
"""Time (s) at each end of a record that is not scored."""
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


def score(true: Array, estimated: Array, time_step: float, band: float) -> Score:
    """Compare two records of a force (N), (n,), in 0 to ``band`` (Hz), without ``ENDS`` at each end.

    Raises InputError where they are too short, or too coarse for the band.
    """
    from scipy.signal import butter, sosfiltfilt  # slow to import

    left_out = round(ENDS / time_step)
    if len(true) < 2 * left_out + round(4 / (band * time_step)) or not band < 0.5 / time_step:
        raise InputError(
            f"{len(true)} samples {1e3 * time_step:g} ms apart are too short or too coarse a record for "
            f"0 to {band:g} Hz; give a longer one, sampled more often."
        )
    inner = slice(left_out, len(true) - left_out)
    low_pass = butter(ORDER // 2, band, fs=1 / time_step, output="sos")
    a, b = (np.asarray(sosfiltfilt(low_pass, values)) for values in (true, estimated))
    delay = _delay(a, b, time_step, left_out)
    a, b = a[inner], b[inner]
    error = b - a
    found = phases(true[inner], estimated[inner], time_step, delay if np.isfinite(delay) else 0.0)
    used = (found.frequency <= band) & (found.coherence >= COHERENT)
    late = np.average(found.delay[used], weights=found.weight[used]) if used.any() else np.nan
    return Score(
        band=band,
        bias=float(error.mean()),
        rms=float(error.std()),
        correlation=float(np.corrcoef(a, b)[0, 1]),
        delay=delay,
        whole_rms=float((estimated - true)[inner].std()),
        phase_delay=float(late),
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
    a, b = true[max(0, -moved) :][:kept], estimated[max(0, moved) :][:kept]
    a, b = (values - values.mean() for values in (a, b))
    piece = {"fs": 1 / time_step, "nperseg": min(round(2 / time_step), len(a) // 2)}
    frequency, cross = csd(a, b, **piece)
    powers = welch(a, **piece)[1] * welch(b, **piece)[1]
    coherence = np.abs(cross) ** 2 / np.where(powers > 0, powers, np.inf)
    delay = moved * time_step - np.angle(cross[1:]) / (2 * np.pi * frequency[1:])
    return Phases(frequency[1:], delay, coherence[1:], np.abs(cross[1:]))


def _delay(true: Array, estimated: Array, time_step: float, left_out: int) -> float:
    most = min(round(MAXIMUM_DELAY / time_step), left_out)
    begin, end = left_out, len(true) - left_out
    shifts = range(-most, most + 1)
    like = [np.corrcoef(true[begin:end], estimated[begin + k : end + k])[0, 1] for k in shifts]
    best = int(np.argmax(like))
    if best in (0, len(like) - 1):
        return float("nan")
    before, at, after = like[best - 1 : best + 2]
    return float((shifts[best] + (before - after) / (2 * (before - 2 * at + after))) * time_step)


SHOWN = 10.0
"""Seconds drawn of a record at most, from when its start has been forgotten."""


def plot_estimate(estimate: Estimate, title: str, measured: Array | None = None) -> Figure:
    """Estimated contact force, low-passed at 20 Hz in place, and the size of innovations, of at most 10 s.

    measured: contact force of the record (N), (n,), drawn beside it.
    """
    figure, (force, innovations) = stacked((10, 6), 2, height_ratios=(3, 1))
    begin = estimate.time[estimate.first]
    end = min(begin + SHOWN, estimate.time[-1])
    shown = (estimate.time >= begin) & (estimate.time <= end)
    step = float(estimate.time[1] - estimate.time[0])
    recorded = [] if measured is None else [(measured, ORANGE, 3, "recorded")]
    for values, colour, width, words in (*recorded, (estimate.force, "black", 1, "estimated")):
        drawn = zero_phase_low_pass(values, step)[shown]
        force.plot(estimate.time[shown], drawn, color=colour, linewidth=width, label=words)
    force.set(ylabel="contact force, 0 to 20 Hz (N)", xlim=(begin, end))
    legend_above(force, 2)
    tested = estimate.consistency
    innovations.plot(tested.window_time, tested.window_nis, "o-", color=BLUE, markersize=3, label="found")
    innovations.axhline(1.0, color="0.4", linestyle=":", label="expected")
    bound = window_bound(tested.nis)
    innovations.axhline(bound, color=LIMIT, linestyle="--", linewidth=0.9, label="doubted above")
    rest = f"; the record ends at {estimate.time[-1]:.4g} s" if end < estimate.time[-1] else ""
    innovations.set(xlabel=f"time (s){rest}", ylabel="squared\ninnovations (-)")
    legend_above(innovations)
    for axis in (force, innovations):
        axis.grid(color="0.9")
    figure.suptitle(title, fontsize="medium", x=0.01, ha="left")
    return figure
