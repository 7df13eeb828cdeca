"""Contact force on a line as designed: the passive force along the span, and the response to commands.

A policy that knows the design may compute both beforehand; it sees nothing of the actual line.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.base.arrays import to_kmh
from panto_env.base.checksums import remembered
from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.observation import Context
from panto_env.control.settings import RunSettings, run_settings
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.actuators.lagged import LaggedActuator
from panto_env.plant.catenary import CatenaryData
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.state import Place
from panto_env.policies import Policy, find_policy, wishes

from ..benchmark.settings import TRAINING

Array = NDArray[np.float64]
SETTLED = 9  # spans after which the force nearly repeats with the span
CLEAR = 8  # spans of the line beyond those run, so that its end has no effect
PULSE = 20.0  # test force (N): small beside the contact force, large beside rounding


class Preview(NamedTuple):
    """Preview at steps through a span, one control interval apart; the first is ``start`` past a support."""

    start: float  # m
    stride: float  # of a step (m)
    passive: Array  # (steps,): contact force of the passive run, from its mean (N)
    response: Array  # (steps, length): contact force 1, 2, ... steps after a command of one step there (N/N)

    def step(self, position: Array) -> NDArray[np.int64]:
        """Index of the step nearest to each distance past a support (m), (lanes,)."""
        return np.rint((position - self.start) / self.stride).astype(np.int64) % len(self.passive)


def preview(context: Context, length: int, delay: float, lag: float) -> Preview:
    """Preview for an episode. length: steps of the responses; delay, lag: of the actuator (s)."""
    line, place = context.catenary, Place(context.channels[0]).name.lower()
    actuator = LaggedActuator(place=place, delay=delay, lag=lag, force_limit=PULSE)
    return _preview(line, context.pantograph, actuator, context.speed, context.control_interval, length)


@remembered
def _preview(
    catenary: CatenaryData,
    pantograph: PantographData,
    actuator: LaggedActuator,
    speed: float,
    interval: float,
    length: int,
) -> Preview:
    stride, alignment = speed * interval, catenary.alignment()
    first = math.ceil(alignment.support(SETTLED) / stride)
    steps = max(1, round(alignment.mean_length / stride))
    last = first + steps + length
    spans = math.ceil(alignment.in_spans(last * stride))
    settings = run_settings(
        {
            "catenary": catenary,
            "pantograph": pantograph,
            "speed_kmh": to_kmh(speed),
            "actuator": actuator,
            "accuracy": "fast",
            "distance": alignment.support(spans),
            "spans": spans + CLEAR,
            "control_interval": interval,
        }
    )
    task = Task(settings, lanes=1 + steps, keep_samples=False)  # lane 0 runs passively
    task.reset(np.arange(1 + steps), np.random.default_rng(0))
    entry = task.layout.index("contact force")
    scale = task.layout.entries[entry].scale
    force = np.zeros((last + 1, 1 + steps))
    for k in range(last + 1):
        if task.results.terminated.any():
            raise InputError(f"On '{catenary.name}' as designed a pass ends early: {task.ending(0)}")
        force[k] = scale * task.results.observation[:, entry]
        action = np.zeros((1 + steps, len(task.actuator.places)))
        if first <= k < first + steps:
            action[1 + k - first, 0] = 1.0
        if k < last:
            task.step(action)
    passive = force[first : first + steps, 0]
    windows = [slice(first + i + 1, first + i + 1 + length) for i in range(steps)]
    response = np.array([force[own, 1 + i] - force[own, 0] for i, own in enumerate(windows)])
    start = first * stride - alignment.support(SETTLED)
    return Preview(start, stride, passive - passive.mean(), response / PULSE)


PLACES = tuple(range(0, 31, 2))  # places ahead (m) at which the force in front is observed
PASSES, EXCITED = 6, 3  # passes without control, and with test forces, from which gains are fitted
DISTANCE = 1500.0  # length of these passes (m)
BEGIN = 120  # control steps of a pass that are left out at its start, while waves build up
PULSES, PULSE_STEPS = 20.0, 5  # test forces (N), up or down at random, and control steps that each is held
RESPONSE = 40  # control steps in which a command acts on the contact force
PAST = range(2, 60, 3)
"""Control steps ago at which the force in front at the own place is remembered, for waves that come late."""
RIDGE = 0.3  # weight of the squared command beside the squared force that it leaves


class FrontPreview:
    """Feed-forward of the contact force that the pantograph in front had at places ahead, and of its past.

    On a line as built the force behind repeats much of the force in front, with a phase that depends on
    distance and speed: at 250 and 300 km/h a filter of the force in front, 40 m to either side, explains 55
    to 86 % of the variance 100 and 200 m behind (`docs/train.md`). The command minimises, by least squares
    over passes under training seeds on lines as built, the square of the force that it leaves,
    sum(h * front) + g * u, beside 0.3 of its own square; g is the mean response of the
    contact force to commands, found from test forces in the same passes. So it knows line, train and
    actuator as designed, and nothing of the line's defects but what the one in front has felt.

    Its command is added to that of a base policy, which runs in these passes too; "" for none. Own choice of
    the project.
    """

    front = PLACES

    def __init__(
        self, base: str = "repetitive", actuator: str = "realistic", sensors: str = "realistic"
    ) -> None:
        """base: name of the policy to which it adds. actuator, sensors: presets that gains are fitted with.

        Raises InputError for an unknown policy.
        """
        self._assumed = base, actuator, sensors
        self._base = find_policy(base or "passive")
        vars(self).update(_wished(self._base))

    def reset(self, context: Context) -> None:
        """Find the gains. Raises InputError where no pantograph is in front."""
        number, collectors = context.collector, context.train.collectors
        if number == 0:
            raise InputError("front-preview needs a pantograph in front: control one behind another.")
        if len(context.channels) > 1:
            raise InputError("front-preview drives one actuator, on frame or head, not both.")
        self._mean, self._gains = _gains(
            context.catenary,
            tuple(own.pantograph for own in collectors),
            tuple(own.distance for own in collectors[1:]),
            number + 1,
            context.speed,
            context.control_interval,
            Place(context.channels[0]).name.lower(),
            self._assumed,
        )
        self._base.reset(context)
        layout = context.layout
        self._columns = [layout.index(f"front force, {metres:g} m ahead") for metres in PLACES]
        self._scale = layout.scale[self._columns]
        self._limit = context.force_limit
        self._past = np.full(max(PAST) + 1, self._mean)

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action, (1,), for an observation."""
        ahead = observation[self._columns] * self._scale
        self._past = np.append(self._past[1:], ahead[0])
        observed = np.append(ahead, self._past[[-1 - steps for steps in PAST]]) - self._mean
        more = observed @ self._gains / self._limit
        return np.clip(self._base.act(observation) + more, -1.0, 1.0)


@remembered
def _gains(
    catenary: object,
    pantographs: tuple[object, ...],
    distances: tuple[float, ...],
    controlled: int,
    speed: float,
    interval: float,
    place: str,
    assumed: tuple[str, str, str],
) -> tuple[float, Array]:
    """Mean force in front (N), and gains of its deviations (N/N) at ``PLACES``, then times of ``PAST``."""
    base, actuator, sensors = assumed
    policy = find_policy(base or "passive")
    settings = run_settings(
        _wished(policy)
        | {
            "catenary": catenary,
            "pantographs": pantographs,
            "distances": distances,
            "controlled": controlled,
            "speed_kmh": to_kmh(speed),
            "control_interval": interval,
            "line_condition": "as-built",
            "actuator": f"{actuator}:place={place}",
            "sensors": sensors,
            "front": PLACES,
            "distance": DISTANCE,
        }
    )
    passes = [_Pass(settings, policy, seed) for seed in TRAINING[:PASSES]]
    response = _response(settings, policy, passes[:EXCITED])
    mean = float(np.mean([own.observed[BEGIN:, 0].mean() for own in passes]))
    observed = [own.features(mean) for own in passes]
    moved = [
        np.stack([np.convolve(each, response)[: len(each)] for each in features.T], axis=1)
        for features in observed
    ]
    x, z = (np.concatenate([each[BEGIN:] for each in some]) for some in (moved, observed))
    y = np.concatenate([own.force[BEGIN:] - own.force[BEGIN:].mean() for own in passes])
    normal = x.T @ x + RIDGE * z.T @ z + 1e-3 * len(x) * np.eye(x.shape[1])
    return mean, np.linalg.solve(normal, -x.T @ y)


def _wished(policy: Policy) -> dict[str, Any]:
    """Settings of a policy's observation, measured values unless it has others, and its washout."""
    return {"observation": "measured"} | wishes(policy)


class _Pass:
    """One pass under a seed: the observed force in front, commands, and the contact force that followed."""

    def __init__(
        self, settings: RunSettings, policy: Policy, seed: int, commands: Array | None = None
    ) -> None:
        """commands: (n,) (N), added to the policy's, for as many control steps as there are."""
        task = Task(settings)
        task.reset(0, np.random.default_rng(seed))
        policy.reset(task.context(0))
        columns = [task.layout.index(f"front force, {metres:g} m ahead") for metres in PLACES]
        scale, limit = task.layout.scale[columns], task.actuator.force_limit
        observed: list[Array] = []
        given: list[float] = []
        while not task.results.flags[0].any():
            observed.append(task.results.observation[0, columns] * scale)
            given.append(0.0 if commands is None else commands[len(given) % len(commands)])
            action = policy.act(task.results.observation[0].copy()) + given[-1] / limit
            task.step(action[None])
        own = task.trajectory(0, last=True).controlled
        count = len(given) * task.length.control_steps
        force = low_pass(own.contact_force, own.time_step)[-count:]
        self.observed, self.given = np.array(observed), np.array(given)
        self.force = force.reshape(len(given), -1).mean(axis=1)

    def features(self, mean: float) -> Array:
        """Deviations of the observed force, at places ahead and in the past, (n, gains)."""
        ahead = self.observed - mean
        here = ahead[:, 0]
        past = [np.concatenate([np.zeros(steps), here[: len(here) - steps]]) for steps in PAST]
        return np.concatenate([ahead, np.stack(past, axis=1)], axis=1)


def _response(settings: RunSettings, policy: Policy, without: list[_Pass]) -> Array:
    """Contact force by commands 0, 1, ... control steps ago, (RESPONSE,) (N/N), in the mean along a line."""
    acted, changed = [], []
    for seed, own in zip(TRAINING, without, strict=False):
        random = np.random.default_rng(seed)
        commands = np.repeat(random.choice([-PULSES, PULSES], len(own.force)), PULSE_STEPS)
        excited = _Pass(settings, policy, seed, commands)
        given = excited.given
        rows = [np.concatenate([np.zeros(k), given[: len(given) - k]]) for k in range(RESPONSE)]
        acted.append(np.stack(rows, axis=1)[BEGIN:])
        changed.append((excited.force - own.force)[BEGIN:])
    x, y = np.concatenate(acted), np.concatenate(changed)
    return np.asarray(np.linalg.solve(x.T @ x + 1e2 * np.eye(RESPONSE), x.T @ y))
