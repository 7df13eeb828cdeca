"""The vector environment."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from ..control import Context, Task
from ..control.arguments import checked, takes
from ..control.episode import Flags
from ..control.lines import draws_line
from ..control.observation import BOUND
from ..control.settings import read_settings
from .episodes import CopiedAlone, InUse, check_whole_trains, checked_options, checked_seeds, one_at_a_time
from .lanes import REWARD, Answer, final_infos, lane_figures, lane_infos, lanes_of
from .settings import VectorSettings, render_metadata

if TYPE_CHECKING:
    from ..render.viewer import Viewer


class NamedToStableBaselines(type):
    """Class of the vector environment.

    Stable-Baselines3 has its own kind of vector environment and refuses all others with a message about
    OpenAI Gym. Before that it only prints the environment's class.
    """

    def __repr__(cls) -> str:
        if sys._getframe(1).f_globals.get("__name__", "").startswith("stable_baselines3."):
            raise InputError(
                "Stable-Baselines3 takes a vector environment of Gymnasium inside a VecEnv: "
                "from panto_agents.lanes import PantographVecEnv, and give it "
                "PantographVecEnv(gymnasium.make_vec(...))."
            )
        return super().__repr__()


class SharedByLanes(CopiedAlone, VectorEnv[Any, Any, Any]):
    """Base of a vector environment whose lanes have no environments of their own."""

    def _set_up(self: Any, settings: VectorSettings, task: Task) -> None:
        """Attributes of any such environment, with the task of all lanes on one line, or on an example."""
        self.autoreset_mode, self.num_envs = settings.autoreset_mode, settings.num_envs
        self.metadata = render_metadata(self.metadata, settings) | {"autoreset_mode": self.autoreset_mode}
        self.render_mode, self.task = settings.render_mode, task
        self._limit = settings.max_episode_steps
        self._longest = self._limit or (None if draws_line(settings) else task.length.most_control_steps)
        shape, actions = task.results.observation[0].shape, len(task.actuator.places)
        self.single_observation_space = gymnasium.spaces.Box(-BOUND, BOUND, shape, np.float32)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._shape = (self.num_envs, actions)
        self._in_use, self._running = InUse(), False

    def call(self: Any, name: str, *arguments: Any, **named: Any) -> tuple[Any, ...]:
        """Each lane's context, or what all share, once per lane. Raises InputError for reset and step."""
        if name in ("reset", "step", "render", "close"):
            raise InputError(f"The lanes {name} together; call {name} of the vector environment itself.")
        if name == "context":
            return tuple(map(self.context, range(self.num_envs)))
        value = getattr(self, f"single_{name}" if name in ("observation_space", "action_space") else name)
        if name.startswith("np_random") and isinstance(value, tuple):
            return tuple(value)
        own = value(*arguments, **named) if callable(value) else value
        return tuple(own for _ in range(self.num_envs))

    get_attr = call

    def _check_begun(self: Any) -> None:
        if not self._running:
            raise InputError("No episode has begun; call reset before step.")

    def _check_none_over(self: Any, ended: Any) -> None:
        """With "Disabled", raise InputError where the episode of a lane has ended; ended: (lanes,)."""
        if self.autoreset_mode == AutoresetMode.DISABLED and ended.any():
            raise InputError(
                f"The episode of lane {ended.tolist().index(True)} has ended; "
                "call reset with options={'reset_mask': ...}."
            )

    def set_attr(self, name: str, values: Any) -> None:
        """Raise InputError: the lanes share one environment."""
        raise InputError(
            f"The lanes share one environment, whose {name} stays; give it to make_vec or reset."
        )


class PantographVectorEnv(SharedByLanes, metaclass=NamedToStableBaselines):
    """Many pantographs, each on a line of its own, stepped together on all cores.

    `gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=N)`; arguments as for `PantographEnv`, one
    speed, line irregularity and noise drawn for each lane. Lane i, seeded with seed + i, is bit for bit the
    same as a single environment with that seed. `autoreset_mode` is "NextStep" (Gymnasium's default),
    "SameStep" or "Disabled"; `max_episode_steps` truncates episodes as Gymnasium's `TimeLimit` does.

    Where `catenary` is a list, a family or a section, each lane draws its own line for each episode, as the
    single environment does. Faster is `lines=8`: eight lines side by side, each shared by an equal number of
    lanes and drawn by the generator of the first of them, `episodes_per_line` times as seldom.
    `context(lane)` has a lane's line.

    `reset(options=...)` takes the options of the single environment, for the episodes that it begins. With
    the option "reset_mask", an array of bool, it begins them only in the marked lanes.

    `infos` has the content of the single environment's info in the form of Gymnasium's vector environments:
    arrays with a value per lane, and under "_key" the lanes that have one. Lanes whose episodes end have
    "figures", each with its own mask, since a run may lack one; with "SameStep" these and all other final
    values are in "final_info", next to "final_obs".

    For Stable-Baselines3, wrap it in `panto_agents.lanes.PantographVecEnv`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 100}  # noqa: RUF012 - as Gymnasium declares it

    @takes(VectorSettings)
    def __init__(self, given: dict[str, Any]) -> None:
        """See the class. Raises InputError for a value that is not valid, TypeError for an unknown name."""
        settings = read_settings(given, VectorSettings)
        self._lanes = lanes_of(settings, keep_samples=settings.render_mode is not None)
        self._usual: Any = self._lanes.episodes_with({})
        self._set_up(settings, self._lanes.task_of(0)[0])
        drawn = range(self.num_envs) if settings.render_lanes is None else settings.render_lanes
        self._drawn, self._render_size = tuple(drawn), settings.render_size
        self._viewer: Viewer | None = None
        self._reward_so_far = np.zeros(self.num_envs)  # shown in pictures
        self._random: dict[int, np.random.Generator] = {}  # by lane, made when first needed
        self._seeds: dict[int, int | None] = {}  # seed of each lane's generator; None: any
        self._steps = np.zeros(self.num_envs, dtype=np.int64)  # of each lane's episode so far
        self._ended: Flags = np.zeros(self.num_envs, dtype=np.bool_)
        self._any_ended = False

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Each lane's generator."""
        return tuple(self._generator(lane) for lane in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Seed of each lane's generator."""
        return tuple(self._seeds[lane] for lane, _ in enumerate(self.np_random))  # type: ignore[misc]

    @one_at_a_time
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start episodes in all lanes, or in those of ``options["reset_mask"]``, (num_envs,) of bool.

        seed: of lane 0, and seed + i for lane i; or one per lane. Other options are arguments of the class,
        only for these episodes. Raises InputError, and changes nothing, where one is not valid.
        """
        seeds, options = checked_seeds(seed, self.num_envs), checked_options(options)
        mask = self._mask(options.pop("reset_mask", None))
        lanes = np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask
        episodes = self._lanes.episodes_with(options)
        self._seed(lanes, seeds)
        self._begin(lanes, episodes, anew=mask is None or seed is not None)
        self._running = True
        answer = self._lanes.answer()
        return answer.results.observation, lane_infos(answer if mask is None else answer.of(mask))

    @one_at_a_time
    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], Array, Flags, Flags, dict[str, Any]]:
        """Hold ``actions``, (num_envs, actions), for one control interval in every lane.

        Raises InputError, and changes nothing, for actions that are not valid.
        """
        self._check_begun()
        force = checked(actions, self._shape)
        if self._any_ended:
            self._check_none_over(self._ended)
        waiting = None  # in "NextStep": lanes that are reset instead of stepped
        if self._any_ended:
            waiting = self._ended
            force = np.where(waiting[:, None], 0.0, force)  # nobody acts there, whatever was given
        ended = self._lanes.step(force, waiting, self._generator)
        answer = self._lanes.answer()
        results = answer.results
        terminated, truncated = results.terminated, results.truncated
        if self._limit is not None:
            self._steps += 1
            self._steps[self._ended] = 0
            truncated |= self._steps >= self._limit
        if ended or self._any_ended or self._limit is not None:
            self._ended = terminated | truncated
            self._any_ended = bool(self._ended.any())
        observation, reward = results.observation, results.values[:, REWARD]
        if self.render_mode is not None:
            self._reward_so_far += reward
            if waiting is not None:
                self._reward_so_far[waiting] = 0.0
        if self._any_ended and self.autoreset_mode == AutoresetMode.SAME_STEP:
            observation, infos = self._begin_at_once(answer)
        else:
            infos = lane_infos(answer)
            if self._any_ended:
                infos |= self._figures()
        return observation, reward, terminated, truncated, infos

    @one_at_a_time
    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Frames, (height, width, 3), of the drawn lanes, with render_mode "rgb_array".

        Raises InputError where the extra 'render' is missing.
        """
        if self.render_mode is None:
            return None
        from ..render.viewer import Viewer  # fonts and drawing are slow to import

        if self._viewer is None:
            self._viewer = Viewer(self._render_size)
        frames = []
        for lane in self._drawn:
            task, place = self._lanes.task_of(lane)
            title = f"lane {lane}: {task.settings.names} on {task.plant.catenary.name}"
            frames.append(self._viewer.frame(task, place, title, float(self._reward_so_far[lane])))
        return tuple(frames)

    @one_at_a_time
    def context(self, lane: int) -> Context:
        """Information about a lane's episode that a policy may use."""
        task, place = self._lanes.task_of(lane)
        return task.context(place)

    def _figures(self) -> dict[str, Any]:
        return lane_figures(self._lanes.figures(self._ended), self._ended)

    def _begin_at_once(self, answer: Answer) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Reset lanes whose episodes have ended; returns the observation, and infos with final values."""
        ended, final_observation = self._ended.copy(), np.full(self.num_envs, None, dtype=object)
        for lane in np.flatnonzero(ended).tolist():
            final_observation[lane] = answer.results.observation[lane].copy()
        final = final_infos(final_observation, lane_infos(answer.of(ended)) | self._figures(), ended)
        self._begin(ended, self._usual)
        begun = self._lanes.answer()
        return begun.results.observation, lane_infos(begun) | final

    def _begin(self, lanes: Flags, episodes: Any, anew: bool = False) -> None:
        self._lanes.begin(lanes, episodes, self._generator, anew)
        self._steps[lanes] = 0
        self._reward_so_far[lanes] = 0.0
        self._ended[lanes] = False
        self._any_ended = bool(self._ended.any())

    def _mask(self, mask: Any) -> Flags | None:
        if mask is None:
            return None
        valid = isinstance(mask, np.ndarray) and mask.shape == (self.num_envs,) and mask.dtype == np.bool_
        if not (valid and mask.any()):
            raise InputError(f"reset_mask must be {self.num_envs} booleans, an array with one true or more.")
        if not (self._running or mask.all()):
            raise InputError("The first reset must begin episodes in all lanes; leave out reset_mask.")
        check_whole_trains(mask, self.task.agents)
        lanes: Flags = mask.copy()
        return lanes

    def _seed(self, lanes: Flags, seeds: Sequence[int | None]) -> None:
        """Seed the marked lanes; a lane without a given seed keeps its generator if it has one."""
        for lane in np.flatnonzero(lanes).tolist():
            if seeds[lane] is not None or lane not in self._seeds:
                self._seeds[lane] = seeds[lane]
                self._random.pop(lane, None)

    def _generator(self, lane: int) -> np.random.Generator:
        """A lane's generator, made when first needed: making one can take longer than an episode."""
        if lane not in self._random:
            self._random[lane], self._seeds[lane] = seeding.np_random(self._seeds.get(lane))
        return self._random[lane]
