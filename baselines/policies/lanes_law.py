"""Bases of controllers that return the forces of many lanes at once: a tuner runs them in batches."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError, shown
from panto_env.control.context import Context

from .gains import Source, find_gains

Array = NDArray[np.float64]
Observations = NDArray[np.float32]


class LanesLaw(ABC):
    """A controller that returns one force (N) per lane, positive upwards; a single run is a batch of one.

    All lanes are on the same line at the same speed. The force acts on the articulated frame; with actuators
    on frame and head, that on the head stays at 0; with an actuator on the head only, the same law drives
    that one, between head and the mass below it.
    """

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        self.context, self.lanes = context, lanes
        self._places = {entry.name: place for place, entry in enumerate(context.layout.entries)}

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self.begin(context, 1)

    def act(self, observation: Observations) -> Array:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        action = np.zeros(self.context.actions)
        action[0] = min(max(float(self.forces(observation[None])[0]) / self.context.force_limit, -1.0), 1.0)
        return action

    @abstractmethod
    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""

    def read(self, observations: Observations, name: str) -> Array:
        """Physical values of an entry, (lanes,). Raises InputError if no entry has this name."""
        layout = self.context.layout
        place = self._places.get(name)
        if place is None or layout.entries[place].slope:  # another kind, normalised, or an error
            return np.array([layout.read(each, name) for each in observations])
        entry = layout.entries[place]
        return entry.centre + observations[:, place].astype(float) * entry.scale

    def span_angle(self, observations: Observations, lead: float = 0.0) -> Array:
        """Angle of the place within the span, (lanes,), rad, 0 at a support; lead: time ahead (s).

        Raises InputError if the observation does not hold it: both sine and cosine are 0.
        """
        sine = self.read(observations, "sine of span position")
        cosine = self.read(observations, "cosine of span position")
        if (sine**2 + cosine**2 < 0.5).any():
            raise InputError(
                "It needs the place within the span, which these sensors do not measure; take skyhook, "
                "h-infinity, or repetitive:place='counted'."
            )
        ahead = 2 * np.pi * lead * self.read(observations, "speed") / self.context.alignment.mean_length
        angle: Array = np.arctan2(sine, cosine) + ahead
        return angle


class Gain(NamedTuple):
    """A number that `panto tune` fits."""

    step: float  # change by which its effect is measured: small, and about that of other gains' steps
    first: float = 0.0  # value from which the fit starts


class TunableLaw(LanesLaw):
    """A law with a vector of gains, either given or read from a file for line, pantograph and speed."""

    TUNED: ClassVar[Mapping[str, Gain]]
    """The gains by name, in order."""

    def __init__(self, gains: Source) -> None:
        """gains: the numbers, or the name or path of a file that `panto tune` wrote, read at each start."""
        if not isinstance(gains, str) and not (
            len(gains) and all(isinstance(each, int | float) and np.isfinite(each) for each in gains)
        ):
            raise ValueError(
                f"gains must be finite numbers or the name of a file of gains, not {shown(gains)}"
            )
        self._source = gains

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes. Raises InputError if there are no gains for them."""
        super().begin(context, lanes)
        self.gains = find_gains(self._source, list(self.TUNED), context)


class FromAverage:
    """Deviations of readings from their slow averages, which start at the first readings."""

    def __init__(self, interval: float, averaged: float) -> None:
        """interval: between readings (s); averaged: time constant of the averages (s)."""
        self._share = 1 - np.exp(-interval / averaged)
        self._average: Array | None = None

    def __call__(self, readings: Array) -> Array:
        """Deviations of readings, (..., lanes); the averages are updated."""
        if self._average is None:
            self._average = readings.copy()
        self._average += self._share * (readings - self._average)
        return readings - self._average
