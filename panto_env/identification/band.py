"""The band of the excitation, and a record limited to it by a linear-phase low-pass.

The low-pass is the same for all sensors, so that the filtered record still obeys the equations of motion.

Noise outside the band of the excitation carries no information, but ruins derivatives (and excites the
model's own resonance). A linear filter commutes with a linear model, so the same filter on every channel
changes nothing else. Both ends are cut off, not padded.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .record import Record

ATTENUATION = 60.0
"""Of noise above twice the band (dB)."""

POWER = 0.999
"""Share of the plate's motion that lies in the band."""

ROWS = 10
"""Independent samples that must be left."""


def excited_band(record: Record) -> float:
    """Highest frequency (Hz) of the plate's motion: below it lies 99.9 % of the power about the mean."""
    plate = (record.plate - record.plate.mean()) * np.hanning(len(record.plate))
    power = np.cumsum(np.abs(np.fft.rfft(plate)) ** 2)
    place = int(np.searchsorted(power, POWER * power[-1]))
    return float(np.fft.rfftfreq(len(plate), record.time_step)[max(place, 1)])


def band_limited(record: Record, band: float) -> tuple[Record, int]:
    """The record below ``band`` (Hz), its ends cut off, and how many samples apart noise is independent.

    Passes to ``band``, stops above twice of it. Raises InputError where the record is too short for
    this, or sampled too slowly.
    """
    from scipy.signal import firwin, kaiserord, oaconvolve  # slow to import

    rate = 1 / record.time_step
    if not 0 < 4 * band <= rate:
        raise InputError(
            f"A band to {band:.4g} Hz does not fit a record sampled at {rate:.4g} Hz; it must lie above 0 "
            "and below a quarter of the sampling rate (is the record mostly noise?)."
        )
    duration = len(record.plate) * record.time_step
    if band * duration < 1:
        raise InputError(
            f"The record of {duration:.4g} s is too short for motion up to {band:.4g} Hz; record "
            f"{1 / band:.3g} s or longer."
        )
    taps, shape = kaiserord(ATTENUATION, band / (rate / 2))
    taps |= 1  # odd: the delay is whole samples
    stride = max(1, int(rate / (3 * band)))  # noise is left to 1.5 of the band
    left = len(record.plate) - taps + 1
    if left < ROWS * stride:
        needed = (taps + ROWS * stride) * record.time_step
        raise InputError(
            f"The record of {len(record.plate) * record.time_step:.4g} s is too short for motion up to "
            f"{band:.4g} Hz; record {needed:.3g} s or longer."
        )
    window = firwin(taps, 1.5 * band, window=("kaiser", shape), fs=rate)

    def smooth(values: Array) -> Array:
        mean = values.mean()
        return np.asarray(mean + oaconvolve(values - mean, window, mode="valid"))

    half = taps // 2
    return Record(
        record.time_step,
        smooth(record.plate),
        smooth(record.head),
        smooth(record.support),
        None if record.force is None else smooth(record.force),
        record.start + half * record.time_step,
    ), stride
