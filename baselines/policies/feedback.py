"""Feedback of the measured motion: passive, skyhook, proportional and PD."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import shown
from panto_env.control.observation import Context

from .lanes_law import Array, Gain, Observations, Source, TunableLaw


class ForceLaw(ABC):
    """A controller that returns one force (N), positive upwards.

    The force acts on the articulated frame. With actuators on frame and head, that on the head stays at 0;
    with an actuator on the head only, the same law drives that one, between head and the mass below it.
    """

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self.context = context

    def read(self, observation: NDArray[np.float32], name: str) -> float:
        """Physical value of an entry of the observation."""
        return self.context.layout.read(observation, name)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        share_of_limit = self.force(observation) / self.context.force_limit
        action = np.zeros(self.context.actions)
        action[0] = min(max(share_of_limit, -1.0), 1.0)
        return action

    @abstractmethod
    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""


def time_constant(washout: object) -> float:
    """Time constant (s) of a policy's washout, 0 for None too. Raises ValueError if it is not valid."""
    return 0.0 if washout is None else number("washout", washout, lowest=0)


def number(name: str, value: object, lowest: float = -math.inf) -> float:
    """The value, if it is a finite number of at least ``lowest``. Raises ValueError if it is not."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < lowest:  # type: ignore[arg-type,operator]
        bound = f" of at least {lowest:g}" if math.isfinite(lowest) else ""
        raise ValueError(f"{name} must be a finite number{bound}, not {shown(value)}")
    return float(value)  # type: ignore[arg-type]


class Passive:
    """Actuators that stay at zero; every other policy is compared with this one."""

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._action = np.zeros(context.actions)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), all zero."""
        return self._action.copy()


class Skyhook(TunableLaw):
    """Force against the absolute velocities of frame and head: dashpots between them and the sky.

    u = - frame dz_f/dt - head dz_h/dt (Karnopp, Crosby and Harwood, J. Eng. Ind. 96:619, 1974). A force at
    the frame that opposes the frame's velocity only takes energy out; one that follows the head's may put
    some in, so that its gain may have either sign. It does not change the mean force.

    It has no model of the line and reads two velocities. Its gains are fitted to a line and a pantograph by
    `panto tune`: where none are stored, give them, such as ``skyhook:gains=[100, 0]``.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {"frame": Gain(20.0), "head": Gain(20.0)}

    def __init__(self, gains: Source = "skyhook") -> None:
        """gains: (2,): frame and head (N s/m); or the name or path of a file of gains."""
        super().__init__(gains)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        frame, head = self.gains
        of_frame, of_head = (self.read(observations, f"{mass} velocity") for mass in ("frame", "head"))
        return np.asarray(-frame * of_frame - head * of_head)


class Proportional(ForceLaw):
    """Force proportional to the nominal force minus the contact force.

    u = gain (F_N - F), F as measured. Where the passive mean force lies below F_N, the mean rises too.
    """

    def __init__(self, gain: float = 1.0, washout: float | None = None) -> None:
        """Take a ``gain`` (N/N) of 0 or more and a ``washout`` (s) as ``pd`` does, or raise ValueError.

        The default comes from `panto benchmark p:gain=0.5 p:gain=1.0 p:gain=1.5 p:gain=2.5 --config
        configs/benchmark.toml` (ideal actuator): on average sigma falls up to a gain of about 1.5, and
        from 2.5 on the loop oscillates by itself; 1 leaves a gain margin of two. The delay and lag of a
        real actuator lower that limit to about 1: choose 0.3 there.
        """
        self.gain = number("gain", gain, lowest=0)
        self.washout = time_constant(washout)

    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""
        return self.gain * (self.context.nominal_force - self.read(observation, "contact force"))


class ProportionalDerivative(ForceLaw):
    """Proportional and derivative feedback on the contact force, with damping of the frame.

    u = gain e + derivative de/dt - damping dz/dt, where e = F_N - F, de/dt is the backward difference
    over the control interval (0 at the first step) and dz/dt the frame's velocity, all as measured.
    Force feedback alone loses contact at speed: the damping is what most published controllers add.
    """

    def __init__(
        self,
        gain: float = 1.0,
        derivative: float = 0.005,
        damping: float = 150.0,
        washout: float | None = None,
    ) -> None:
        """Take ``gain`` (N/N), ``derivative`` (N per N/s) and ``damping`` (N s/m), each 0 or more.

        washout: see ``FeedbackFeedforward``.
        The defaults were chosen with `panto benchmark pd:gain=...,derivative=...,damping=... --config
        configs/benchmark.toml` among gains of 0.5, 0.75, 1; derivatives of 0, 0.005, 0.01, 0.015; dampings
        of 100, 150, 200. With the ideal actuator they come within 0.3 % of the minimum mean sigma; with the
        realistic one (configs/benchmark-realistic.toml) sigma is below the passive sigma on every line at
        every speed.
        Raises ValueError for a value that is not valid.
        """
        self.gain = number("gain", gain, lowest=0)
        self.derivative = number("derivative", derivative, lowest=0)
        self.damping = number("damping", damping, lowest=0)
        self.washout = time_constant(washout)

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        super().reset(context)
        self._last_error: float | None = None

    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""
        error = self.context.nominal_force - self.read(observation, "contact force")
        change = 0.0 if self._last_error is None else error - self._last_error
        self._last_error = error
        return (
            self.gain * error
            + self.derivative * change / self.context.control_interval
            - self.damping * self.read(observation, "frame velocity")
        )


class TunedProportionalDerivative(TunableLaw):
    """The law of ``pd`` with gains fitted to a line, and a constant force that keeps the mean where it was.

    u = gain e + derivative de/dt - damping dz/dt + bias, with e = F_N - F, de/dt its backward difference over
    the control interval (0 at the first step) and dz/dt the frame's velocity, all as measured. Where the mean
    force is below F_N, feedback alone raises it; the bias compensates for that.

    It needs to know the nominal force, and nothing of the line but its gains.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "gain": Gain(0.05),
        "derivative": Gain(0.001),
        "damping": Gain(20.0),
        "bias": Gain(1.0),
    }

    def __init__(self, gains: Source = "tuned-pd", washout: float | None = None) -> None:
        """gains: (4,): gain (N/N), derivative (N per N/s), damping (N s/m), bias (N); or the name or path of
        a file of gains. washout: see ``ProportionalDerivative``; it makes the bias idle.
        """
        super().__init__(gains)
        self.washout = time_constant(washout)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        self._last_error: Array | None = None

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        gain, derivative, damping, bias = self.gains
        error = self.context.nominal_force - self.read(observations, "contact force")
        change = error - (error if self._last_error is None else self._last_error)
        self._last_error = error
        force: Array = (
            gain * error
            + derivative * change / self.context.control_interval
            - damping * self.read(observations, "frame velocity")
            + bias
        )
        return force
