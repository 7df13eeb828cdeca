"""A record of the rig: what its sensors saw, at equal time steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array

SHORTEST = 20
"""Samples that a record must have at least; a method that needs more raises its own error."""


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
