"""Stability of the rig's loop: what gain, delay and lag it bears.

By its frequency response: the loop is opened where the load cell is sampled. The computer's response to a
sample of 1 N, linear as long as no dropper goes slack, is measured as the mean over a span: the part that
differs from place to place comes back at other frequencies.

By simulation: two runs differ by a load cell's noise alone, with a contact that may pull and limits far away.
The loop is not stable where their difference has grown far beyond the noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.simulation import simulate
from ..base.arrays import Array, from_kmh
from ..base.errors import InputError
from ..plant.catenary.rig import RigData
from ..plant.numerics import Numerics
from ..plant.pantograph.schema import STRIP_STIFFNESS, PantographData, matrices
from .computer import RigComputer

Response = NDArray[np.complex128]
SECONDS = 1.0
"""Length of the measured response."""
PULSE = 1.0
"""Size (N) of a pulse, small enough that no dropper goes slack by it."""
PLACES = 48
"""Places in a span at which the computer's response is measured."""
SPAN = 5
"""The span, counted from 1."""
SLOWEST = 0.05
"""Share of its own natural frequency down to which a slower cylinder is looked for."""
LOWEST, POINTS = 4.0, 4000
"""Frequency (Hz) from which on the loop is looked at: below, a response of a second is not settled."""


@dataclass(frozen=True)
class Margins:
    """How far a loop that is closed with a minus sign is from instability."""

    stable: bool
    gain: float  # factor that the loop gain bears
    phase: float  # degrees
    delay: float  # that the loop bears on top (s)
    frequency: float  # at which it oscillates then (Hz)


class Loop:
    """A rig's loop about a pantograph at one speed."""

    def __init__(self, rig: RigData, pantograph: PantographData, speed_kmh: float) -> None:
        """Measure the computer's response."""
        self.rig, self.pantograph = rig, pantograph
        self.frequency: Array = np.linspace(LOWEST, 0.5 / rig.computer.interval, POINTS)
        self._computer = computer_response(rig, pantograph, speed_kmh, self.frequency)

    def margins(self) -> Margins:
        """Margins of the rig as it is."""
        return margins_of(self.frequency, self._gain(self.rig))

    def stable(self, rig: RigData) -> bool:
        """Whether the loop is stable with another cylinder, compensated for as it is."""
        return is_stable(self._gain(rig))

    def _gain(self, rig: RigData) -> Response:
        return analog_response(rig, self.pantograph, self.frequency) * self._computer


def threshold(stable: Callable[[float], bool], bad: float, good: float, share: float = 0.01) -> float:
    """Between a value that is stable and one that is not: where it changes, to a share of itself.

    The bad one itself where it is stable, too.
    """
    if stable(bad):
        return bad
    while abs(good - bad) > share * max(abs(good), abs(bad)):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if stable(middle) else (good, middle)
    return 0.5 * (good + bad)


def is_stable(loop: Response) -> bool:
    """Nyquist's criterion for a loop gain, over frequency, of a system that is stable while it is open."""
    turned = np.unwrap(np.angle(1 + loop))
    return bool(abs(turned[-1] - turned[0]) < np.pi)


def margins_of(frequency: Array, loop: Response) -> Margins:
    """Margins of a loop gain over frequency (Hz)."""
    size, angle = np.abs(loop), np.unwrap(np.angle(loop))
    crossing = np.diff(np.floor((angle + np.pi) / (2 * np.pi))) != 0
    gain = np.min(1 / np.maximum(size[:-1], size[1:])[crossing], initial=np.inf)
    phase, delay, at = 180.0, np.inf, np.nan
    for k in np.flatnonzero(np.diff(np.signbit(size - 1))):
        share = (1 - size[k]) / (size[k + 1] - size[k])
        omega = 2 * np.pi * (frequency[k] + share * (frequency[k + 1] - frequency[k]))
        left = float((angle[k] + share * (angle[k + 1] - angle[k]) + np.pi) % (2 * np.pi))
        phase = min(phase, np.degrees(left), 360 - np.degrees(left))
        if left / omega < delay:
            delay, at = left / omega, omega / (2 * np.pi)
    return Margins(is_stable(loop), float(gain), float(phase), float(delay), float(at))


def analog_response(rig: RigData, pantograph: PantographData, frequency: Array) -> Response:
    """From a command to the sampled force, (frequencies,), with its sign turned (N/m)."""
    s = 2j * np.pi * frequency
    omega, ratio = 2 * np.pi * rig.cylinder.natural_frequency, rig.cylinder.damping_ratio
    cylinder = omega**2 / (s**2 + 2 * ratio * omega * s + omega**2)
    corner = 2 * np.pi * rig.load_cell.filter_frequency
    cell_filter = corner**2 / (s**2 + np.sqrt(2) * corner * s + corner**2)
    h = rig.computer.interval
    held = (1 - np.exp(-s * h)) / (s * h) * np.exp(-s * rig.computer.delay)
    inertia = (rig.load_cell.mass - rig.load_cell.compensated_mass) * s**2
    force = dynamic_stiffness(pantograph, frequency, 1 / rig.cylinder.stiffness) + inertia
    return np.asarray(held * cylinder * force * cell_filter)


def dynamic_stiffness(pantograph: PantographData, frequency: Array, softness: float = 0.0) -> Response:
    """Force (N) for a metre by which a wire pushes a pantograph's head down, (frequencies,).

    softness: of what stands between wire and strip (m/N).
    """
    (a, b), stiffness = matrices(pantograph), pantograph.contact_stiffness
    strip = 1 / (STRIP_STIFFNESS if stiffness == "rigid" else stiffness)
    receptance = [-np.linalg.solve(2j * np.pi * f * np.eye(len(a)) - a, b[:, 0])[0] for f in frequency]
    return np.asarray(1 / (strip + softness + np.array(receptance)))


def computer_response(
    rig: RigData, pantograph: PantographData, speed_kmh: float, frequency: Array
) -> Response:
    """From the sampled force to a command (m/N), (frequencies,), the mean over a span.

    The line is linearised about its shape under the pantograph's mean force.
    """
    mean = pantograph.nominal_force(from_kmh(speed_kmh))
    time = rig.computer.interval * np.arange(round(SECONDS / rig.computer.interval))
    impulse = np.zeros(len(time))
    computer = RigComputer(rig, speed_kmh, force=mean, numerics=Numerics(precision="double"))
    for place in range(PLACES):
        begin = rig.alignment().support(SPAN - 1 + place / PLACES)
        for pulse in (PULSE, -PULSE):
            computer.reset()
            while computer.position < begin:
                computer.step(mean)
            commands = [computer.step(mean + (pulse if k == 0 else 0.0)) for k in range(len(time))]
            impulse += np.array(commands) / (2 * pulse * PLACES)
    fade = np.cos(0.5 * np.pi * time / time[-1]) ** 2  # so that the end is not a step
    return np.asarray(np.exp(-2j * np.pi * np.outer(frequency, time)) @ (fade * impulse))


NOISE = 1e-5
"""Of the load cell (N)."""
PART = (0.7, 0.95)
"""Of a run, as shares, in which the difference is looked at."""
AMPLIFIED = 100.0
"""Difference over noise beyond which it has grown: a stable loop makes it three to ten times as large."""
WIDE: dict[str, dict[str, Any]] = {
    "cylinder": {"displacement_noise": 0.0, "speed_limit": 20.0, "stroke": 2.0},
    "load_cell": {"noise": NOISE, "force_range": 1e5},
    "computer": {"input_bits": 32, "output_bits": 32},
}


def with_values(rig: RigData, tables: dict[str, dict[str, Any]]) -> RigData:
    """A rig with other values in its tables."""
    changed = {name: getattr(rig, name).model_copy(update=values) for name, values in tables.items()}
    return rig.model_copy(update=changed)


def grows_not(rig: RigData, pantograph: PantographData, speed_kmh: float) -> bool:
    """Whether a small disturbance of the loop does not grow."""
    wide, forces = with_values(rig, WIDE), []
    for seed in (0, 1):
        one = with_values(wide, {"computer": {"seed": seed}})
        try:
            run = simulate(one, pantograph, speed_kmh, bilateral=True, precision="double")
        except InputError:  # it diverged
            return False
        if run.terminated:
            return False
        forces.append(run.contact_force)
    begin, end = (int(share * len(forces[0])) for share in PART)
    return bool(np.std((forces[0] - forces[1])[begin:end]) < AMPLIFIED * NOISE)


def bearable_delay(rig: RigData, pantograph: PantographData, speed_kmh: float, most: float) -> float:
    """Delay (s) on top of its own, not compensated for, that the rig bears; looked for up to ``most``."""
    own = rig.computer.delay if rig.computer.assumed_delay is None else rig.computer.assumed_delay

    def stable(extra: float) -> bool:
        delay = {"delay": rig.computer.delay + extra, "assumed_delay": own}
        return grows_not(with_values(rig, {"computer": delay}), pantograph, speed_kmh)

    return threshold(stable, most, 0.0, share=0.02)


def slowest_cylinder(rig: RigData, stable: Callable[[RigData], bool], share: float = 0.01) -> float:
    """Natural frequency (Hz) of the cylinder below which a rig is not stable, if it is compensated for as one
    of the rig's own frequency; to a share of itself.
    """
    own = rig.cylinder.natural_frequency
    assumed = {"assumed_frequency": rig.computer.assumed_frequency or own}

    def with_cylinder(frequency: float) -> bool:
        slower = {"cylinder": {"natural_frequency": frequency}, "computer": assumed}
        return stable(with_values(rig, slower))

    return threshold(with_cylinder, SLOWEST * own, own, share)
