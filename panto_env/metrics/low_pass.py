"""Butterworth low-passes of a force; by default EN 50317's of the contact force, of sixth order at 20 Hz.

EN 50317's filter delays the force by 31 ms, 2.6 m at 300 km/h: right for figures, not for pictures along a
line.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError

CUTOFF, ORDER = 20.0, 6
"""Hz, and the filter's order."""
MIRRORED = 1.0
"""Part of the record (s) that ``zero_phase_low_pass`` continues by mirroring at each end."""


@cache
def low_pass_sections(time_step: float, cutoff: float = CUTOFF, order: int = ORDER) -> tuple[Array, Array]:
    """A filter as second-order sections, (order / 2, 6), and its state settled at 1, (order / 2, 2).

    Every caller gets the same two arrays. Raises InputError where the samples, ``time_step`` (s) apart, do
    not resolve the cut-off frequency (Hz).
    """
    if not time_step < 0.5 / cutoff:
        raise InputError(
            f"Samples {1e3 * time_step:g} ms apart cannot be low-passed at {cutoff:g} Hz; "
            f"take a time step below {0.5e3 / cutoff:g} ms."
        )
    # Pairs of poles on a circle, by the bilinear transform that keeps the cut-off frequency. SciPy's own
    # design is the same except for the order of factors; its import would dominate the start-up time.
    angle = np.pi * (2 * np.arange(order // 2) + 1) / (2 * order)
    width, pole = np.tan(np.pi * cutoff * time_step), 2 * np.sin(angle)
    whole = 1 + pole * width + width**2
    b, one = width**2 / whole, np.ones(len(angle))
    a1, a2 = 2 * (width**2 - 1) / whole, (1 - pole * width + width**2) / whole
    sections = np.stack([b, 2 * b, b, one, a1, a2], axis=1)
    # Input and output of a settled section are 1: its state follows from the last equation upwards.
    settled = np.stack([3 * b - a1 - a2, b - a2], axis=1)
    return sections, settled


def low_pass(force: Array, time_step: float, cutoff: float = CUTOFF, order: int = ORDER) -> Array:
    """Force (N), (..., n), low-passed causally, settled at its first value; by default as EN 50317 says.

    Raises InputError where the samples, ``time_step`` (s) apart, are too far apart for the cut-off (Hz).
    """
    start = settled_at(force[..., 0], time_step, cutoff, order)
    return low_pass_from(start, force, time_step, cutoff, order)[0]


def settled_at(force: Array, time_step: float, cutoff: float = CUTOFF, order: int = ORDER) -> Array:
    """State, (order / 2, ..., 2), of a causal filter whose input (N), (...), has always been the same."""
    _, settled = low_pass_sections(time_step, cutoff, order)
    return np.moveaxis(np.multiply.outer(settled, force), 1, -1)


def low_pass_from(
    state: Array, force: Array, time_step: float, cutoff: float = CUTOFF, order: int = ORDER
) -> tuple[Array, Array]:
    """Force (N), (..., n), low-passed causally from a state of the filter, and the state after it.

    Both states are (order / 2, ..., 2). Raises InputError as ``low_pass`` does.
    """
    from scipy.signal import sosfilt  # slow to import

    sections, _ = low_pass_sections(time_step, cutoff, order)
    filtered, after = sosfilt(sections, force, zi=state)
    return np.asarray(filtered), np.asarray(after)


def zero_phase_low_pass(force: Array, time_step: float) -> Array:
    """Contact force (N), (..., n), with the attenuation of ``low_pass`` but without delay, by place.

    Its σ equals that of ``low_pass``; single peaks differ, because a causal filter also shifts phases.
    Raises InputError where the samples, ``time_step`` (s) apart, are too far apart.
    """
    from scipy.fft import irfft, next_fast_len, rfft  # slow to import

    count = force.shape[-1]
    beyond = min(count - 1, round(MIRRORED / time_step))
    more = next_fast_len(count + 2 * beyond, real=True) - count - 2 * beyond
    after = beyond + more if beyond + more < count else beyond
    around = [(0, 0)] * (force.ndim - 1) + [(beyond, after)]
    mirrored = np.pad(force, around, mode="reflect", reflect_type="odd")
    whole = mirrored.shape[-1]
    filtered = irfft(_attenuation(whole, time_step) * rfft(mirrored), whole)
    return np.asarray(filtered[..., beyond : beyond + count])


@lru_cache(maxsize=16)
def _attenuation(count: int, time_step: float) -> Array:
    """Magnitude of the filter's response at the frequencies of ``count`` samples."""
    from scipy.signal import freqz_sos  # slow to import

    sections, _ = low_pass_sections(time_step)
    _, response = freqz_sos(sections, worN=2 * np.pi * np.fft.rfftfreq(count))
    return np.asarray(np.abs(response))


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
