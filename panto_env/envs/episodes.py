"""What the single and the vector environment do alike about episodes: their options, and their longest."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from gymnasium.envs.registration import EnvSpec

from ..base.errors import InputError
from ..control import Task
from ..control.settings import check_names, read_settings


def task_with_options(usual: Task, options: Mapping[str, Any]) -> Task:
    """The task of an episode with ``options``: arguments of the environment, for this episode alone.

    Without any it is ``usual``. Raises InputError where they are not valid, or would change a space.
    """
    check_names(options, "option")
    if not options:
        return usual
    settings = read_settings(dict(usual.settings) | dict(options), type(usual.settings))
    task = Task(settings, lanes=usual.lanes, keep_samples=usual.keep_samples)
    if task.layout != usual.layout or task.actuator.places != usual.actuator.places:
        raise InputError(
            f"The options {', '.join(options)} would change the observation or action space; "
            "make another environment for that."
        )
    return task


def with_longest_episode(spec: EnvSpec | None, steps: int) -> EnvSpec | None:
    """The spec of an environment whose longest episode has ``steps``: wrappers ask how long it is."""
    if spec is None:
        return None
    told = copy.copy(spec)
    told.max_episode_steps = steps
    # ``make_vec`` adds it to the arguments as well: were it left there, a spec made of this one would differ.
    told.kwargs = {name: value for name, value in spec.kwargs.items() if name != "max_episode_steps"}
    return told
