"""Paper 1's control: feedback on the contact force and feed-forward of the spans."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from panto_env.base.arrays import METRES_PER_SECOND, to_kmh
from panto_env.base.errors import InputError, shown
from panto_env.control.observation import Context

from .feedback import ForceLaw, number, time_constant
from .lanes_law import Array, Gain, Observations, Source, TunableLaw

FORCE_RANGE = (0.0, 300.0)  # range (N) to which the feedback clips the contact force (paper 1)
READINGS = ("span", "printed")
SPEED_UNITS = {"km/h": METRES_PER_SECOND, "m/s": 1.0}


class FeedbackFeedforward(ForceLaw):
    """Feedback and feed-forward of paper 1, section 5, both as forces that lift the pantograph.

    Feedback: gain (F_N - F), with F clipped to 0-300 N; zero where F is within ``dead_zone`` of F_N, and
    beyond that counted from the edge of the dead zone. The paper prints no gain.

    Feed-forward: A sin(k x - theta), where x is the distance run, 0 at a support. ``reading`` chooses k:
    "span": 2 pi / s, one period per span s, which is what the paper's text describes;
    "printed": Eqs 11 and 12 as they stand, k = w pi / (2 s) with w = 2 v / s. Then k x is not an angle,
    is not in step with the spans, and depends on the unit of v, which the paper does not give.

    The paper calls the control force positive where the contact force is above F_N, and draws no axes.
    We read A sin(...) as a lift; read as a downward force it would be the same with theta + pi. With our
    reading, the minimum of CF lies between theta = -pi/6 and pi/6 under `en50318-2002`, and under
    `shinkansen-simple` at 350 and 400 km/h; at 250 and 300 km/h it lies near -pi/2 there, and pi/6 makes
    CF worse: `panto benchmark fb+ff:theta=-1.57 fb+ff:theta=0 fb+ff --config configs/benchmark.toml`.

    A policy does not see where the train is: x is the position within the span, from its sine and cosine,
    and grows by a span wherever that begins anew.
    """

    def __init__(
        self,
        gain: float | Mapping[float, float] = 1.0,
        theta: float = math.pi / 6,
        amplitude: float = 10.0,
        dead_zone: float = 0.0,
        reading: str = "span",
        speed_unit: str = "km/h",
        washout: float | None = None,
    ) -> None:
        """Take the parameters; raises ValueError for one that is not valid.

        gain: N/N, or a table of gains by speed (km/h), linear between these speeds and constant beyond
        them; the default opposes each newton with one newton, see ``Proportional``. theta: phase (rad);
        the default is the paper's for every speed. amplitude: A (N). dead_zone: half its width (N).
        speed_unit: of v in Eq. 12, for the reading "printed" only.
        washout: time constant (s) of the force's slow average, which the environment subtracts, so that the
        mean contact force stays; None or 0 is the paper's form.
        """
        gains = gain if isinstance(gain, Mapping) else {0.0: gain}
        if not gains:
            raise ValueError("gain must hold at least one speed")
        self.gains = {
            number("speed of a gain", speed, lowest=0): number("gain", value, lowest=0)
            for speed, value in gains.items()
        }
        self.theta = number("theta", theta)
        self.amplitude = number("amplitude", amplitude, lowest=0)
        self.dead_zone = number("dead_zone", dead_zone, lowest=0)
        if reading not in READINGS:
            raise ValueError(f"reading must be one of {', '.join(READINGS)}, not {shown(reading)}")
        if speed_unit not in SPEED_UNITS:
            raise ValueError(f"speed_unit must be one of {', '.join(SPEED_UNITS)}, not {shown(speed_unit)}")
        self.reading = reading
        self.speed_unit = speed_unit
        self.washout = time_constant(washout)

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        super().reset(context)
        speeds = sorted(self.gains)
        values = [self.gains[speed] for speed in speeds]
        self._gain = float(np.interp(to_kmh(context.speed), speeds, values))
        length = context.alignment.mean_length
        w = 2 * (context.speed * SPEED_UNITS[self.speed_unit]) / length  # Eq. 12
        printed = w * math.pi / (2 * length)  # Eq. 11
        self._wavenumber = 2 * math.pi / length if self.reading == "span" else printed
        self._share: float | None = None  # of a span, when last seen
        self._spans = 0  # begun since the start

    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""
        lowest, highest = FORCE_RANGE
        contact_force = min(max(self.read(observation, "contact force"), lowest), highest)
        shortfall = self.context.nominal_force - contact_force
        feedback = self._gain * math.copysign(max(abs(shortfall) - self.dead_zone, 0.0), shortfall)
        distance = self._distance(observation)
        return feedback + self.amplitude * math.sin(self._wavenumber * distance - self.theta)

    def _distance(self, observation: NDArray[np.float32]) -> float:
        """Distance (m) from the support behind the start of the run, as if all spans had the mean length."""
        sine = self.read(observation, "sine of span position")
        cosine = self.read(observation, "cosine of span position")
        if sine**2 + cosine**2 < 0.5:
            raise InputError(
                "It needs the place within the span, which these sensors do not measure; take p or pd."
            )
        share = math.atan2(sine, cosine) / (2 * math.pi) % 1.0
        if self._share is not None:
            self._spans -= round(share - self._share)  # nearly a span back: the next has begun
        self._share = share
        return (self._spans + share) * self.context.alignment.mean_length


class TunedFeedbackFeedforward(TunableLaw):
    """The law of ``fb+ff`` (paper 1, section 5) with gain, amplitude and phase fitted to a line, and a
    constant force that keeps the mean where it was.

    u = gain (F_N - F) + sine sin(2 pi x / s) + cosine cos(2 pi x / s) + bias, with F clipped to 0-300 N and x
    the place within the span s: Eq. 11 as the paper's text describes it, A sin(2 pi x / s - theta) with
    A^2 = sine^2 + cosine^2 and tan(theta) = - cosine / sine; no dead zone.

    It needs to know the nominal force and the place within the span, and nothing of the line but its gains.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "gain": Gain(0.05),
        "sine": Gain(2.0),
        "cosine": Gain(2.0),
        "bias": Gain(1.0),
    }

    def __init__(self, gains: Source = "tuned-fb+ff", washout: float | None = None) -> None:
        """gains: (4,): gain (N/N), sine (N), cosine (N), bias (N); or the name or path of a file of gains.
        washout: see ``FeedbackFeedforward``; it makes the bias idle.
        """
        super().__init__(gains)
        self.washout = time_constant(washout)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        gain, sine, cosine, bias = self.gains
        contact_force = np.clip(self.read(observations, "contact force"), *FORCE_RANGE)
        angle = self.span_angle(observations)
        feedforward = sine * np.sin(angle) + cosine * np.cos(angle)
        return np.asarray(gain * (self.context.nominal_force - contact_force) + feedforward + bias)
