"""Spectrum of a record: its part in a frequency band, and the amplitudes of its harmonics."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array


def band_rms(values: Array, time_step: float, lowest: float, highest: float) -> float:
    """Rms of the part above ``lowest`` and up to ``highest`` (Hz), in the unit of the values, (n,)."""
    parts = np.abs(np.fft.rfft(values)) / len(values)
    frequencies = np.fft.rfftfreq(len(values), time_step)
    return float(np.sqrt(2 * np.sum(parts[(frequencies > lowest) & (frequencies <= highest)] ** 2)))


def in_band(values: Array, time_step: float, lowest: float, highest: float) -> Array:
    """Part of the values above ``lowest`` and up to ``highest`` (Hz), (n,)."""
    parts, frequencies = np.fft.rfft(values), np.fft.rfftfreq(len(values), time_step)
    parts[(frequencies <= lowest) | (frequencies > highest)] = 0.0
    return np.asarray(np.fft.irfft(parts, len(values)))


def amplitudes(values: Array, time_step: float) -> tuple[Array, Array]:
    """Frequencies (Hz) and amplitudes with a Hann window: a peak has the amplitude of its harmonic."""
    window = np.hanning(len(values))
    parts = np.abs(np.fft.rfft(window * (values - values.mean()))) * 2 / window.sum()
    return np.fft.rfftfreq(len(values), time_step), parts
