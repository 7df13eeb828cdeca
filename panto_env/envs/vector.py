"""The native vector environment: many lanes in one kernel call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..base.errors import InputError
from ..control import Task
from ..control.arguments import takes
from ..control.observation import BOUND
from ..control.settings import read_settings
from ..control.state import TERMS
from .settings import VectorSettings
from .single import checked

Lanes = NDArray[np.bool_]


class PantographVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """Many pantographs, each on a line of its own, stepped together on all cores.

    `gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=N)`; arguments as for `PantographEnv`, one
    speed, line irregularity and noise drawn for each lane. Lane i, seeded seed + i, sees bit for bit what a
    single environment seeded so sees. `autoreset_mode` is "NextStep" (as Gymnasium's default), "SameStep"
    or "Disabled", where `reset(options={"reset_mask": ...})` begins anew in the lanes marked.

    `infos` holds arrays with a value per lane ("contact_force" (N), "position" (m), the reward's terms) and,
    for lanes whose episode ends, "figures".
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    @takes(VectorSettings)
    def __init__(self, given: dict[str, Any]) -> None:
        """See the class. Raises InputError for a value that is not valid, TypeError for an unknown name."""
        settings = read_settings(given, VectorSettings)
        self.autoreset_mode = settings.autoreset_mode
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.num_envs = settings.num_envs
        self.render_mode = None
        self.task = Task(settings, lanes=self.num_envs, keep_samples=False)
        episode = self.task.episode
        self.single_observation_space = gymnasium.spaces.Box(
            -BOUND, BOUND, episode.observation[0].shape, np.float32
        )
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, episode.action[0].shape, np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._random: list[np.random.Generator] = []
        self._ended: Lanes = np.zeros(self.num_envs, dtype=np.bool_)
        self._any_ended = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start episodes in all lanes, or in those of ``options["reset_mask"]``, (num_envs,) of bool.

        seed: of lane 0, lane i having seed + i; or one per lane.
        """
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        if options:
            raise InputError(f"Unknown option '{next(iter(options))}': known is reset_mask.")
        lanes = self._masked(mask)
        seeds = self._seeds(seed)
        if not self._random:
            self._random = [seeding.np_random(lane_seed)[0] for lane_seed in seeds]
        elif seed is not None:
            for lane in np.flatnonzero(lanes).tolist():
                self._random[lane] = seeding.np_random(seeds[lane])[0]
        self._restart(lanes)
        return self.task.episode.observation.copy(), {"speed_kmh": 3.6 * self.task.speed}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], Lanes, Lanes, dict[str, Any]]:
        """Hold ``actions``, (num_envs, actions), for one control interval in every lane.

        Raises InputError, and changes nothing, for actions that are not valid.
        """
        if not self._random:
            raise InputError("No episode has begun; call reset before step.")
        task, episode = self.task, self.task.episode
        force = checked(actions, episode.action.shape)
        if self.autoreset_mode == AutoresetMode.DISABLED and self._any_ended:
            raise InputError(
                f"The episode of lane {np.flatnonzero(self._ended)[0]} has ended; "
                "call reset with options={'reset_mask': ...}."
            )
        waiting = None  # in "NextStep": lanes that begin anew instead of stepping
        if self._any_ended:
            waiting = self._ended.copy()
            self._restart(waiting)
        task.step(force, skip=waiting)
        reward = task.reward.astype(np.float64)
        if waiting is not None:
            reward[waiting] = 0.0
        terminated = episode.terminated.copy()
        truncated = episode.truncated & ~terminated
        self._ended = terminated | truncated
        self._any_ended = bool(self._ended.any())
        infos: dict[str, Any] = {
            "contact_force": task.plant.contact_force.copy(),
            "position": task.plant.steps_done * task.plant.stride,
            **dict(zip(TERMS, task.terms.copy(), strict=True)),
        }
        if self._any_ended:
            for lane in np.flatnonzero(self._ended).tolist():
                infos = self._add_info(infos, {"figures": task.figures(lane).as_dict()}, lane)
        observation = episode.observation.copy()
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._any_ended:
            observation, infos = self._same_step(observation, infos)
        return observation, reward, terminated, truncated, infos

    def _same_step(
        self, observation: NDArray[np.float32], infos: dict[str, Any]
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin anew at once where episodes have ended; what they ended with goes to the infos."""
        ended = self._ended.copy()
        final = np.full(self.num_envs, None, dtype=object)
        for lane in np.flatnonzero(ended).tolist():
            final[lane] = observation[lane].copy()
        outcome = dict(infos)
        self._restart(ended)
        fresh = {
            "speed_kmh": 3.6 * self.task.speed,
            "final_obs": final,
            "_final_obs": ended,
            "final_info": outcome,
            "_final_info": ended,
        }
        return self.task.episode.observation.copy(), infos | fresh

    def _restart(self, lanes: Lanes) -> None:
        for lane in np.flatnonzero(lanes).tolist():
            self.task.reset(lane, self._random[lane])
            self._ended[lane] = False
        self._any_ended = bool(self._ended.any())

    def _masked(self, mask: Any) -> Lanes:
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        lanes = np.asarray(mask)
        if lanes.shape != (self.num_envs,) or lanes.dtype != np.bool_ or not self._random:
            raise InputError(
                f"reset_mask must be {self.num_envs} booleans, given after a first reset of all lanes."
            )
        return lanes

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int):
            return [seed + lane for lane in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"seed must be a number or one per lane, {self.num_envs}, not {len(seed)}.")
        return [None if each is None else int(each) for each in seed]
