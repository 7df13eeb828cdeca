"""The contact force that a diagnosis is made from."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..metrics.low_pass import CUTOFF, low_pass_in_place
from ..metrics.trajectory import Trajectory

ERROR = 3.0
"""Rms error (N) of an estimated force within 0 to 20 Hz, own choice: half as much again as the 2 N of a
measured one (seen)."""
PADDED = 1.0
"""Time (s) of noise that is drawn beyond either end of a run."""


def estimated_force(run: Trajectory, random: np.random.Generator, error: float = ERROR) -> Array:
    """Contact force (N), (n,), of a run's samples as an estimator with a smoother would give it.

    A stand-in for the estimator: the true force, low-passed at 20 Hz without delay, with noise of this rms
    (N) in the same band. Only this function knows.
    """
    pad = round(PADDED / run.time_step)
    spectrum = np.fft.rfft(random.standard_normal(len(run.time) + 2 * pad))
    frequency = np.fft.rfftfreq(len(run.time) + 2 * pad, run.time_step)
    spectrum[frequency > CUTOFF] = 0.0
    noise = np.fft.irfft(spectrum, len(run.time) + 2 * pad)
    noise *= error / noise.std()
    return low_pass_in_place(run.contact_force, run.time_step) + noise[pad : len(noise) - pad]
