"""Episodes of the single and the vector environment: their options and their maximum length."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from gymnasium.envs.registration import EnvSpec

from ..base.errors import InputError
from ..control import Task
from ..control.settings import check_names, read_settings


def task_with_options(usual: Task, options: Mapping[str, Any]) -> Task:
    """The task of an episode with ``options``: arguments of the environment, only for this episode.

    Without options it is ``usual``. Raises InputError where they are not valid, or would change a space.
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
    """A copy of an environment's spec with the maximum steps of an episode, which wrappers read."""
    if spec is None:
        return None
    completed = copy.copy(spec)
    completed.max_episode_steps = steps
    # ``make_vec`` also adds it to the arguments; left there, a spec made from this one would differ.
    completed.kwargs = {name: value for name, value in spec.kwargs.items() if name != "max_episode_steps"}
    return completed
