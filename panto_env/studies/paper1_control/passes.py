"""Which passes the study makes: the paper's control, and what it leaves open."""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, product
from typing import Any

import numpy as np

from ...analysis.pool import Progress, in_processes
from ...base.errors import InputError
from ...catalog import load_catenary, load_pantograph
from ...control import Task
from ...control.settings import RunSettings, run_settings
from ...metrics.figures import Figures, losses_of_contact
from ...metrics.low_pass import band_rms
from ...metrics.trajectory import Trajectory
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.pantograph.schema import PantographData, matrices
from ...policies import find_policy

LINE = "shinkansen-simple"
OTHER_LINE = "en50318-2002"
PANTOGRAPH = "identified-2dof"
SPANS = (6, 15)
"""Spans that figures cover: the start has died out, the far anchor's reflection has not come yet."""
RUN_SPANS = SPANS[1] + 2  # spans that a run covers

SPEEDS = tuple(range(100, 401, 25))  # km/h, Figs 17 and 18: the paper's range; the step is an own choice
ANGLE_SPEEDS = tuple(range(100, 401, 50))  # km/h, Fig. 13
SHOWN_SPEEDS = (300, 350, 400)  # km/h, Figs 14 to 16

OFTEN = 0.002
"""Control interval (s): the paper names no sampling, so the control acts as often as makes a difference."""
SAMPLED = 0.01  # control interval (s) of published active pantographs, and of ``Pantograph-v0``

DEFAULT_GAIN = 1.0  # the gain of the policy as shipped (N/N): the paper prints none
GAIN = 1.75  # calibrated: the minimum of ``GAINS`` that leaves no contact loss at 300, 350 and 400 km/h
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
FINE: dict[str, float] = {"time_step": 1e-4, "spacing": 0.08}  # finer still, to see what depends on them


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


def all_cases() -> Iterator[Case]:
    """Every pass of the study, some of them several times, but those with another static force."""
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


BANDS = ((0.0, 7.0), (7.0, 15.0), (15.0, 30.0))
"""Bands of frequency (Hz) into which the contact force is split; the mean belongs to none."""
LANES = 12  # passes made together in one process; from 16 on a task would take threads beside the processes


@dataclass(frozen=True)
class Result:
    """What is kept of a pass, over ``SPANS``."""

    case: Case
    figures: Figures
    raw_std: float  # of the unfiltered contact force (N)
    longest_loss: float  # longest time without contact (s)
    once_per_span: complex  # that part of the contact force: amplitude (N) and phase
    bands: tuple[float, ...]  # rms of the unfiltered contact force in BANDS (N)

    @property
    def mean_deviation(self) -> float:
        """CF over the distance: the mean of |F - F_N| (N)."""
        return self.figures.cost_function / self.figures.distance


def run_all(cases: Collection[Case], progress: Progress) -> dict[Case, Result]:
    """Results of all cases, from all cores. Raises InputError if a worker process dies."""
    found = in_processes([partial(run, batch) for batch in _batches(cases)], progress=progress)
    results = {result.case: result for batch in found for result in batch}
    return {case: results[case] for case in cases}


def run(cases: Sequence[Case]) -> list[Result]:
    """Run cases that differ in their policy alone."""
    return [result_of(case, record) for case, record in zip(cases, records(cases), strict=True)]


def records(cases: Sequence[Case], pantograph: str | PantographData = PANTOGRAPH) -> list[Trajectory]:
    """Whole records of cases that differ in their policy alone: lanes of one task."""
    first, line = cases[0], load_catenary(cases[0].line)
    given: dict[str, Any] = {
        "catenary": line,
        "pantograph": pantograph,
        "speed_kmh": first.speed_kmh,
        "actuator": ACTUATORS[first.actuator],
        "control_interval": first.control_interval,
        "distance": line.alignment().support(RUN_SPANS),
    }
    settings: RunSettings = run_settings(given | (FINE if first.fine else USUAL))
    task = Task(settings, lanes=len(cases))
    policies = [find_policy(case.policy) for case in cases]
    for lane, policy in enumerate(policies):
        task.reset(lane, np.random.default_rng(0))
        policy.reset(task.context(lane))
    results = task.results
    action = np.zeros((len(cases), len(task.actuator.places)))
    while not results.truncated[0]:
        for lane, policy in enumerate(policies):
            action[lane] = policy.act(results.observation[lane])
        task.step(action)
        if results.terminated.any():
            ended = cases[int(np.argmax(results.terminated))]
            raise InputError(f"The pass {ended} left the valid range of the simulation; leave it out.")
    return [task.trajectory(lane, policy=case.policy) for lane, case in enumerate(cases)]


def passive_at_mean(speed_kmh: int, mean: float) -> Result:
    """The passive pantograph under as much more static force as gives this mean force (N).

    CF still counts from the nominal force that the pantograph has as it is.
    """
    case, pantograph = Case(speed_kmh), load_pantograph(PANTOGRAPH)
    (passive,) = records([case])
    passive_mean = _mean(passive)
    more = mean - passive_mean
    for _ in range(3):  # the mean is all but linear in the static force
        raised = pantograph.model_copy(update={"static_force": pantograph.static_force + more})
        (record,) = records([case], raised)
        more *= (mean - passive_mean) / (_mean(record) - passive_mean)
    return result_of(case, dataclasses.replace(record, nominal_force=passive.nominal_force))


def result_of(case: Case, record: Trajectory) -> Result:
    """What is kept of a record."""
    inside = record.inside(SPANS)
    force, turns = record.contact_force[inside], record.alignment.in_spans(record.position[inside])
    begins, ends = losses_of_contact(force)
    return Result(
        case,
        record.summary(SPANS),
        float(force.std()),
        int((ends - begins).max(initial=0)) * record.time_step,
        complex(2 * np.mean(force * np.exp(-2j * np.pi * turns))),
        tuple(band_rms(force, record.time_step, *band) for band in BANDS),
    )


def _batches(cases: Collection[Case]) -> Iterator[list[Case]]:
    """Cases that differ in their policy alone, LANES at a time, slow trains first: theirs take longest."""

    def plant(case: Case) -> tuple[Any, ...]:
        return case.speed_kmh, case.line, case.actuator, case.control_interval, case.fine

    for _, group in groupby(sorted(cases, key=plant), key=plant):
        same_plant = list(group)
        for first in range(0, len(same_plant), LANES):
            yield same_plant[first : first + LANES]


def _mean(record: Trajectory) -> float:
    return float(record.contact_force[record.inside(SPANS)].mean())


@dataclass(frozen=True)
class CostOverAngle:
    """Cost function (N m) over the phase angle (rad) at one speed."""

    cost: list[float]  # at THETAS
    best: float  # theta of the minimum
    without: float  # cost of the feedback alone
    at_paper: float  # cost at the paper's pi/6
    cancelling: float  # theta that cancels the force's part once per span


def cost_over_angle(
    results: Mapping[Case, Result], speed: int, gain: float, reading: str, fine: bool = False
) -> CostOverAngle:
    """At one speed (km/h).

    The feed-forward, once per span, opposes the force's part once per span at an angle by what is measured:
    that part with feedback alone, and what the feed-forward at angle 0 adds to it. Shifting A sin(kx) by
    theta turns what it adds by -theta.
    """

    def at(theta: float, reading: str, amplitude: float = AMPLITUDE) -> Result:
        return results[Case(speed, control(gain, amplitude, theta, reading), fine=fine)]

    costs = [at(theta, reading).figures.cost_function for theta in THETAS]
    alone = at(THETA, SPAN, 0.0)
    zero, paper = (min(THETAS, key=lambda theta: abs(theta - angle)) for angle in (0.0, THETA))
    added = at(zero, SPAN).once_per_span - alone.once_per_span
    turn = cmath.phase(added) - cmath.phase(-alone.once_per_span)
    return CostOverAngle(
        cost=costs,
        best=THETAS[costs.index(min(costs))],
        without=alone.figures.cost_function,
        at_paper=costs[THETAS.index(paper)],
        cancelling=math.remainder(turn, 2 * math.pi),
    )


def amplification(frequency: float, gain: float, damping: float = 0.0) -> float:
    """Contact force under feedback over that without, where the wire moves at ``frequency`` (Hz).

    gain: of force feedback (N/N); damping: of the frame's velocity (N s/m), both on the frame and at
    once. The contact wire is an endless string, which yields as a damper of 2 sqrt(T m).
    """
    return abs(_force(frequency, gain, damping) / _force(frequency, 0.0, 0.0))


def _force(frequency: float, gain: float, damping: float) -> complex:
    """Contact force (N) per metre that the wire would move by without the pantograph."""
    line, pantograph = load_catenary(LINE), load_pantograph(PANTOGRAPH)
    if not isinstance(line, FlexibleCatenaryData) or pantograph.contact_stiffness == "rigid":
        raise TypeError("the linear model needs a contact wire and an elastic contact")
    s = 2j * math.pi * frequency
    a, b = matrices(pantograph)
    response = np.linalg.solve(s * np.eye(len(a)) - a, b)  # of the state to contact and frame force
    head, frame = response[0], response[len(pantograph.masses) - 1]
    control = -(gain + damping * s * frame[0]) / (1 + damping * s * frame[1])  # N per N of contact force
    contact = pantograph.contact_stiffness + pantograph.contact_damping * s
    wire = 1 / (2 * math.sqrt(line.contact_wire.tension * line.contact_wire.mass) * s)
    return complex(contact / (1 - contact * (head[0] + head[1] * control) + contact * wire))
