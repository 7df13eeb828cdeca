"""Which passes the study makes: the paper's control, and what it leaves open."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

LINE = "shinkansen-simple"
OTHER_LINE = "en50318-2002"
PANTOGRAPH = "identified-2dof"
SPANS = (6, 15)
"""Spans that figures cover: the start has died out, the far anchor's reflection has not come yet."""
RUN_SPANS = SPANS[1] + 2
"""Spans that a run covers."""

SPEEDS = tuple(range(100, 401, 25))
"""km/h, Figs 17 and 18: the paper's range; the step is an own choice."""
ANGLE_SPEEDS = tuple(range(100, 401, 50))
"""km/h, Fig. 13."""
SHOWN_SPEEDS = (300, 350, 400)
"""km/h, Figs 14 to 16."""

OFTEN = 0.002
"""Control interval (s): the paper names no sampling, so the control acts as often as makes a difference."""
SAMPLED = 0.01
"""Control interval (s) of published active pantographs, and of ``Pantograph-v0``."""

DEFAULT_GAIN = 1.0
"""The gain of the policy as shipped (N/N): the paper prints none."""
GAIN = 1.75
"""Calibrated: the minimum of ``GAINS`` that leaves no contact loss at 300, 350 and 400 km/h."""
REAL_GAIN = 0.5
"""The one of ``GAINS`` with the minimum of the maximum losses at 300 to 400 km/h, realistic actuator."""
GAINS = tuple(0.25 * k for k in range(1, 13))
THETA = math.pi / 6  # the paper's, for all speeds
AMPLITUDE = 10.0  # N, the paper's
THETA_STEP = math.pi / 12
THETAS = tuple(THETA_STEP * k for k in range(-11, 13))
READINGS = {
    "once per span": "reading=span",
    "Eqs 11-12, v in km/h": "reading=printed,speed_unit=km/h",
    "Eqs 11-12, v in m/s": "reading=printed,speed_unit=m/s",
}
"""Readings of the feed-forward, as parameters of the policy fb+ff."""
SPAN, KMH, MS = READINGS

ACTUATORS: dict[str, Any] = {
    "ideal": "ideal",
    "delay 5 ms": {"delay": 0.005},
    "lag 15 ms": {"lag": 0.015},
    "realistic": "realistic",  # both, and 2500 N/s
}
SHIPPED = "pd as shipped"
FAST_SPEEDS = tuple(range(300, 401, 25))
"""km/h, those at which more damping of the frame is tried: the passive pantograph loses contact there."""
DAMPINGS = (100.0, 150.0, 200.0, 250.0, 300.0, 350.0)
"""Of the frame (N s/m), each tried with each of ``DAMPED_GAINS`` and the realistic actuator."""
DAMPED_GAINS = (0.5, 0.75, 1.0, 1.25)
STRONG_GAIN, STRONG_DAMPING = 0.75, 300.0
"""The middle of three neighbouring ``DAMPINGS`` that leave no contact loss at ``FAST_SPEEDS``."""


def damped(gain: float, damping: float) -> str:
    """The policy pd as shipped but for these parameters, by name."""
    return f"pd:gain={gain!r},damping={damping!r}"


STRONG = f"pd, gain {STRONG_GAIN:g}, {STRONG_DAMPING:g} N s/m"
DAMPING = {
    "frame damping alone": "pd:gain=0.0,derivative=0.0",
    "FB + frame damping": "pd:derivative=0.0",
    SHIPPED: "pd",
    STRONG: damped(STRONG_GAIN, STRONG_DAMPING),
}
"""What the paper does not have: feedback of the frame's velocity, 150 N s/m where no other is named."""


USUAL: dict[str, float] = {"time_step": 1.25e-4, "spacing": 0.1}
"""Time step (s) and grid (m), finer than the default: a loss of contact of some 0.1 % decides here."""
FINE: dict[str, float] = {"time_step": 1e-4, "spacing": 0.08}
"""Finer still, to see what depends on them."""


@dataclass(frozen=True)
class Case:
    """One pass along the line."""

    speed_kmh: int
    policy: str = "passive"
    line: str = LINE
    actuator: str = "ideal"  # among ACTUATORS
    control_interval: float = OFTEN  # s
    fine: bool = False  # whether on the grid and time step of FINE


def control(
    gain: float = GAIN, amplitude: float = AMPLITUDE, theta: float = THETA, reading: str = SPAN
) -> str:
    """The policy fb+ff with these parameters, by name."""
    return f"fb+ff:gain={gain!r},amplitude={amplitude!r},theta={theta!r},{READINGS[reading]}"


def sampled(speed_kmh: int, policy: str, actuator: str, fine: bool = False, line: str = LINE) -> Case:
    """A pass as a train could run it: controlled at its sampling interval, through this actuator."""
    return Case(speed_kmh, policy, line, actuator, SAMPLED, fine)


PARTS = {
    "passive": "passive",
    "FB, gain 1": control(DEFAULT_GAIN, amplitude=0.0),
    f"FB, gain {GAIN}": control(amplitude=0.0),
    "FF": control(gain=0.0),
    "FB+FF, gain 1": control(DEFAULT_GAIN),
    f"FB+FF, gain {GAIN}": control(),
    f"FB+FF, gain {GAIN}, {KMH}": control(reading=KMH),
    f"FB+FF, gain {GAIN}, {MS}": control(reading=MS),
}
"""The control and its parts, each every 2 ms and with an ideal actuator."""
ON_A_TRAIN = {
    f"FB+FF, gain {REAL_GAIN}": control(REAL_GAIN),
    "FB+FF, gain 1": control(DEFAULT_GAIN),
    f"FB+FF, gain {GAIN}": control(),
    **DAMPING,
}
"""Controls that are tried with each actuator, sampled."""
OVER_SPEED = {name: PARTS[name] for name in ("passive", f"FB+FF, gain {GAIN}", "FB+FF, gain 1")}
OVER_SPEED_ON_A_TRAIN = {name: ON_A_TRAIN[name] for name in (f"FB+FF, gain {REAL_GAIN}", SHIPPED, STRONG)}
"""Controls of Figs 17 and 18, the latter with the realistic actuator."""
ANGLE_CONTROLS = ((GAIN, SPAN, False), (GAIN, SPAN, True), (DEFAULT_GAIN, SPAN, False), (GAIN, KMH, False))
"""Gains and readings under which the phase angle is varied, and whether on the grid of ``FINE``."""
LOOPS = (("ideal", OFTEN), ("ideal", SAMPLED), ("realistic", SAMPLED))
"""Actuators and control intervals under which the gain is varied."""


def all_cases() -> list[Case]:
    """Every pass of the study, each once, but those with another static force."""
    return list(dict.fromkeys(_cases()))


def _cases() -> Iterator[Case]:
    for fine, speed in product((False, True), SPEEDS):  # Figs 17, 18
        for policy in OVER_SPEED.values():
            yield Case(speed, policy, fine=fine)
        for policy in OVER_SPEED_ON_A_TRAIN.values():
            yield sampled(speed, policy, "realistic", fine)
    for (gain, reading, fine), speed in product(ANGLE_CONTROLS, ANGLE_SPEEDS):  # Fig. 13
        yield Case(speed, control(gain, amplitude=0.0), fine=fine)
        for theta in THETAS:
            yield Case(speed, control(gain, theta=theta, reading=reading), fine=fine)
    for fine, speed in product((False, True), SHOWN_SPEEDS):
        for line, policy in product((LINE, OTHER_LINE), PARTS.values()):
            yield Case(speed, policy, line, fine=fine)
        for line, policy in product((LINE, OTHER_LINE), ON_A_TRAIN.values()):
            yield sampled(speed, policy, "realistic", fine, line)
    for fine, speed, gain, damping in product((False, True), FAST_SPEEDS, DAMPED_GAINS, DAMPINGS):
        yield sampled(speed, damped(gain, damping), "realistic", fine)
    for (actuator, interval), speed, gain in product(LOOPS, SHOWN_SPEEDS, GAINS):
        yield Case(speed, control(gain), actuator=actuator, control_interval=interval)
    for actuator, speed, policy in product(ACTUATORS, SHOWN_SPEEDS, ON_A_TRAIN.values()):
        yield sampled(speed, policy, actuator)
