"""A train as a PettingZoo environment: an agent for each controlled pantograph."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from ..base.errors import InputError
from ..control.arguments import checked
from ..control.observation import BOUND
from .episodes import checked_options
from .lanes import REWARD
from .settings import Whole
from .single import PantographEnv

Observation = NDArray[np.float32]


class PantographParallelEnv(Whole, ParallelEnv):  # type: ignore[misc]
    """The controlled pantographs of a train as agents, "pantograph_1" in front.

    ``panto_env.parallel_env(pantographs=["dsa380", "dsa380"], distances=[200], controlled=[1, 2])`` is a thin
    view of ``PantographEnv`` with the same arguments: the same task, of which each agent sees its own
    observation and reward. All act in every step, and their episodes end together; one that has not come onto
    the line yet waits, and its reward is 0. The info of an agent has its contact force, position, reward,
    cost and whether they count, the last one its figures.
    """

    metadata: dict[str, Any] = {"name": "pantograph_v0", "is_parallelizable": True}  # noqa: RUF012 - as PettingZoo declares it

    def __init__(self, **settings: Any) -> None:
        """Arguments of ``PantographEnv``. Raises InputError for a value that is not valid."""
        self.train = PantographEnv(**settings)
        self.metadata = self.train.metadata | PantographParallelEnv.metadata
        self.render_mode = self.train.render_mode
        numbers = [number + 1 for number in self.train.task.episode.controlled]
        self.possible_agents = [f"pantograph_{number}" for number in numbers]
        self.agents: list[str] = []
        seen = self.train.task.results.observation[0].shape
        self._shape = (len(self.train.task.actuator.places),)
        Box, names = gymnasium.spaces.Box, self.possible_agents
        self.observation_spaces = {name: Box(-BOUND, BOUND, seen, np.float32) for name in names}
        self.action_spaces = {name: Box(-1.0, 1.0, self._shape, np.float32) for name in names}

    def observation_space(self, agent: str) -> gymnasium.spaces.Box:
        """Space of an agent's observation, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """Space of an agent's action, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode of the train; as ``PantographEnv.reset``."""
        # PettingZoo's own test gives an option of this name, only to see that options are taken.
        known = {name: value for name, value in checked_options(options).items() if name != "options"}
        observation, info = self.train.reset(seed=seed, options=known)
        self.agents = list(self.possible_agents)
        return self._of_agents(observation), self._infos(info)

    def step(
        self, actions: dict[str, Observation]
    ) -> tuple[
        dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
    ]:
        """Hold the actions, one for each agent, for one control interval.

        Raises InputError, and changes nothing, where one is missing or not valid.
        """
        if not self.agents:
            raise InputError("The episode has not begun or has ended; call reset before step.")
        if not isinstance(actions, Mapping) or set(actions) != set(self.agents):
            raise InputError(f"There must be an action for each of {', '.join(self.agents)}.")
        force = np.concatenate([checked(actions[name], self._shape) for name in self.agents])
        observation, _, terminated, truncated, info = self.train.step(force)
        names = self.agents
        rewards = dict(zip(names, self.train.task.results.values[:, REWARD].tolist(), strict=True))
        ends = dict.fromkeys(names, terminated), dict.fromkeys(names, truncated)
        seen, infos = self._of_agents(observation), self._infos(info)
        if terminated or truncated:
            self.agents = []
        return seen, rewards, *ends, infos

    def render(self) -> NDArray[np.uint8] | None:
        """As ``PantographEnv.render``."""
        return self.train.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self.train.close()

    def state(self) -> Observation:
        """Observations of all agents, one after the other."""
        return self.train.task.results.observation.reshape(-1).copy()

    def _of_agents(self, observation: Observation) -> dict[str, Observation]:
        return dict(zip(self.agents, np.split(observation, len(self.agents)), strict=True))

    def _infos(self, info: dict[str, Any]) -> dict[str, dict[str, Any]]:
        return dict(zip(self.agents, info.get("pantographs", [info]), strict=True))
