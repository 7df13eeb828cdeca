"""What the infos of the single and of the vector environment hold: the same, under the same keys."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from ..control import Task
from ..metrics.figures import Figures
from ..plant.state import Row
from .lanes import Answer, answer_of

# Rows of a sample as plain integers: members of an enum would take longer.
CONTACT_FORCE, HEAD, WIRE = int(Row.CONTACT_FORCE), int(Row.HEAD_HEIGHT), int(Row.WIRE_HEIGHT)
FRAME_FORCE, HEAD_FORCE = int(Row.FRAME_FORCE), int(Row.HEAD_FORCE)

FIGURES_TO_COME = {field.name: math.inf for field in fields(Figures)}
"""Figures of an episode that has not ended. Recorders want the same keys in every info, and nan would not do:
no two infos with nan are equal, which Gymnasium's checkers ask, and some learners refuse it."""


def told(figures: Figures) -> dict[str, float]:
    """Figures of an ended episode for infos: infinite where it has none, as uplift without supports."""
    return {name: math.inf if math.isnan(value) else value for name, value in figures.as_dict().items()}


def lane_infos(answer: Answer) -> dict[str, Any]:
    """Infos of lanes as Gymnasium's vector environments have them.

    Each key holds an array with a value per lane, or a dictionary of such; "_key" marks who has it.
    """
    _, rewards, sample, position, speed_kmh, _, _, lanes = answer
    _, cost_function, contact_loss, effort, rate, mean_force = rewards
    return {
        "contact_force": sample[CONTACT_FORCE],
        "_contact_force": lanes,
        "head": sample[HEAD],
        "_head": lanes,
        "wire": sample[WIRE],
        "_wire": lanes,
        "frame_force": sample[FRAME_FORCE],
        "_frame_force": lanes,
        "head_force": sample[HEAD_FORCE],
        "_head_force": lanes,
        "position": position,
        "_position": lanes,
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
        },
        "_reward_terms": lanes,
    }


def lane_figures(figures: Mapping[int, Figures], lanes: int) -> dict[str, Any]:
    """Figures of the lanes whose episodes have ended, by lane, as they stand in infos."""
    mask = np.zeros(lanes, dtype=np.bool_)
    mask[list(figures)] = True
    values: dict[str, Any] = {}
    for name in FIGURES_TO_COME:
        values[name], values[f"_{name}"] = np.zeros(lanes), mask
    for lane, its in figures.items():
        for name, value in told(its).items():
            values[name][lane] = value
    return {"figures": values, "_figures": mask}


def first_info(task: Task) -> dict[str, Any]:
    """Info of the only lane of a task at the start of its episode."""

    def of_lane(infos: dict[str, Any]) -> dict[str, Any]:
        plain = {key: value for key, value in infos.items() if not key.startswith("_")}
        return {k: of_lane(each) if isinstance(each, dict) else each.item() for k, each in plain.items()}

    return of_lane(lane_infos(answer_of(task, np.ones(1, dtype=np.bool_)))) | {
        "figures": FIGURES_TO_COME.copy()
    }
