"""Contact-force figures as EN 50317 / EN 50318 define them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from .hermite import Array


class Run(Protocol):
    """What the figures need of a run."""

    time: Array
    position: Array
    contact_force: Array
    support_uplift: Array


@dataclass(frozen=True)
class Figures:
    """Forces (N) low-passed at 20 Hz; loss (%) of the raw force; uplift (mm) of the whole run."""

    mean: float
    std: float
    maximum: float
    minimum: float
    statistical_maximum: float
    statistical_minimum: float
    uplift_mm: float
    loss_percent: float


def low_passed(force: Array, time_step: float, cutoff: float = 20.0) -> Array:
    """Causal sixth-order Butterworth (Hz), started in steady state at the first value."""
    sections = butter(6, cutoff, fs=1 / time_step, output="sos")
    return sosfilt(sections, force, zi=sosfilt_zi(sections) * force[0])[0]


def figures(result: Run, span_length: float, spans: tuple[int, int] = (5, 6)) -> Figures:
    """Figures over spans first..last; span n lies from (n - 1) to n span lengths (m)."""
    first, last = spans
    force = low_passed(result.contact_force, float(result.time[1] - result.time[0]))
    inside = (result.position >= (first - 1) * span_length) & (result.position <= last * span_length)
    # Column j of support_uplift is the support at (j + 1) spans; line ends have none.
    uplift = result.support_uplift[:, max(first - 2, 0) : last]
    mean, std = float(force[inside].mean()), float(force[inside].std())
    return Figures(
        mean=mean,
        std=std,
        maximum=float(force[inside].max()),
        minimum=float(force[inside].min()),
        statistical_maximum=mean + 3 * std,
        statistical_minimum=mean - 3 * std,
        uplift_mm=1e3 * float(uplift.max()),
        loss_percent=100 * float(np.mean(result.contact_force[inside] <= 0)),
    )
