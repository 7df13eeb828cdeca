"""The place within the span: as sensors measure it, or counted from the speed."""

from __future__ import annotations

import numpy as np

from panto_env.base.errors import shown

from .lanes_law import Array, LanesLaw, Observations

PLACES = ("read", "counted")
"""Where the place within the span comes from."""


class SpanPlace:
    """Angle of the place within the span."""

    def __init__(self, place: str) -> None:
        """place: one of PLACES; raises ValueError for another."""
        if place not in PLACES:
            raise ValueError(f"place must be one of {', '.join(PLACES)}, not {shown(place)}")
        self._counts = place == "counted"

    def begin(self, lanes: int) -> None:
        """Begin to count for new episodes in this number of lanes."""
        self._counted = np.zeros(lanes)

    def angle(self, law: LanesLaw, observations: Observations) -> Array:
        """Angle, (lanes,), rad: 0 at a support, or counted from where the episode began.

        Raises InputError where it is to be read and the observation does not hold it.
        """
        if not self._counts:
            return law.span_angle(observations)
        way = law.read(observations, "speed") * law.context.control_interval
        self._counted = self._counted + 2 * np.pi * way / law.context.alignment.mean_length
        return self._counted
