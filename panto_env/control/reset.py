"""Random values of an episode, drawn at its start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from ..plant.line_condition import DrawnLine, draw
from ..plant.pantograph.schema import PantographData, with_scatter
from ..plant.speed import DRIFT_ROWS, draw_drift
from ..plant.state import SAMPLE_ROWS, Ending, Row
from ..plant.wind import draw_side_wind, draw_wind
from .episode import Results
from .memory import forget
from .reward import limits
from .state import Result, TaskRow

if TYPE_CHECKING:
    from .task import Task

LaneGenerators = np.random.Generator | Callable[[int], np.random.Generator]
"""One random generator for all lanes, or a function from a lane's number to its generator."""


class Starts(NamedTuple):
    """Values that were drawn for some lanes."""

    speed: Array  # (lanes,): m/s
    line: Sequence[DrawnLine]  # of each lane
    pantographs: Sequence[Sequence[PantographData]]  # of each lane's collectors; empty where lanes are alike
    way: Array  # (lanes,): distance of the run-in (m)
    drift: Array | None  # (lanes, drifting): of the speeds; None where these are constant
    faults: Array | None  # (lanes, faults, entries of ``FaultArrays.table``); None where none are


def _draw(task: Task, lanes: Any, random: Callable[[int], np.random.Generator]) -> Starts:
    """Draw the starts of lanes, (n,), each from its own generator, which is only made where it is needed."""
    settings, plant, (low, high) = task.settings, task.plant, task.length.speed_range
    conditions, scatter, run_in = settings.line_condition, settings.pantograph_scatter, settings.run_in
    parts = len(plant.model.droppers), len(np.unique(plant.model.supports))
    lines_differ = len(conditions) > 1 or any(condition.random for condition in conditions)
    speed, way, rms = np.full(len(lanes), low), np.zeros(len(lanes)), settings.drift
    profile = settings.speed_profile
    knots = np.zeros(0) if profile is None else profile.rows(plant.time_step)
    faults = settings.faults
    if not (low < high or lines_differ or scatter or run_in or rms or any(each.drawn for each in faults)):
        unused = np.random.default_rng(0)
        steady = np.tile(np.append(np.zeros(DRIFT_ROWS), knots), (len(lanes), 1)) if knots.size else None
        same = np.array([each.draw(plant.time_step, unused) for each in faults])
        own_faults = np.tile(same, (len(lanes), 1, 1)) if faults else None
        return Starts(speed, [draw(conditions, unused, *parts)] * len(lanes), [], way, steady, own_faults)
    windy = any(condition.wind for condition in conditions)
    windy_across = any(condition.side_wind for condition in conditions)
    line, pantographs, drift, spoilt = [], [], [], []
    for k, lane in enumerate(lanes.tolist()):
        own = random(lane)
        if low < high:
            speed[k] = own.uniform(low, high)
        line.append(draw(conditions, own, *parts))
        if scatter:
            pantographs.append([with_scatter(designed, scatter, own) for designed in settings.riding])
        if run_in > 0:
            way[k] = plant.alignment.support(own.uniform(0, run_in))
        if rms > 0 or knots.size:
            waves = draw_drift(rms, plant.time_step, own) if rms > 0 else np.zeros(DRIFT_ROWS)
            drift.append(np.append(waves, knots))
        if windy:  # drawn last: all else is as in still air
            line[k] = replace(line[k], wind=draw_wind(line[k].condition.weather, plant.time_step, own))
        if windy_across:
            side_wind = draw_side_wind(line[k].condition.across, plant.time_step, own)
            line[k] = replace(line[k], side_wind=side_wind)
        if faults:  # drawn last: all else is as without them
            spoilt.append([each.draw(plant.time_step, own) for each in faults])
    drifts, rows = np.array(drift) if drift else None, np.array(spoilt) if spoilt else None
    return Starts(speed, line, pantographs, way, drifts, rows)


def reset(task: Task, lanes: Any, random: LaneGenerators, results: Results) -> None:
    """Start episodes in lanes, (n,), and make their run-in; see ``Task.reset``."""
    plant, length = task.plant, task.length
    of_lane = random if callable(random) else lambda _: random
    drawn = _draw(task, lanes, of_lane)
    forces = task.static_forces(drawn.speed)
    plant.start(lanes, drawn.speed, drawn.line, drawn.pantographs, forces, drawn.drift)
    if drawn.faults is not None:
        task.episode.faults.table[lanes] = drawn.faults
    run_in = np.round(drawn.way / (drawn.speed * length.control_interval))
    end = length.plant_steps(drawn.speed, run_in, drawn.drift)
    # A collector behind the first comes onto the line later: its episode begins there.
    distances = [plant.train.collectors[number].distance for number in task.episode.controlled]
    if distances[0] > 0:
        steps = length.plant_steps(drawn.speed, run_in, drawn.drift, distances[0])
        run_in = steps // length.control_steps
    run_in = np.minimum(run_in, end // length.control_steps - 1).astype(np.int64)
    counted_from = np.zeros((len(distances), len(lanes)))
    for agent, distance in enumerate(distances):
        if uncounted := distance - distances[0] + length.settling:
            counted_from[agent] = length.plant_steps(drawn.speed, run_in, drawn.drift, uncounted)
    at_start = [_at_start(task, agent, lanes) for agent in range(task.agents)]
    _begin(task, lanes, at_start, end, counted_from)
    plant.clear(task.samples, lanes)
    samples = plant.run.table[:, lanes, :SAMPLE_ROWS]
    task.sensors.reset(lanes, samples)
    if task.keep_samples:
        task.samples.rows[lanes, 0] = samples.swapaxes(0, 1)
    if task.odometers.drawn:
        for row in _rows(task, lanes).ravel().tolist():
            own = of_lane(row // task.agents)
            task.odometers.start(task.episode.odometer, row, own, task.noise is not None)
    if task.noise is not None:
        for lane in lanes.tolist():
            task.noise.start(task.sensors, lane, of_lane(lane))
    task.observe_start(lanes, results)
    ran = run_in > 0
    if ran.any():
        _run_in(task, lanes[ran], run_in[ran], [own[ran] for own in at_start], results)


def _rows(task: Task, lanes: Any) -> Any:
    return task.agents * lanes + np.arange(task.agents)[:, None]  # (agents, n)


def _at_start(task: Task, agent: int, lanes: Any) -> Array:
    """Rows of a controlled collector in lanes, (n, rows of ``TaskRow``), wherever their episodes begin."""
    collector = task.episode.controlled[agent]
    start, pantograph = task.plant.run.table[collector, lanes], task.settings.riding[collector]
    values = np.zeros((len(lanes), task.episode.table.shape[1]))
    values[:, TaskRow.MAX], values[:, TaskRow.MIN] = -np.inf, np.inf  # no figures yet
    nominal = start[:, Row.NOMINAL_FORCE]
    low = nominal.argmin()
    if not nominal[low] > 0:  # the reward is relative to it
        raise InputError(
            f"At {to_kmh(task.speed[lanes[low]]):g} km/h nothing presses '{pantograph.name}' "
            f"against the wire: its lift is {nominal[low]:g} N; give it a static_force or an "
            "aerodynamic_coefficient, or set a mean_force."
        )
    target, spread = task.targets(agent, task.speed[lanes], nominal)
    values[:, TaskRow.TARGET_SHIFT] = values[:, TaskRow.MEAN_DEVIATION] = target - nominal
    values[:, TaskRow.PER_SPREAD] = 1 / spread
    uplift, force = limits(task.settings.line, task.speed[lanes])
    values[:, TaskRow.UPLIFT_LIMIT], values[:, TaskRow.FORCE_LIMIT] = uplift, force
    return values


def _begin(task: Task, lanes: Any, at_start: Sequence[Array], end: Array, counted_from: Array) -> None:
    """Begin episodes in lanes, (n,), at their present positions.

    at_start: of each agent, from ``_at_start``. end, counted_from: plant steps from the line's start at which
    they end, (n,), and after which they count, (agents, n). Raises InputError where nothing of an episode
    would count.
    """
    episode, run = task.episode, task.plant.run.table
    for agent, rows in enumerate(_rows(task, lanes)):
        start, values = run[episode.controlled[agent], lanes], at_start[agent]
        counted = np.maximum(counted_from[agent], start[:, Row.STEP])
        if (counted >= end).any():
            raise InputError(
                f"After the {task.settings.settle:g} spans of settle nothing of the episode is left to "
                "count; set a distance, more spans, or a smaller settle."
            )
        values[:, TaskRow.END], values[:, TaskRow.COUNTED_FROM] = end, counted
        shifted = task.plant.ahead(lanes, np.stack([counted, end], axis=1))
        steady = (end - counted) * start[:, Row.STRIDE]
        values[:, TaskRow.DISTANCE] = steady + (shifted[:, 1] - shifted[:, 0])
        episode.table[rows] = values
        at_line_start = not start[:, Row.STEP].any()
        if episode.front.ahead.size and at_line_start:
            in_front = run[episode.front.collector[agent], lanes]
            episode.front.kept[rows] = in_front[:, Row.CONTACT_FORCE, None]  # at rest
        if episode.memory.ahead.size and at_line_start:
            deviates = episode.averages.shape[1] > 0  # at rest from its average by nothing
            forget(episode.memory, rows, start[:, Row.CONTACT_FORCE] * (not deviates))
        task.running.peak[rows] = -np.inf


def _run_in(task: Task, lanes: Any, steps: Any, at_start: Sequence[Array], results: Results) -> None:
    """Run lanes, just reset, for ``steps`` control steps each without control, and begin episodes there.

    at_start: of these lanes and each agent, from ``_at_start``.
    """
    left = np.zeros(task.lanes, dtype=np.int64)
    left[lanes] = steps
    task.coast(left, results)
    rows = _rows(task, lanes)
    before = task.episode.table[rows]
    for lane in lanes[before[0, :, TaskRow.ENDING] != Ending.NONE].tolist():
        raise InputError(task.ending(lane))
    _begin(task, lanes, at_start, before[0, :, TaskRow.END], before[..., TaskRow.COUNTED_FROM])
    # What the run-in would have earned and cost does not count.
    results.values[rows, : Result.CONTACT_FORCE] = results.values[rows, Result.COST] = 0.0
    if task.layout.history:  # filled after the run-in with its last readings
        first = TaskRow.ACTION + len(task.actuator.places)
        past, now = task.layout.earlier
        for own, values in zip(rows, before, strict=True):
            history = values[:, first:]
            latest = history[:, : history.shape[1] // task.layout.history]
            task.episode.table[own, first:] = np.tile(latest, task.layout.history)
            results.observation[np.ix_(own, past)] = results.observation[np.ix_(own, now)]
