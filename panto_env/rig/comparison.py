"""A rig beside the line itself: what of the contact force it follows, by bands of frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.simulation import simulate
from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.figures import SpanChoice
from ..metrics.low_pass import in_band
from ..metrics.trajectory import Trajectory
from ..plant.catenary.rig import RigData

BANDS = ((0.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, 40.0))
"""Bands (Hz) of a table."""
NARROW, HIGHEST = 2.5, 60.0
"""Width (Hz) of the bands by which the highest frequency followed is found, and where they end."""
FOLLOWED = 0.10
"""Error, as a share of the reference's rms in a band, up to which it is followed."""
SLOWEST_STEP = 2.5e-4
"""Time step (s) of both by default: the same, so that they differ by the rig alone."""


@dataclass(frozen=True)
class Band:
    """A band of frequency of one quantity."""

    low: float  # Hz
    high: float  # Hz
    reference: float  # rms, in the quantity's unit
    rig: float  # likewise
    error: float  # rms of the difference over the reference's rms


@dataclass(frozen=True)
class Pair:
    """A run on a rig and the same on the line itself."""

    reference: Trajectory
    rig: Trajectory
    spans: SpanChoice

    def bands(
        self, quantity: str = "contact_force", edges: Sequence[tuple[float, float]] = BANDS
    ) -> list[Band]:
        """Bands (Hz) of a quantity, an attribute of ``Trajectory``."""
        reference, rig = self.signals(quantity)
        found = []
        for low, high in edges:
            true, ours = (in_band(each, self.reference.time_step, low, high) for each in (reference, rig))
            size = rms(true)
            found.append(Band(low, high, size, rms(ours), rms(ours - true) / size if size else np.nan))
        return found

    def signals(self, quantity: str) -> tuple[Array, Array]:
        """A quantity of both, (samples,), over the spans, without its mean."""
        inside = self.reference.inside(self.spans)
        length = min(len(self.reference.time), len(self.rig.time))
        values = [getattr(run, quantity)[:length][inside[:length]] for run in (self.reference, self.rig)]
        return values[0] - values[0].mean(), values[1] - values[1].mean()

    def followed(self) -> float:
        """Highest frequency (Hz) up to which each narrow band of the force is followed within a tenth."""
        edges = [(low, low + NARROW) for low in np.arange(0.0, HIGHEST, NARROW).tolist()]
        for band in self.bands(edges=edges):
            if not band.error <= FOLLOWED:
                return band.low
        return HIGHEST

    def first_lost(self) -> Band:
        """The first narrow band that is not followed, or the last one of all."""
        low = min(self.followed(), HIGHEST - NARROW)
        return self.bands(edges=[(low, low + NARROW)])[0]


def compare(
    rig: RigData, reference: Any, pantograph: Any, speed_kmh: float, spans: SpanChoice = None, **settings: Any
) -> Pair:
    """Run a pantograph on a rig and under a reference line; settings: of both runs.

    Raises InputError where either run ends early.
    """
    settings = {"time_step": SLOWEST_STEP, "record_droppers": False} | settings
    runs = [simulate(line, pantograph, speed_kmh, **settings) for line in (reference, rig)]
    for run in runs:
        if run.terminated:
            raise InputError(f"'{run.pantograph}' on '{run.catenary}' has nothing to compare: {run.ending}")
    return Pair(runs[0], runs[1], spans)


def rms(signal: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(signal**2)))
