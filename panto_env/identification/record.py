"""A record of the rig: what its sensors saw, at equal time steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError

SHORTEST = 20
"""Samples that a record must have at least; a method that needs more raises its own error."""

JITTER = 0.05
"""How far a time stamp may lie from equal steps, as a share of the step: more is no rounding of digits."""


@dataclass(frozen=True)
class Record:
    """n samples at equal steps; displacements are counted from where the unloaded pantograph rests."""

    time_step: float  # s
    plate: Array  # (n,): y_p1 of the contact plate (m)
    head: Array  # (n,): y_p2 of the pan head (m)
    support: Array  # (n,): y_p3 of the support, the articulated frame (m)
    force: Array | None = None  # (n,): contact force f_1 (N)
    start: float = 0.0  # time of the first sample (s)

    @property
    def time(self) -> Array:
        """(n,): s."""
        return self.start + self.time_step * np.arange(len(self.plate))


def equal_step(time: Array) -> float:
    """Time step (s) of time stamps (s). Raises InputError where they do not increase in equal steps."""
    if len(time) < SHORTEST:
        raise InputError(
            f"The record has {len(time)} samples, too few to identify anything; give {SHORTEST} or more."
        )
    steps = np.diff(time)
    if (steps <= 0).any():
        place = int(np.argmax(steps <= 0)) + 2
        raise InputError(
            f"Time does not increase at sample {place}; sort the record and drop doubled samples."
        )
    step = float((time[-1] - time[0]) / (len(time) - 1))
    away = np.abs(time - (time[0] + step * np.arange(len(time))))
    if away.max() > JITTER * step:
        raise InputError(
            f"Time steps are not equal (they run from {steps.min():.6g} to {steps.max():.6g} s); "
            "resample the record to equal steps, or write the time with more digits."
        )
    return step
