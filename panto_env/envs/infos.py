"""Infos of the single and the vector environment: the same content under the same keys."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.arrays import Array, to_kmh
from ..control import Task
from ..control.episode import Flags, Results
from ..control.state import Result
from .lanes import Answer, ended_figures

# Rows of results as plain integers: members of an enum would take longer.
REWARD, TERM = int(Result.REWARD), int(Result.TERM)
CONTACT_FORCE, HEAD, WIRE = int(Result.CONTACT_FORCE), int(Result.HEAD_HEIGHT), int(Result.WIRE_HEIGHT)
FRAME_FORCE, HEAD_FORCE = int(Result.FRAME_FORCE), int(Result.HEAD_FORCE)
POSITION, COST = int(Result.POSITION), int(Result.COST)


def final_figures(task: Task, row: int = 0) -> dict[str, float]:
    """Figures of the ended episode of a task's only lane, for infos, without those that it does not have.

    row: of one of the controlled pantographs. Neither nan nor infinity stands for what is missing: strict
    JSON refuses both, and nan makes two infos unequal.
    """
    figures = {name: float(value[0]) for name, value in ended_figures(task, np.array([row])).items()}
    return {name: value for name, value in figures.items() if math.isfinite(value)}


def own_info(values: Array) -> dict[str, Any]:
    """Info of one of several controlled pantographs; values: its rows of ``Result``."""
    own = {"reward": REWARD, "cost": COST, "contact_force": CONTACT_FORCE, "position": POSITION}
    return {name: float(values[row]) for name, row in own.items()}


def lane_infos(answer: Answer) -> dict[str, Any]:
    """Infos of lanes in the form of Gymnasium's vector environments.

    Each key holds an array with a value per lane, or a dictionary of such arrays; "_key" marks the lanes
    that have a value.
    """
    (_, values, _), speed_kmh, lanes = answer
    rows = values.T
    cost_function, contact_loss, effort, rate, mean_force, low_passed = rows[TERM:CONTACT_FORCE]
    return {
        "contact_force": rows[CONTACT_FORCE],
        "_contact_force": lanes,
        "head": rows[HEAD],
        "_head": lanes,
        "wire": rows[WIRE],
        "_wire": lanes,
        "frame_force": rows[FRAME_FORCE],
        "_frame_force": lanes,
        "head_force": rows[HEAD_FORCE],
        "_head_force": lanes,
        "position": rows[POSITION],
        "_position": lanes,
        "cost": rows[COST],
        "_cost": lanes,
        "speed_kmh": speed_kmh,
        "_speed_kmh": lanes,
        "reward_terms": {
            "cost_function": cost_function,
            "_cost_function": lanes,
            "contact_loss": contact_loss,
            "_contact_loss": lanes,
            "effort": effort,
            "_effort": lanes,
            "rate": rate,
            "_rate": lanes,
            "mean_force": mean_force,
            "_mean_force": lanes,
            "low_passed": low_passed,
            "_low_passed": lanes,
        },
        "_reward_terms": lanes,
    }


def lane_figures(figures: Mapping[str, Array], lanes: Flags) -> dict[str, Any]:
    """Infos with the figures, (lanes,), by name, of the lanes whose episodes have ended.

    A figure that a lane does not have is 0 there, and not marked under "_name"; one that none has is left
    out.
    """
    values: dict[str, Any] = {}
    for name, value in figures.items():
        marked = lanes & np.isfinite(value)
        if marked.any():
            values[name], values[f"_{name}"] = np.where(marked, value, 0.0), marked
    return {"figures": values, "_figures": lanes.copy()}


def first_info(task: Task) -> dict[str, Any]:
    """Info of the only lane of a task at the start of its episode, of its first controlled pantograph."""

    def of_lane(infos: dict[str, Any]) -> dict[str, Any]:
        plain = {key: value for key, value in infos.items() if not key.startswith("_")}
        return {k: of_lane(each) if isinstance(each, dict) else each.item() for k, each in plain.items()}

    observation, values, flags = task.results
    first = Results(observation[:1], values[:1], flags[:1])
    answer = Answer(first, to_kmh(task.speed), np.ones(1, dtype=np.bool_))
    return of_lane(lane_infos(answer))
