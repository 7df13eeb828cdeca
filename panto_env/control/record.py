"""The record of a lane's run, and the messages for a run that ended early or diverged."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from ..catalog.values import by_value
from ..metrics.compliance import LineFacts
from ..metrics.trajectory import Trajectory
from ..plant.state import LARGEST_HEIGHT, LARGEST_SPEED, Ending, Row, reason
from .identity import identity
from .passive_run import named, target_mean
from .state import TaskRow

if TYPE_CHECKING:
    from .task import Task

LARGEST_DEVIATION = 2e3
"""Mean deviation of the contact force from its static value (N), ten times any real one: it has diverged."""

SERIES = {"head": Row.HEAD_HEIGHT, "frame": Row.FRAME_HEIGHT, "wire": Row.WIRE_HEIGHT} | {
    row.name.lower(): row
    for row in (Row.CONTACT_FORCE, Row.HEAD_VELOCITY, Row.FRAME_VELOCITY, Row.FRAME_FORCE, Row.HEAD_FORCE)
}
"""Rows of samples that a record has under these names."""


def diverged(task: Any, rows: Any, deviation: Array, height: Array) -> NDArray[np.bool_]:
    """Whether rows, (n,), have diverged, as their ending or an impossible value shows.

    deviation: mean, from what springs leave of the nominal force (N). height: of the wire (m).
    """
    possible = (deviation < LARGEST_DEVIATION) & (np.abs(height) < LARGEST_HEIGHT)
    endings = task.episode.table[rows, TaskRow.ENDING]
    return np.asarray(~possible | (endings == Ending.DIVERGED))


def divergence(task: Task, lane: int) -> str:
    """Message that a lane's computation diverged, and what to do."""
    plant = task.plant
    way_out = (
        "the loop of the rig may be unstable, see panto rig --stability"
        if plant.catenary.kind == "rig"
        else f"use a time_step below {1e3 * plant.time_step:g} ms, a finer spacing, or a softer or less "
        "damped contact"
    )
    return (
        f"The computation of {named(task.settings.riding)} on '{plant.catenary.name}' at "
        f"{to_kmh(task.speed[lane]):g} km/h diverged, so it has no result: "
        f"{_bound(task, lane)}; {way_out}."
    )


def _bound(task: Task, lane: int) -> str:
    """Which bound a lane's computation passed that nothing passes but what diverges, as a clause."""
    rows = task.plant.run.table[:, lane]
    for what, row in (("the collector head", Row.STATE), ("the contact wire", Row.WIRE_HEIGHT)):
        height = rows[np.abs(rows[:, row]).argmax(), row]
        if not abs(height) <= LARGEST_HEIGHT:
            return f"{what} came to a height of {height:.3g} m, which is not within ±{LARGEST_HEIGHT:g} m"
    if _ending(task, lane) is Ending.DIVERGED:
        return f"a wire moved faster than {LARGEST_SPEED:g} m/s"
    return f"the contact force was over {LARGEST_DEVIATION:,g} N from its static value in the mean"


def trajectory(
    task: Task, lane: int, policy: str = "passive", seed: int = 0, *, last: bool = False
) -> Trajectory:
    """Record of a lane's run so far, of the first collector with those of the others as its followers.

    last: the task does not run any more, so the record may take over its arrays. Raises InputError where
    the computation diverged.
    """
    collectors = range(len(task.plant.train.collectors))
    first, *followers = (_of_collector(task, lane, number, policy, seed, last) for number in collectors)
    return replace(first, followers=tuple(followers)) if followers else first


def _of_collector(task: Task, lane: int, collector: int, policy: str, seed: int, last: bool) -> Trajectory:
    plant, nominal_force = task.plant, task.plant.of(lane, Row.NOMINAL_FORCE, collector)
    steps, pantograph = int(plant.of(lane, Row.STEP)), task.settings.riding[collector]
    position = plant.position(lane, np.arange(steps) + 0.5, collector)
    on_line = slice(int(np.searchsorted(position, 0.0)), steps)
    rows = task.samples.rows[lane, 1 : steps + 1, collector][on_line]
    if len(rows):
        deviation = np.mean(np.abs(rows[:, Row.CONTACT_FORCE] - pantograph.share_at_head * nominal_force))
        highest = np.max(np.abs(rows[:, Row.WIRE_HEIGHT]))
        row = np.array([lane * task.agents])
        if diverged(task, row, deviation[None], highest[None])[0]:
            raise InputError(divergence(task, lane))
    second = task.samples.second[lane, 1 : steps + 1, collector]
    uplift = task.samples.uplift[lane, :, 1 : steps + 1][:, on_line].T
    tension = task.samples.tension[lane, 1 : steps + 1][on_line]
    controlled, several = collector in task.episode.controlled, task.settings.pantographs
    design: dict[str, Any] = {"catenary": by_value(plant.catenary), "pantograph": by_value(pantograph)}
    target = target_mean(task.settings, float(task.speed[lane]), collector)
    if several:
        design["pantographs"] = [by_value(own) for own in several]
    return Trajectory(
        time=(np.arange(steps) + 0.5)[on_line] * plant.time_step,
        position=position[on_line],
        **{name: rows[:, row].copy() for name, row in SERIES.items()},
        uplift=uplift if last else uplift.copy(),
        support_position=plant.model.supports,
        dropper_force=tension if last else tension.copy(),
        dropper_position=plant.model.droppers if task.record_droppers else np.zeros(0),
        catenary=plant.catenary.name,
        pantograph=pantograph.name,
        speed=float(task.speed[lane]),
        alignment=plant.alignment,
        time_step=plant.time_step,
        nominal_force=nominal_force,
        target_mean=math.nan if target is None else target,
        settings=identity(task.settings, plant, task.length.own_distance),
        policy=policy if controlled else "passive",
        seed=seed,
        terminated=_ending(task, lane) is not Ending.NONE,
        ending=ending(task, lane),
        line=LineFacts.of(plant.catenary, plant.model.wave_speed, float(task.speed[lane])),
        design=design,
        reached=float(plant.position(lane, steps, collector)[0]) if collector else math.nan,
        second_force=second[on_line].copy() if len(second) else np.zeros(0),
    )


def ending(task: Task, lane: int) -> str:
    """Where and why a lane's run ended early, as a sentence; empty if it did not."""
    which = _ending(task, lane)
    if which is Ending.NONE:
        return ""
    plant = task.plant
    steps, line = plant.of(lane, Row.STEP), plant.catenary
    why = reason(which, line.free_uplift) + (f": {_bound(task, lane)}" if which is Ending.DIVERGED else "")
    time, position = steps * plant.time_step, float(plant.position(lane, steps)[0])
    span = plant.alignment.span_name(plant.alignment.span_of(position))
    return f"The run ended early at {position:.1f} m (span {span}, {time:.2f} s): {why}."


def _ending(task: Task, lane: int) -> Ending:
    return Ending(int(task.episode.table[lane * task.agents, TaskRow.ENDING]))
