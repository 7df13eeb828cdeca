"""How good an estimated contact force is against the true one: error, correlation, and delay in two ways."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError

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
