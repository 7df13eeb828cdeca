"""The problem of an oracle: the minimum σ over some spans of one pass, at the passive run's mean force."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from panto_env import Trajectory, simulate
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.control import passive_mean, trim_of_pass
from panto_env.control.extent import whole_steps
from panto_env.control.lines import on_drawn_line
from panto_env.control.settings import far_enough, run_settings
from panto_env.metrics.low_pass import low_pass_from, settled_at
from panto_env.metrics.spans import SpanChoice

from ..benchmark.settings import Tape
from .knots import Knots, without_limits
from .lanes import Stretch

LEAD = 2.0
"""Time (s) before the evaluated spans from which the actuator may act."""
MEMORY = 3.0
"""Time (s) after which a change of a knot hardly affects the contact force any more."""
PUSH = 5.0
"""Change of a knot (N) by which responses are measured: with less, each slackening dropper shows singly."""
RESOLUTION = 0.01
"""Time (s) between samples of the filtered force in the least squares: it has little content above 20 Hz."""


class Problem:
    """One pass along one line, and how the contact force over its evaluated spans depends on the knots."""

    def __init__(self, given: Mapping[str, Any], seed: int = 0, spans: SpanChoice = None) -> None:
        """given: settings of a run, by name; by default it goes on until its start has died out.

        Raises InputError for settings that are not valid, or if the passive run ends early.
        """
        settings = far_enough(on_drawn_line(run_settings(given), lambda: np.random.default_rng(seed)))
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
        self.spans = covered
        self.figures = passive.summary(spans)
        self.chosen = spans
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

    @property
    def rows(self) -> Any:
        """Samples of the least squares, counted from the first knot's."""
        return self._inside[:: self.every]

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
