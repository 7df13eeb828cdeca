"""Figures of merit of a run: statistics of the contact force, and CF and CL of paper 1."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array

ARC = 5e-3
"""Maximum duration (s) of a contact loss that does not count as an arc."""


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
    distance: float  # distance that the figures cover (m)

    @classmethod
    def none(cls) -> Self:
        """Figures of a run that has none because it ended early: all nan."""
        return cls(*[float("nan")] * len(fields(cls)))

    def as_dict(self) -> dict[str, float]:
        """Values by name, in the order of the fields."""
        return dict(vars(self))


def cost_function(force: Array, nominal_force: float | Array, stride: float | Array) -> float:
    """CF (N m), Eq. 14 of paper 1: |F - F_N| over the distance, by trapezoids.

    nominal_force: F_N (N), or (n,) where it follows a speed that drifts. stride: distance between samples
    (m), the speed times the time step, or (n - 1,) where the speed drifts.
    """
    deviation = np.abs(force - nominal_force)
    pairs, half = deviation[:-1] + deviation[1:], stride / 2
    return float(half * pairs.sum() if np.ndim(stride) == 0 else np.sum(half * pairs))


def contact_loss(force: Array) -> float:
    """CL (%), Eq. 13 of paper 1: share of the distance without contact.

    Samples are equally spaced in time, and so in distance, in spans of any length. Where the speed drifts it
    is the share of the time, whose ratio to that of the distance differs from 1 by at most the drift over the
    speed: 3 % of CL for a drift of 10 km/h at 300 km/h.
    """
    return float(100 * np.mean(force <= 0))


def losses_of_contact(force: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first sample of each loss of contact and the first one after it, (losses,) each; force: (n,), N."""
    edges = np.diff(np.concatenate([[0], (force <= 0).astype(int), [0]]))
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def arcing(force: Array, time_step: float) -> float:
    """NQ (%): share of time in contact losses longer than ``ARC``, at the resolution of the time step.

    The current is assumed to flow all the time. CL, in contrast, counts contact losses of any length.
    """
    begins, ends = losses_of_contact(force)
    steps = ends - begins
    return float(100 * steps[steps * time_step > ARC + 1e-9].sum() / len(force))
