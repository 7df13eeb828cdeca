"""A train in which policies drive some of the controlled pantographs, and the agent the others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from ..analysis.simulation import let_act
from ..base.errors import InputError
from ..control.arguments import checked
from ..control.observation import BOUND
from ..policies import errors_name, find_fitting_policy
from .lanes import REWARD
from .single import PantographEnv

Observation = NDArray[np.float32]


class DrivenByPolicies(
    gymnasium.Wrapper[Observation, Observation, Observation, Observation], RecordConstructorArgs
):
    """View of an environment of a train, whose agent controls all pantographs but those that policies drive.

    ``DrivenByPolicies(gymnasium.make("Pantograph-v0", pantographs=["dsa380", "dsa380"], distances=[200],
    controlled=[1, 2], washout=0), {1: "repetitive"})``: the first one is driven by that policy; action,
    observation and reward are those of the second, and so is whether it counts. Other infos are the train's.
    """

    def __init__(self, env: gymnasium.Env[Observation, Observation], policies: Mapping[int, Any]) -> None:
        """policies: by the number of its pantograph, 1 for the first: a name, a model file, or an object.

        Raises InputError unless they drive some, and not all, of the train's controlled pantographs, and
        the environment has the observation and the washout that each of them requests.
        """
        RecordConstructorArgs.__init__(self, policies=dict(policies))
        gymnasium.Wrapper.__init__(self, env)
        train = env.unwrapped
        if not isinstance(train, PantographEnv):
            raise InputError("DrivenByPolicies takes a PantographEnv; a vector environment has no such view.")
        self._train = train
        numbers = [number + 1 for number in train.task.episode.controlled]
        if not policies or not set(policies) < set(numbers):
            controlled = " and ".join(map(str, numbers))
            raise InputError(
                f"policies must drive some, and not all, of the controlled pantographs {controlled}, not "
                f"{' and '.join(map(str, policies)) or 'none'}."
            )
        try:
            self._drivers = {
                numbers.index(number): (find_fitting_policy(each, train.task.settings), each)
                for number, each in policies.items()
            }
        except InputError as error:
            clause = str(error).removesuffix(".")
            raise InputError(f"{clause[:1].upper()}{clause[1:]}.") from error
        self._rows = [row for row in range(len(numbers)) if row not in self._drivers]
        self._places = len(train.task.actuator.places)
        entries = len(self._rows) * train.task.results.observation.shape[1]
        self.observation_space = gymnasium.spaces.Box(-BOUND, BOUND, (entries,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(self._rows) * self._places,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode, as ``PantographEnv.reset``, and prepare the policies for it."""
        _, info = self.env.reset(seed=seed, options=options)
        for row, (driver, name) in self._drivers.items():
            with errors_name(name, "reset"):
                driver.reset(self._train.task.context(row))
        return self._seen(), info

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold the agent's and the policies' actions for one control interval.

        Raises InputError for an action that is not valid, and changes nothing then but what the policies have
        seen.
        """
        task = self._train.task
        actions = np.zeros((task.agents, self._places), dtype=np.float32)
        own = checked(action, self.action_space.shape or ())
        actions[self._rows] = own.reshape(len(self._rows), -1)
        for row, (driver, name) in self._drivers.items():
            with errors_name(name, "act"):
                let_act(task, row, driver, actions[row])
        _, _, terminated, truncated, info = self.env.step(actions.reshape(-1))
        reward = float(task.results.values[self._rows, REWARD].mean())
        info["counts"] = bool(task.counts()[self._rows].any())
        return self._seen(), reward, terminated, truncated, info

    def _seen(self) -> Observation:
        return self._train.task.results.observation[self._rows].reshape(-1)
