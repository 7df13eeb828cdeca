"""Episodes of the single and the vector environment: their settings, their tasks and their length."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec

from ..base.errors import InputError
from ..control import Task
from ..control.lines import draws_line, on_drawn_line, on_example
from ..control.settings import RunSettings, check_names, read_settings


class Episodes:
    """Episodes with the same settings, on one line or each on a line that is drawn for it."""

    def __init__(self, settings: RunSettings, **of_task: Any) -> None:
        """of_task: arguments of ``Task``. Raises InputError where the settings are not valid together."""
        self.settings, self._of_task = settings, of_task
        self.draws_line = draws_line(settings)
        self.task = Task(on_example(settings), **of_task)
        """The task of all episodes. Where lines are drawn: one on an example, to know the spaces by."""
        for line in settings.catenary[1:] if isinstance(settings.catenary, tuple) else ():
            Task(settings.on_line(line), keep_samples=False)  # each is possible

    def draw(self, random: Callable[[], np.random.Generator]) -> Task:
        """The task of an episode, on a line drawn from the generator where lines are drawn."""
        if not self.draws_line:
            return self.task
        return Task(on_drawn_line(self.settings, random), **self._of_task)

    def with_options(self, options: Mapping[str, Any]) -> Episodes:
        """Episodes with ``options``: arguments of the environment, only for these episodes.

        Raises InputError where they are not valid, or would change a space.
        """
        check_names(options, "option")
        if not options:
            return self
        settings = read_settings(dict(self.settings) | dict(options), type(self.settings))
        others = Episodes(settings, **self._of_task)
        if others._spaces != self._spaces:
            raise InputError(
                f"The options {', '.join(options)} would change the observation or action space; "
                "make another environment for that."
            )
        return others

    @property
    def _spaces(self) -> tuple[Any, ...]:
        """What an observation and an action consist of."""
        layout = self.task.layout
        names = [entry.name for entry in layout.entries]
        scales = [] if layout.normalise else [(entry.centre, entry.scale) for entry in layout.entries]
        return layout.kind, layout.normalise, names, scales, self.task.actuator.places

    @property
    def most_control_steps(self) -> int | None:
        """Control steps of the longest possible episode; None where that depends on the line drawn."""
        return None if self.draws_line else self.task.length.most_control_steps


def with_longest_episode(spec: EnvSpec | None, steps: int | None) -> EnvSpec | None:
    """A copy of an environment's spec with the maximum steps of an episode, which wrappers read."""
    if spec is None:
        return None
    completed = copy.copy(spec)
    completed.max_episode_steps = steps
    # ``make_vec`` also adds it to the arguments; left there, a spec made from this one would differ.
    completed.kwargs = {name: value for name, value in spec.kwargs.items() if name != "max_episode_steps"}
    return completed
