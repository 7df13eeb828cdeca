"""The record of a lane's run with its identity, its figures so far, and why it ended early or diverged."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, to_kmh
from ..base.checksums import __version__
from ..base.errors import InputError
from ..base.files import finite
from ..catalog.values import by_value
from ..metrics.compliance import LineFacts
from ..metrics.trajectory import Trajectory
from ..plant.pantograph.schema import PantographData
from ..plant.plant import Plant
from ..plant.state import LARGEST_HEIGHT, LARGEST_SPEED, Ending, Row, reason
from .observation import NOT_OF_A_RUN
from .passive_run import named, target_mean
from .settings import RunSettings
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


def figures_of(task: Task, rows: Any) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Figures of several rows, (n,), by name, and which of them have none, because they diverged."""
    lanes, agents = np.divmod(np.arange(task.lanes * task.agents)[rows], task.agents)
    collectors = np.array(task.episode.controlled)[agents]
    table, run = task.episode.table[rows], task.plant.run.table[collectors, lanes]
    supports, peak = task.plant.model.supports, task.running.peak[rows]
    behind = np.array([own.distance for own in task.plant.train.collectors])[collectors]
    stride, steps, samples = run[:, Row.STRIDE], run[:, Row.STEP], table[:, TaskRow.SAMPLES]
    with np.errstate(over="ignore", invalid="ignore"):  # of a computation that diverged
        shift = table[:, TaskRow.DEVIATION] / samples
        mean = run[:, Row.NOMINAL_FORCE] + shift
        std = np.sqrt(np.maximum(table[:, TaskRow.SQUARED_DEVIATION] / samples - shift**2, 0.0))
        begin = steps - samples
        shifted = task.plant.ahead(lanes, np.stack([begin, steps], axis=1)).T
        # Positions of the first and last sample: half a step before each end.
        first = (begin - 0.5) * stride + shifted[0] - behind
        last = (steps - 0.5) * stride + shifted[1] - behind
        passed = (supports > first[:, None] - 1e-6) & (supports < last[:, None] + 1e-6)
        largest = np.max(np.where(passed, peak, -np.inf), axis=1, initial=-np.inf)
        changes = np.maximum(samples - 1, 1.0)
        figures = {
            "mean": mean,
            "std": std,
            "statistical_max": mean + 3 * std,
            "statistical_min": mean - 3 * std,
            "max": table[:, TaskRow.MAX],
            "min": table[:, TaskRow.MIN],
            "max_uplift": np.where(passed.any(axis=1), largest, np.nan),
            "contact_loss": 100 * table[:, TaskRow.ALL_LOSS_STEPS] / samples,
            "cost_function": table[:, TaskRow.ALL_COST],
            "effort": np.sqrt(table[:, TaskRow.SQUARED_EFFORT] / samples),
            "effort_rate": np.sqrt(table[:, TaskRow.SQUARED_CHANGE] / changes) / task.plant.time_step,
            "distance": samples * stride + (shifted[1] - shifted[0]),
        }
    distance = figures["distance"]
    deviation = np.where(distance > 0, figures["cost_function"] / np.maximum(distance, 1e-9), 0.0)
    shares = np.array([own.share_at_head for own in task.settings.riding])[collectors]
    deviation = deviation - (1.0 - shares) * run[:, Row.NOMINAL_FORCE]  # at least so much
    return figures, diverged(task, rows, deviation, run[:, Row.WIRE_HEIGHT])


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


OF_TRAINS = ("pantographs", "distances", "controlled")
"""Settings that say nothing of a train with one pantograph."""


def plain(settings: RunSettings) -> dict[str, Any]:
    """Settings by name as plain data; line and pantograph only by their names."""
    alone = () if settings.pantographs else OF_TRAINS
    values = settings.model_dump(mode="json", exclude={*NOT_OF_A_RUN, *alone}, serialize_as_any=True)
    names: dict[str, Any] = {name: getattr(settings, name).name for name in ("catenary", "pantograph")}
    if settings.pantographs:
        names["pantographs"] = [own.name for own in settings.pantographs]
    table: dict[str, Any] = finite(values | names)
    return table


def identity(settings: RunSettings, plant: Plant, distance: float) -> dict[str, Any]:
    """Identity of a run over ``distance`` (m): version, settings, time step (s), spans and grid."""
    resulting = {"time_step": plant.time_step, "spans": plant.spans, "distance": distance}
    grid = plant.model.grid or dict.fromkeys(("spacing", "window", "precision"))
    return {"version": __version__, **plain(settings), **resulting, **grid}


def settings_of(run: Trajectory) -> dict[str, Any]:
    """Settings with which a run can be repeated, but for those that only concern policies.

    The inverse of ``identity``. Raises KeyError or ValueError where something is missing or not valid.
    """
    design, known = run.designed, run.settings.get("known_pantograph")
    values = {"catenary": design.line, "pantograph": design.pantograph, "pantographs": design.pantographs}
    values["known_pantograph"] = PantographData.model_validate(known) if known else None
    given = {**run.settings, **values}.items()
    return {
        name: value for name, value in given if name in RunSettings.model_fields and value not in (None, ())
    }
