"""Speed of a train: a slow drift about its mean, a profile that it follows, and its position at any time.

The drift is a sum of sines with equal acceleration amplitudes, so that the slow ones change the speed most;
its phases are drawn per run. Between the points of a profile the acceleration is constant. The distance is
the integral of both, in closed form. The aerodynamic force on a pantograph is that of the speed at each time
step.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..backend import inlined
from ..base.arrays import Array, from_kmh
from ..base.settings import Between, Settings
from .functions import cosine_of_turns, sine_of_turns

PERIODS = (7.0, 13.0, 29.0)
"""Periods of the sines (s), own choice: between a driver's actions and gradients. None is a multiple of
another."""
DRIFT_ROWS = 1 + 3 * len(PERIODS)
"""Entries of a lane's drift: offset at step 0 (m); then for each sine amplitude (m), turns per step, phase
(turns)."""
_TURN = 2 * math.pi


def speeds_of(rms: float) -> Array:
    """Amplitude of each sine, in the unit of the whole drift's rms."""
    periods = np.array(PERIODS)
    return np.asarray(rms * periods / np.sqrt(0.5 * np.sum(periods**2)))


def largest_drift(rms: float) -> float:
    """Maximum difference from the mean speed, in the unit of its rms."""
    return float(np.sum(speeds_of(rms)))


def largest_lag(rms: float) -> float:
    """Maximum distance by which a train lags, or leads, a steady one in a run (m); rms: m/s."""
    return float(np.sum(2 * speeds_of(rms) * np.array(PERIODS)) / _TURN)


def draw_drift(rms: float, time_step: float, random: np.random.Generator) -> Array:
    """Draw a lane's drift, (DRIFT_ROWS,); rms: m/s; time_step: s."""
    phases = random.uniform(0, 1, len(PERIODS))
    amplitudes = speeds_of(rms) * np.array(PERIODS) / _TURN
    waves = np.stack([amplitudes, time_step / np.array(PERIODS), phases], axis=1)
    return np.append(-np.sum(amplitudes * np.sin(_TURN * phases)), waves)


def ahead(drift: Array, steps: Array) -> Array:
    """Lead of trains over steady ones (m), (lanes, n), after numbers of steps, (lanes, n).

    drift: (lanes, DRIFT_ROWS), with the knots of profiles behind, or (lanes, 0) for steady trains.
    """
    way = np.zeros((len(drift), np.shape(steps)[-1]))
    if drift.shape[1]:
        way += drift[:, :1]
    for k in range(1, min(drift.shape[1], DRIFT_ROWS), 3):
        amplitude, turns, phase = drift[:, k : k + 3].T[:, :, None]
        way += amplitude * np.sin(_TURN * (turns * steps + phase))
    if drift.shape[1] > DRIFT_ROWS:
        way += profile_lead(drift, steps)[0]
    return way


def gain(drift: Array, steps: float) -> Array:
    """Distance by which trains cover more than the mean in a step (m), (lanes,), after a number of steps.

    drift: as in ``ahead``.
    """
    amplitude, turns, phase = np.moveaxis(drift[:, 1:DRIFT_ROWS].reshape(len(drift), -1, 3), 2, 0)
    more = np.sum(_TURN * amplitude * turns * np.cos(_TURN * (turns * steps + phase)), axis=1)
    if drift.shape[1] > DRIFT_ROWS:
        more += profile_lead(drift, np.full((len(drift), 1), steps))[1][:, 0]
    return np.asarray(more)


@inlined
def drifted_way(drift, way, steps):
    """Distance (m) after a number of steps of a lane whose speed drifts; way: at its mean speed (m)."""
    way += drift[0]
    for k in range(1, DRIFT_ROWS, 3):
        way += drift[k] * sine_of_turns(drift[k + 1] * steps + drift[k + 2])
    if drift.size > DRIFT_ROWS:
        way += lead_by_profile(drift, steps)
    return way


@inlined
def drifting_stride(drift, stride, steps):
    """Distance covered in a step (m), by the speed after a number of steps; stride: its mean (m)."""
    for k in range(1, DRIFT_ROWS, 3):
        turns = drift[k + 1] * steps + drift[k + 2]
        stride += _TURN * drift[k] * drift[k + 1] * cosine_of_turns(turns)
    if drift.size > DRIFT_ROWS:
        stride += gain_by_profile(drift, steps)
    return stride


KNOT_ROWS = 4
"""Entries of each knot of a lane's profile, behind those of its drift: number of steps from which it holds,
lead over a steady train there (m), lead gained per step (m), and half of what that grows by per step (m)."""
STRONGEST = 3.0
"""Largest acceleration of a profile (m/s2): an emergency brake reaches 2.5."""
SLOWEST = 5.0
"""Lowest speed of a profile (km/h): a stop is not possible."""
_Point = tuple[Annotated[float, Between(0, 1e6)], Annotated[float, Between(SLOWEST, 1000, "km/h")]]


class SpeedProfile(Settings):
    """Speeds that a train has one after the other, with constant acceleration in between."""

    over: Literal["place", "time"] = Field(
        "place", description="what the points are given over: place along the line (m), or time (s)"
    )
    points: tuple[_Point, ...] = Field(
        min_length=2,
        description="place or time, from 0 up, and speed (km/h) of each point; after the last one the speed "
        "stays",
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.points[0][0] != 0 or any(here >= there for (here, _), (there, _) in pairwise(self.points)):
            raise ValueError("points must begin at 0 and increase")
        times, speeds = self.knots
        fastest = float(np.max(np.abs(np.diff(speeds) / np.diff(times))))
        if fastest > STRONGEST:
            raise ValueError(
                f"points need an acceleration of {fastest:.1f} m/s2, and trains reach {STRONGEST:g} at most"
            )
        return self

    @property
    def knots(self) -> tuple[Array, Array]:
        """Times (s) and speeds (m/s) of the points, (points,) each."""
        given, kmh = np.array(self.points).T
        speeds = from_kmh(kmh)
        if self.over == "time":
            return given, speeds
        # With constant acceleration the mean speed between two points is the mean of theirs.
        durations = np.diff(given) / (0.5 * (speeds[1:] + speeds[:-1]))
        return np.array([0.0, *np.cumsum(durations)]), speeds

    @property
    def mean(self) -> float:
        """Mean speed over the time from the first point to the last (m/s)."""
        times, speeds = self.knots
        return float(np.trapezoid(speeds, times) / times[-1])

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest speed (m/s)."""
        _, speeds = self.knots
        return float(speeds.min()), float(speeds.max())

    def rows(self, time_step: float) -> Array:
        """Entries of its knots in a lane's drift, (KNOT_ROWS points,); time_step: s."""
        times, speeds = self.knots
        lead = np.append(0.0, np.cumsum(np.diff(times) * 0.5 * (speeds[1:] + speeds[:-1])))
        lead -= self.mean * times
        grows = np.append(np.diff(speeds) / np.diff(times), 0.0)
        gained = (speeds - self.mean) * time_step
        knots = np.stack([times / time_step, lead, gained, 0.5 * grows * time_step**2], axis=1)
        return knots.ravel()


def profile_lead(drift: Array, steps: Array) -> tuple[Array, Array]:
    """Lead of trains that follow a profile (m), and what they gain in a step (m), after numbers of steps.

    drift: (lanes, DRIFT_ROWS + KNOT_ROWS knots). steps: (lanes, n). Returns (lanes, n) each.
    """
    lead, gained = np.zeros(np.shape(steps)), np.zeros(np.shape(steps))
    for k in range(DRIFT_ROWS, drift.shape[1], KNOT_ROWS):
        begin, ahead, rate, half = drift[:, k : k + KNOT_ROWS].T[:, :, None]
        since = steps - begin
        here = (since >= 0) | (k == DRIFT_ROWS)
        lead = np.where(here, ahead + since * (rate + half * since), lead)
        gained = np.where(here, rate + 2 * half * since, gained)
    return lead, gained


@inlined
def lead_by_profile(drift, steps):
    """Lead (m) of a lane whose speed follows a profile, after a number of steps."""
    lead = 0.0
    for k in range(DRIFT_ROWS, drift.size, KNOT_ROWS):
        since = steps - drift[k]
        if since >= 0.0 or k == DRIFT_ROWS:
            lead = drift[k + 1] + since * (drift[k + 2] + drift[k + 3] * since)
    return lead


@inlined
def gain_by_profile(drift, steps):
    """What such a lane covers more than the mean in a step (m), by its speed after a number of steps."""
    gained = 0.0
    for k in range(DRIFT_ROWS, drift.size, KNOT_ROWS):
        since = steps - drift[k]
        if since >= 0.0 or k == DRIFT_ROWS:
            gained = drift[k + 2] + 2.0 * drift[k + 3] * since
    return gained
