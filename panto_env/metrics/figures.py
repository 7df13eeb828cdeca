"""Figures of merit of a contact force: CF and CL (paper 1), EN 50317 and EN 50367."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError

CUTOFF = 20.0
"""Low-pass of the contact force (Hz), EN 50317."""


@dataclass(frozen=True)
class Figures:
    """One run's figures; force statistics are of the filtered force, losses of the raw one."""

    mean: float  # F_m (N)
    std: float  # sigma (N)
    statistical_max: float  # F_m + 3 sigma (N)
    statistical_min: float  # F_m - 3 sigma (N)
    max: float  # actual maximum (N)
    min: float  # actual minimum (N)
    max_uplift: float  # of the contact wire at the supports (m); nan where the line has none
    contact_loss: float  # CL, Eq. 13 of paper 1 (%)
    cost_function: float  # CF, Eq. 14 of paper 1 (N m)
    effort: float  # rms actuator force (N)
    effort_rate: float  # rms rate of the actuator force (N/s)
    distance: float  # that the figures cover (m)

    def as_dict(self) -> dict[str, float]:
        """Names and values, in this order."""
        return dict(vars(self))


@cache
def low_pass_sections(time_step: float) -> tuple[Array, Array]:
    """EN 50317's filter, a 6th-order Butterworth at 20 Hz, as second-order sections, (3, 6).

    The second array, (3, 2), is its state settled at 1; all who ask share both. Raises InputError where
    samples, ``time_step`` (s) apart, are too far apart to hold 20 Hz.
    """
    from scipy.signal import butter, sosfilt_zi  # slow to import

    if not time_step < 0.5 / CUTOFF:
        raise InputError(
            f"Samples {1e3 * time_step:g} ms apart cannot be low-passed at {CUTOFF:g} Hz; "
            f"take a time step below {0.5e3 / CUTOFF:g} ms."
        )
    sections = butter(6, CUTOFF, fs=1 / time_step, output="sos")
    return sections, sosfilt_zi(sections)


def low_pass(force: Array, time_step: float) -> Array:
    """Contact force (N) as EN 50317 looks at it: low-passed causally, settled at its first value.

    Raises InputError where the samples, ``time_step`` (s) apart, are too far apart.
    """
    from scipy.signal import sosfilt  # slow to import

    sections, settled = low_pass_sections(time_step)
    filtered, _ = sosfilt(sections, force, zi=settled * force[0])
    return np.asarray(filtered)


def cost_function(force: Array, nominal_force: float, stride: float) -> float:
    """CF (N m), Eq. 14 of paper 1: |F - F_N| over the distance, by trapezoids.

    stride: distance between samples (m), which is v/3.6 times the time step.
    """
    deviation = np.abs(force - nominal_force)
    return float(stride / 2 * (deviation[:-1] + deviation[1:]).sum())


def contact_loss(force: Array) -> float:
    """CL (%), Eq. 13 of paper 1: share of the distance without contact."""
    return float(100 * np.mean(force <= 0))


def en50367_mean_limit(speed: float) -> float:
    """Largest mean force (N) of EN 50367 for AC lines above 200 km/h; speed in m/s."""
    return 0.00097 * (3.6 * speed) ** 2 + 70


def en50367_checks(figures: Figures, speed: float) -> dict[str, bool]:
    """Whether each limit of EN 50367 (as recalled) is kept; speed in m/s."""
    fast = 3.6 * speed > 200
    loss = 0.2 if 3.6 * speed > 250 else 0.1
    return {
        "mean": figures.mean <= en50367_mean_limit(speed),
        "std": figures.std <= 0.3 * figures.mean,
        "max": figures.max <= (350 if fast else 300),
        "contact_loss": figures.contact_loss <= loss,
    }
