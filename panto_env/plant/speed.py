"""Speed of a train: a slow drift about its mean, a profile that it follows, and its position at any time.

The drift is a sum of sines with equal acceleration amplitudes, so that the slow ones change the speed most;
its phases are drawn per run. Between the points of a profile the acceleration is constant. The distance is
the integral of both, in closed form. The aerodynamic force on a pantograph is that of the speed at each time
step.
"""

from __future__ import annotations

import math

import numpy as np

from ..backend import inlined
from ..base.arrays import Array
from .functions import cosine_of_turns, sine_of_turns

PERIODS = (7.0, 13.0, 29.0)
"""Periods of the sines (s), own choice: between a driver's actions and gradients. None is a multiple of
another."""
DRIFT_ROWS = 1 + 3 * len(PERIODS)
"""Entries of a lane's drift: offset at step 0 (m); then for each sine amplitude (m), turns per step, phase
(turns)."""
_TURN = 2 * math.pi


def speeds_of(rms: float) -> Array:
    """Amplitude of each sine, in the unit of the whole drift's rms."""
    periods = np.array(PERIODS)
    return np.asarray(rms * periods / np.sqrt(0.5 * np.sum(periods**2)))


def largest_drift(rms: float) -> float:
    """Maximum difference from the mean speed, in the unit of its rms."""
    return float(np.sum(speeds_of(rms)))


def largest_lag(rms: float) -> float:
    """Maximum distance by which a train lags, or leads, a steady one in a run (m); rms: m/s."""
    return float(np.sum(2 * speeds_of(rms) * np.array(PERIODS)) / _TURN)


def draw_drift(rms: float, time_step: float, random: np.random.Generator) -> Array:
    """Draw a lane's drift, (DRIFT_ROWS,); rms: m/s; time_step: s."""
    phases = random.uniform(0, 1, len(PERIODS))
    amplitudes = speeds_of(rms) * np.array(PERIODS) / _TURN
    waves = np.stack([amplitudes, time_step / np.array(PERIODS), phases], axis=1)
    return np.append(-np.sum(amplitudes * np.sin(_TURN * phases)), waves)


def ahead(drift: Array, steps: Array) -> Array:
    """Lead of trains over steady ones (m), (lanes, n), after numbers of steps, (lanes, n).

    drift: (lanes, DRIFT_ROWS), or (lanes, 0) for steady trains.
    """
    way = np.zeros((len(drift), np.shape(steps)[-1]))
    if drift.shape[1]:
        way += drift[:, :1]
    for k in range(1, drift.shape[1], 3):
        amplitude, turns, phase = drift[:, k : k + 3].T[:, :, None]
        way += amplitude * np.sin(_TURN * (turns * steps + phase))
    return way


def gain(drift: Array, steps: float) -> Array:
    """Distance by which trains cover more than the mean in a step (m), (lanes,), after a number of steps.

    drift: as in ``ahead``.
    """
    amplitude, turns, phase = np.moveaxis(drift[:, 1:].reshape(len(drift), -1, 3), 2, 0)
    return np.asarray(np.sum(_TURN * amplitude * turns * np.cos(_TURN * (turns * steps + phase)), axis=1))


@inlined
def drifted_way(drift, way, steps):
    """Distance (m) after a number of steps of a lane whose speed drifts; way: at its mean speed (m)."""
    way += drift[0]
    for k in range(1, drift.size, 3):
        way += drift[k] * sine_of_turns(drift[k + 1] * steps + drift[k + 2])
    return way


@inlined
def drifting_stride(drift, stride, steps):
    """Distance covered in a step (m), by the speed after a number of steps; stride: its mean (m)."""
    for k in range(1, drift.size, 3):
        turns = drift[k + 1] * steps + drift[k + 2]
        stride += _TURN * drift[k] * drift[k + 1] * cosine_of_turns(turns)
    return stride
