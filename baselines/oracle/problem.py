"""Forces that an actuator can apply, interval by interval, and the commands that produce them.

The unknowns of the oracle are not commands but knots: the forces at the ends of the control intervals. A
command beyond the limit of rate has no further effect, so its gradient is zero there and an optimiser of
commands would stop; for knots the same limits are linear inequalities.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, eye_array, vstack

from panto_env import Trajectory, simulate
from panto_env.analysis.pool import in_threads, workers_for
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.control import Task, passive_mean, trim_of_pass
from panto_env.control.length import arrays_of, check_record, whole_steps
from panto_env.control.lines import on_drawn_line
from panto_env.control.passive_run import Trim
from panto_env.control.settings import RunSettings, far_enough, run_settings
from panto_env.metrics.figures import SpanChoice
from panto_env.metrics.low_pass import low_pass_from, settled_at
from panto_env.plant.actuators import ActuatorSettings
from panto_env.plant.actuators.lagged import LaggedActuator
from panto_env.plant.state import SAMPLE_ROWS, Place, Row

from ..benchmark.settings import Tape

HALVINGS = 50  # number of halvings of the range in which the command for a knot is searched for
NEAR = 0.01  # a force counts as at a limit if it differs by less than this share of the limit


class Limits(NamedTuple):
    """Linear limits of a sequence of knots (N): -bound <= matrix @ knots <= bound."""

    matrix: csc_matrix  # (rows, knots)
    bound: Array  # (rows,): N


class Knots:
    """Knots of one actuator, which is at rest before the first one.

    For an actuator of a kind other than "lagged", a knot is the command itself; only the plant knows the
    force that follows.
    """

    def __init__(self, actuator: ActuatorSettings, time_step: float, steps: int) -> None:
        """time_step: of the plant (s); steps: of the plant in a control interval."""
        lagged = actuator if isinstance(actuator, LaggedActuator) else LaggedActuator()
        self.limit = actuator.force_limit
        self._steps = steps
        self._share = 1.0 if lagged.lag == 0 else -math.expm1(-time_step / lagged.lag)
        self._rate = math.inf if lagged.rate_limit is None else lagged.rate_limit * time_step
        self.reached = 1.0 - (1.0 - self._share) ** steps
        """Share of the way to its command that the force covers in an interval, without a rate limit."""
        self.maximum_change = steps * self._rate
        """Maximum change from one knot to the next (N)."""
        self.late = math.ceil(lagged.delay / time_step - 1e-6)
        """Plant steps from a command to its first effect."""

    def limits(self, count: int) -> Limits:
        """Limits of ``count`` knots of one actuator.

        A force is within its limit, changes no faster than its limit of rate, and no faster than under the
        maximum command: w[k] - w[k-1] <= reached (limit - w[k-1]), and the same downwards.
        """
        one, before = eye_array(count, format="csc"), eye_array(count, k=-1, format="csc")
        rows = [(one, self.limit)]
        if math.isfinite(self._rate):
            rows.append((one - before, self.maximum_change))
        if self.reached < 1.0:
            rows.append((one - (1.0 - self.reached) * before, self.reached * self.limit))
        parts, bounds = zip(*rows, strict=True)
        return Limits(csc_matrix(vstack(parts)), np.repeat(bounds, count))

    def within(self, knots: Array) -> Array:
        """Knots, (count, places), scaled down by one factor if they exceed the limits."""
        limits = self.limits(len(knots))
        excess = np.abs(limits.matrix @ knots) / limits.bound[:, None]
        return np.asarray(knots / max(1.0, float(excess.max())))

    def at_limits(self, knots: Array) -> float:
        """Share of knots, (count, places), that are at a limit of force or rate."""
        limits = self.limits(len(knots))
        near = np.abs(limits.matrix @ knots) >= (1.0 - NEAR) * limits.bound[:, None]
        return float(near.reshape(-1, *knots.shape).any(axis=0).mean())

    def commands(self, knots: Array) -> Array:
        """Commands (N), (..., count, places), within the limit, that take the force from knot to knot."""
        before = _before(knots)
        return np.clip(before + self._lead(knots - before), -self.limit, self.limit)

    def free_commands(self, knots: Array) -> Array:
        """Like ``commands``, for an actuator without limits of force and rate (``without_limits``)."""
        before = _before(knots)
        return np.asarray(before + (knots - before) / self.reached)

    def _lead(self, change: Array) -> Array:
        """Difference of command and force (N) with which the force makes this change in an interval."""
        if math.isinf(self._rate):
            return np.asarray(change / self.reached)
        size = np.abs(change)
        low, high = np.zeros_like(size), np.full_like(size, self.maximum_change + self._rate / self._share)
        for _ in range(HALVINGS):
            lead = 0.5 * (low + high)
            left = lead.copy()
            for _ in range(self._steps):
                left -= np.minimum(self._share * left, self._rate)
            enough = lead - left >= size
            low, high = np.where(enough, low, lead), np.where(enough, lead, high)
        return np.asarray(np.copysign(high, change))


def _before(knots: Array) -> Array:
    """The knot before each of (..., count, places); 0 before the first."""
    before = np.zeros_like(knots)
    before[..., 1:, :] = knots[..., :-1, :]
    return before


def without_limits(actuator: ActuatorSettings) -> ActuatorSettings:
    """The actuator without limits of force and rate, so that a change of one knot affects no other knot.

    An actuator of a kind other than "lagged" is returned unchanged.
    """
    if isinstance(actuator, LaggedActuator):
        return actuator.model_copy(update={"rate_limit": None, "force_limit": 1e5})
    return actuator


PUSHED = 48  # number of lanes of a group that compute responses to test forces


class Stretch:
    """A stretch of one line; each run begins in the state in which a passive train reaches it."""

    def __init__(
        self, settings: RunSettings, trim: Trim | None, seed: int, begin: int, control_steps: int
    ) -> None:
        """begin: control steps before the stretch; control_steps: within it; seed: of line and noise."""
        self._group = partial(_Group, settings, trim, seed, begin, control_steps)
        self._groups: dict[int, list[_Group]] = {}  # by the lanes of each

    def forces(self, commands: Array) -> Array:
        """Unfiltered contact force (N), (runs, samples), under commands (N), (runs, steps, places)."""
        jobs = workers_for(len(commands), None)
        lanes = -(-len(commands) // jobs)
        padded = np.zeros((jobs * lanes, *commands.shape[1:]))
        padded[: len(commands)] = commands
        work = zip(self._of(lanes, jobs), np.split(padded, jobs), strict=True)
        runs = in_threads([partial(group.run, part) for group, part in work])
        return np.concatenate(runs)[: len(commands)]

    def changes(self, commands: Array, push: Array, steps: int) -> Array:
        """Responses of the contact force (N), (steps, places, samples), to test forces.

        commands: (steps, places) (N), of the run that is varied. Each step and place gets a test of its own.
        push: (length,): added to the commands from that step on (N). steps: control steps followed.
        """
        pushes = [(step, place) for step in range(len(commands)) for place in range(commands.shape[1])]
        jobs = workers_for(len(pushes), None)
        found = in_threads(
            [
                partial(group.changes, commands, push, steps, pushes[job::jobs])
                for job, group in enumerate(self._of(PUSHED, jobs))
            ]
        )
        changes = np.empty((len(pushes), found[0].shape[1]))
        for job, part in enumerate(found):
            changes[job::jobs] = part
        return changes.reshape(*commands.shape, -1)

    def _of(self, lanes: int, jobs: int) -> list[_Group]:
        """Groups of lanes, made when first needed: ``jobs`` groups of ``lanes`` lanes."""
        groups = self._groups.setdefault(lanes, [])
        while len(groups) < jobs:
            groups.append(self._group(lanes))
        return groups[:jobs]


class _Group:
    """Lanes that one thread runs."""

    def __init__(
        self, settings: RunSettings, trim: Trim | None, seed: int, begin: int, control_steps: int, lanes: int
    ) -> None:
        task = Task(settings, lanes=lanes, keep_samples=False, trim=trim)
        task.reset(np.arange(lanes), lambda _: np.random.default_rng(seed))
        self._plant, self._steps = task.plant, task.length.control_steps
        self._places = [int(place) for place in task.actuator.places]
        self._first = begin * task.length.control_steps
        rows = self._first + control_steps * task.length.control_steps + 1
        collectors = len(task.plant.train.collectors)
        self._controlled = settings.controlled[0] - 1
        check_record(8.0 * lanes * (rows - self._first) * collectors * SAMPLE_ROWS, "the lanes of an oracle")
        # Rows before the stretch are never written, so they take no memory.
        self._samples = task.plant.samples(rows)._replace(uplift=np.zeros((lanes, 0, rows)))
        # One that rides behind others begins where it comes onto the line.
        rest = self._first - int(task.plant.of(0, Row.STEP, self._controlled))
        self._plant.advance_passively(rest, task.plant.samples(1)._replace(uplift=np.zeros((lanes, 0, 1))))
        moving = self._plant.model.wire, self._plant.actuators, self._plant.run
        self._moving = list(arrays_of(moving))
        self._start = [array.copy() for array in self._moving]

    def run(self, commands: Array) -> Array:
        """Contact force (N), (lanes, samples), under commands (N), (lanes, steps, places)."""
        self._restore(self._start)
        self._advance(commands)
        return self._force.copy()

    def _restore(self, contents: list[Array]) -> None:
        """Give the arrays of the plant's state their contents of an earlier time."""
        for array, content in zip(self._moving, contents, strict=True):
            np.copyto(array, content)

    def changes(self, commands: Array, push: Array, steps: int, pushes: list[tuple[int, int]]) -> Array:
        """Responses of the force (N), (pushes, samples), to test forces, each at a step and place, by step.

        Other arguments: see ``Stretch.changes``. All lanes advance under the unchanged commands. At the steps
        of the next tests they all have the same state; each lane then runs ahead with its own test force, and
        its state is restored.
        """
        self._restore(self._start)
        lanes, end, now = len(self._force), len(commands), 0
        forces = np.zeros((len(pushes), self._force.shape[1]))
        reach = []  # for each test force, the range of samples over which its response is followed
        for first in range(0, len(pushes), lanes):
            block = pushes[first : first + lanes]
            between = commands[now : block[0][0]]
            self._advance(np.broadcast_to(between, (lanes, *between.shape)))
            now, last = block[0][0], min(end, block[-1][0] + steps)
            here = [array.copy() for array in self._moving]
            changed = np.repeat(commands[None, now:last], lanes, axis=0)
            for lane, (step, place) in enumerate(block):
                tested = changed[lane, step - now : step - now + len(push), place]
                tested += push[: len(tested)]
            self._advance(changed)
            forces[first : first + len(block)] = self._force[: len(block)]
            reach += [(step * self._steps, min(last, step + steps) * self._steps) for step, _ in block]
            self._restore(here)
        self._advance(np.broadcast_to(commands[now:], (lanes, *commands[now:].shape)))
        plain = self._force[0]
        for force, (begin, stop) in zip(forces, reach, strict=True):
            force[begin:stop] -= plain[begin:stop]
            force[:begin] = force[stop:] = 0.0
        return forces

    @property
    def _force(self) -> Array:
        """Contact force of the controlled pantograph, recorded last (N), (lanes, samples of the stretch)."""
        return self._samples.rows[:, self._first + 1 :, self._controlled, Row.CONTACT_FORCE]

    def _advance(self, commands: Array) -> None:
        """Advance all lanes under commands (N), (lanes, steps, places)."""
        now = np.zeros((len(commands), self._samples.rows.shape[2], len(Place)))
        for step in range(commands.shape[1]):
            now[:, self._controlled, self._places] = commands[:, step]
            self._plant.advance(now, self._steps, self._samples)


LEAD = 2.0  # time (s) before the evaluated spans from which the actuator may act
MEMORY = 3.0  # time (s) after which a change of a knot hardly affects the contact force any more
PUSH = 5.0
"""Change of a knot (N) by which responses are measured: with less, each slackening dropper shows singly."""
RESOLUTION = 0.01
"""Time (s) between samples of the filtered force in the least squares: it has little content above 20 Hz."""


class Problem:
    """One pass along one line, and how the contact force over its evaluated spans depends on the knots."""

    def __init__(self, given: Mapping[str, Any], seed: int = 0, spans: SpanChoice = None) -> None:
        """given: settings of a run, by name; by default it goes on for ten spans after its start.

        Raises InputError for settings that are not valid, or if the passive run ends early.
        """

        def drawn(values: Mapping[str, Any]) -> RunSettings:
            return far_enough(on_drawn_line(run_settings(values), lambda: np.random.default_rng(seed)))

        if given.get("spans") is not None and given.get("distance") is None:
            given = {**given, "distance": drawn({**given, "spans": None}).distance}
        settings = drawn(given)
        if settings.speed_kmh[0] != settings.speed_kmh[1] or settings.run_in:
            raise InputError("An oracle takes one speed, without run_in.")
        if len(settings.controlled) > 1:
            numbers = " and ".join(map(str, settings.controlled))
            raise InputError(f"An oracle controls one pantograph of a train, not {numbers}; name one.")
        self.given, self.seed, self.settings = dict(given), seed, settings
        run = simulate(**self.given, seed=seed, record_droppers=False)
        self.passive = passive = run.controlled
        if passive.terminated:
            raise InputError(f"There is no oracle, because the passive run has no figures. {passive.ending}")
        covered = passive.spans(spans)
        self.spans, self.chosen, self.figures = covered, spans, passive.summary(spans)
        self.places = len(settings.actuator.places)
        self.interval = settings.control_interval
        self.steps = whole_steps(self.interval, passive.time_step)
        start = 0.0 if covered is None else passive.time_at(passive.alignment.limits(covered)[0])
        waited = round(passive.time[0] / passive.time_step - 0.5)
        """Plant steps before the controlled pantograph came onto the line."""
        inside = waited + np.flatnonzero(passive.inside(spans))
        self.first_action = math.ceil(passive.time_at(0.0) / self.interval - 1e-6)
        """Control step of a policy's first action, when the pantograph has come onto the line."""
        self.begin = max(self.first_action, int((start - LEAD) / self.interval + 1e-9))
        self.count = int(inside[-1]) // self.steps + 1 - self.begin
        """Number of knots of one actuator."""
        self._inside = inside - self.begin * self.steps  # samples evaluated, counted from the first knot's
        before = passive.contact_force[: self.begin * self.steps - waited]
        self.every = max(1, round(RESOLUTION / passive.time_step))
        """Evaluated samples from one row of the least squares to the next."""
        self.rows = self._inside[:: self.every]
        """Samples of the least squares, counted from the first knot's."""
        settled = settled_at(passive.contact_force[0], passive.time_step)
        self._filter_state = low_pass_from(settled, before, passive.time_step)[1] if len(before) else settled
        """State of EN 50317's filter, (sections, 2), at the first knot."""
        trim = trim_of_pass(settings, seed, None, passive_mean)
        self.knots = Knots(settings.actuator, passive.time_step, self.steps)
        self._true = Stretch(settings, trim, seed, self.begin, self.count)
        free = settings.model_copy(update={"actuator": without_limits(settings.actuator)})
        self._free = self._true if free == settings else Stretch(free, trim, seed, self.begin, self.count)

    def forces(self, knots: Array) -> Array:
        """Filtered contact force (N), (runs, samples evaluated), under knots (N), (runs, count, places)."""
        actions = self.knots.commands(knots) / self.knots.limit
        return self._filtered(self._true.forces(actions * self.knots.limit))[:, self._inside]

    def response(self, knots: Array) -> Array:
        """Change of the filtered force per change of each knot (N/N), (rows, count * places).

        Rows are evaluated samples ``RESOLUTION`` apart. Each knot, (count, places), is changed by ``PUSH`` in
        the true plant, with an actuator without limits of force and rate, and followed for ``MEMORY``.
        """
        push = self.knots.free_commands(np.array([[PUSH], [0.0]]))[:, 0]
        followed = max(1, round(MEMORY / self.interval))
        changes = self._free.changes(self.knots.free_commands(knots), push, followed)
        state = settled_at(np.zeros(changes.shape[:2]), self.passive.time_step)
        filtered = low_pass_from(state, changes, self.passive.time_step)[0][:, :, self.rows] / PUSH
        return filtered.reshape(-1, len(self.rows)).T

    def response_along(self, knots: Array, basis: Array) -> Array:
        """Change of the filtered force per combination of knots (N/N), (rows, directions).

        basis: (knots of all places, directions). One whole run per direction, with the knots changed by
        ``PUSH`` (rms) along it: far cheaper for few directions.
        """
        sizes = PUSH / np.sqrt(np.mean(basis**2, axis=0))
        pushed = knots + (sizes * basis).T.reshape(-1, *knots.shape)
        commands = self.knots.free_commands(np.concatenate([knots[None], pushed]))
        forces = self._filtered(self._free.forces(commands))[:, self.rows]
        return np.asarray(((forces[1:] - forces[0]) / sizes[:, None]).T)

    def replay(self, commands: Array) -> Trajectory:
        """The controlled pantograph's pass as ``simulate`` runs it under commands (N), (count, places)."""
        rest = np.zeros((self.begin - self.first_action, self.places))
        actions = np.concatenate([rest, commands / self.knots.limit, np.zeros((1, self.places))])
        run = simulate(**self.given, policy=Tape(actions), seed=self.seed, record_droppers=False)
        return run.controlled

    def _filtered(self, force: Array) -> Array:
        """Force (N), (runs, samples), from the first knot on, low-passed as EN 50317 says."""
        state = np.repeat(self._filter_state[:, None], len(force), axis=1)
        return low_pass_from(state, force, self.passive.time_step)[0]
