"""Values by speed, each computed when it is first needed, and interpolated between speeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..base.arrays import Array, to_kmh


class BySpeed:
    """A row of values for each of some speeds, which takes a run or several to compute."""

    def __init__(
        self, speeds: tuple[float, float], distance: float, compute: Callable[[float], Sequence[float]]
    ) -> None:
        """speeds: range (m/s). distance: between speeds, at most (km/h). compute: a row by speed (m/s)."""
        low, high = speeds
        count = 1 if low == high else 2 + int(to_kmh(high - low) / distance)
        self.speeds = np.linspace(low, high, count)  # (speeds,): rising (m/s)
        self._compute = compute
        self._rows: dict[int, Array] = {}

    def column(self, number: int, speed: Any = None) -> Array:
        """A value at all speeds, (speeds,), or those that interpolation at ``speed`` needs; others are 0.

        speed: m/s, a number or an array. Raises InputError where a run leaves the valid range.
        """
        column = np.zeros(len(self.speeds))
        for place in range(len(column)) if speed is None else self._around(speed):
            if place not in self._rows:
                self._rows[place] = np.asarray(self._compute(float(self.speeds[place])))
            column[place] = self._rows[place][number]
        return column

    def at(self, speed: Any, number: int) -> Any:
        """A value at a speed (m/s), or at each of an array. Raises InputError as ``column`` does."""
        return np.interp(speed, self.speeds, self.column(number, speed))

    def _around(self, speed: Any) -> Iterable[int]:
        """Places of the speeds below and above each one."""
        above = np.minimum(np.atleast_1d(np.searchsorted(self.speeds, speed)), len(self.speeds) - 1)
        return sorted({max(0, place - below) for place in above.tolist() for below in (0, 1)})
