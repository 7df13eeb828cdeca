"""The band of the excitation, and records limited to it by a linear-phase low-pass; the model's response.

Noise outside the band carries no information, but ruins derivatives and excites the model's resonance. The
same linear filter on all channels commutes with a linear model. Both ends are cut off, not padded.
"""

from __future__ import annotations

import numpy as np

from ..backend import kernel
from ..base.arrays import Array
from ..base.errors import InputError
from .model import HEAD, HEAD_SPEED, Parameters, matrices
from .record import Record, frequency_below

ATTENUATION = 60.0
"""Of noise above twice the band (dB)."""

POWER = 0.999
"""Share of the plate's motion that lies in the band."""

ROWS = 10
"""Independent samples that must be left."""


def excited_band(record: Record) -> float:
    """Highest frequency (Hz) of the plate's motion: below it lies 99.9 % of the power about the mean."""
    return frequency_below(record, POWER, first=1)


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
    too_short = (
        f"The record of {duration:.4g} s is too short for motion up to {band:.4g} Hz; record {{:.3g}} s or "
        "longer."
    )
    if band * duration < 1:
        raise InputError(too_short.format(1 / band))
    taps, shape = kaiserord(ATTENUATION, band / (rate / 2))
    taps |= 1  # odd: the delay is whole samples
    stride = max(1, int(rate / (3 * band)))  # noise is left to 1.5 of the band
    if len(record.plate) - taps + 1 < ROWS * stride:
        needed = (taps + ROWS * stride) * record.time_step
        raise InputError(too_short.format(needed))
    window = firwin(taps, 1.5 * band, window=("kaiser", shape), fs=rate)

    def smooth(values: Array) -> Array:
        mean = values.mean()
        return np.asarray(mean + oaconvolve(values - mean, window, mode="valid"))

    force = None if record.force is None else smooth(record.force)
    plate, head, support = map(smooth, record.displacements.values())
    start = record.start + taps // 2 * record.time_step
    return Record(record.time_step, plate, head, support, force, start), stride


@kernel
def recur(transition, gains, states):
    """x[k + 1] = transition x[k] + gains[k], in place; states[0] is given."""
    size = states.shape[1]
    for k in range(gains.shape[0]):
        for i in range(size):
            total = gains[k, i]
            for j in range(size):
                total += transition[i, j] * states[k, j]
            states[k + 1, i] = total


def polynomials(values: Array, time_step: float) -> Array:
    """Value and three derivatives at the start of each step, (n - 1, 4), of the cubic spline through samples.

    Input that is constant or linear between samples would spoil the small difference of plate and head as
    much as sampling ten times more slowly; a spline through a smooth motion is good to the fourth order.
    """
    from scipy.interpolate import CubicSpline  # slow to import

    coefficients = CubicSpline(time_step * np.arange(len(values)), values).c
    return np.ascontiguousarray(coefficients[::-1].T * np.array([1.0, 1.0, 2.0, 6.0]))


def respond(a: Array, b: Array, inputs: Array, time_step: float, initial: Array) -> Array:
    """States, (n, m), of x' = a x + b [u, u'], u given by ``polynomials``: exact but for rounding."""
    from scipy.linalg import expm  # slow to import

    size = len(a)
    block = np.zeros((size + 4, size + 4))
    block[:size, :size], block[:size, size : size + 2] = a, b
    block[range(size, size + 3), range(size + 1, size + 4)] = 1.0
    whole = expm(block * time_step)
    states = np.empty((len(inputs) + 1, size))
    states[0] = initial
    recur(whole[:size, :size].copy(), inputs @ whole[:size, size:].T, states)
    return states


def contact_force(parameters: Parameters, plate: Array, states: Array, time_step: float) -> Array:
    """Contact force (N), (n,), between a plate (m) and the pan head, as the model has it."""
    inputs = polynomials(plate, time_step)
    last = inputs[-1] @ np.array([0.0, 1.0, time_step, time_step**2 / 2])
    speed = np.append(inputs[:, 1], last)
    return np.asarray(
        parameters["k1T"] * (plate - states[:, HEAD]) + parameters["c1T"] * (speed - states[:, HEAD_SPEED])
    )


def force_matrices(parameters: Parameters) -> tuple[Array, Array]:
    """A, (5, 5), and B, (5, 2), under a contact force f: states [y_p2, y_p3, y_p2', y_p3', y_p1].

    The plate has no mass: c1T (y_p1' - y_p2') = f - k1T (y_p1 - y_p2). Raises InputError where c1T is
    not above 0: the plate is then without an equation of its own.
    """
    k1, c1 = parameters["k1T"], parameters["c1T"]
    if not c1 > 0:
        raise InputError(f"The contact force can drive the model only if c1T is above 0, not {c1:g}.")
    a, b = matrices(parameters)
    whole, gain = np.zeros((5, 5)), np.zeros((5, 2))
    rate = np.array([k1 / c1, 0.0, 1.0, 0.0, -k1 / c1])
    whole[:4, :4], whole[:4, 4] = a, b[:, 0]
    whole[:4] += np.outer(b[:, 1], rate)
    whole[4] = rate
    gain[:4, 0] = b[:, 1] / c1
    gain[4, 0] = 1 / c1
    return whole, gain


def fitted_response(
    a: Array, b: Array, driver: Array, time_step: float, shown: list[int], recorded: Array
) -> Array:
    """States, (n, m), of x' = a x + b [u, u'], started so that states ``shown`` best match ``recorded``.

    recorded: (n, len(shown)). Raises InputError where the model is not stable.
    """
    if np.linalg.eigvals(a).real.max() > 0:
        raise InputError("The model is not stable with these parameters: its motion grows by itself.")
    size = len(a)
    inputs = polynomials(driver, time_step)
    forced = respond(a, b, inputs, time_step, np.zeros(size))
    free = np.array([respond(a, b, 0 * inputs, time_step, unit) for unit in np.eye(size)])
    left = (recorded - forced[:, shown]).ravel()
    columns = free[:, :, shown].reshape(size, -1).T
    start = np.linalg.lstsq(columns, left, rcond=None)[0]
    return np.asarray(forced + np.tensordot(start, free, 1))
