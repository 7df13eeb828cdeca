"""The environment: one pantograph, one lane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from ..base.errors import InputError
from ..base.units import to_kmh
from ..control import Context, Task
from ..control.action import checked
from ..control.arguments import takes
from ..control.observation import BOUND
from ..control.settings import read_settings
from ..metrics.trajectory import Trajectory
from .description import described
from .episodes import task_with_options, with_longest_episode
from .infos import CONTACT_FORCE, FIGURES_TO_COME, first_info, told
from .one_thread import InUse, one_at_a_time, refuse
from .settings import EnvironmentSettings, render_metadata

if TYPE_CHECKING:
    from ..render.viewer import Viewer

SEEN = ("_shape", "_observation", "_values", "_flags")
"""Attributes that ``PantographEnv._watch`` takes from the task."""


class PantographEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A pantograph under a catenary, whose contact force an actuator is to keep steady.

    ## Description
    A train runs at constant speed; its pantograph, pressed up by its nominal force, slides along the
    contact wire. The line's uneven stiffness makes the contact force swing. An actuator on the
    pantograph can calm it. Ids: `Pantograph-v0` (flexible catenary, EN 50318:2002),
    `PantographStiffness-v0` (periodic stiffness, paper 3), `PantographThreeSpan-v0` (three-span
    modal catenary, paper 2).

    `Pantograph-v0` sets these arguments; what you give takes their place:

    {in_service}

    So no two episodes are alike, and what is learnt is not one line by heart. `**panto_env.envs.BARE` among
    the arguments makes it the papers' bare form, which the class and the other ids are by default.

    ## Action Space
    `Box(-1, 1, (1,), float32)`, or `(2,)` with `actuator={{"place": "both"}}`: share of the actuator's
    force limit (100 N unless told otherwise), up on the frame or up on the head and down on the mass
    below it. Held for one control interval (10 ms). Values outside are clipped; NaN, infinite or
    wrongly shaped actions raise an error and leave the environment as it was.

    ## Observation Space
    `Box(-10, 10, (n,), float32)`, each entry a physical value less its centre, over its scale. Those of
    `Pantograph-v0`, `observation="centred"`, have a mean near 0 and a spread near 1 in a passive run:

    {centred}

    `observation="measured"`, the default of the class, has no nominal force:

    {observation}

    `observation="full"` appends the wire's height, the actuators' forces and the state of masses
    between head and frame. Heights, velocities and contact force
    carry the noise and delay of `sensors`.

    ## Rewards
    Minus the cost function CF over the control step (relative to the nominal force) and minus the
    share of the step without contact (paper 1, Eqs 13-14); weights by `reward`, where terms for
    effort and rate of the action and for the mean force have weight 0 but in `Pantograph-v0`. A `reward` of
    your own takes the place of all its weights. `reward="agent"` is what the benchmark measures: the squared
    deviation of the low-passed contact force from the passive run's mean, over its variance there; with it go
    terms that hold the mean and keep the action from chattering. `info["reward_terms"]` holds the unweighted
    terms: over an episode "cost_function" sums to CF (N m) and "contact_loss" to CL (%).

    ## Starting State
    At the start of the line, at rest under the nominal force; with `run_in`, so many spans later at most.

    ## Episode End
    Truncated at the end of the line (or of `distance`). Terminated when the head leaves +-0.3 m, contact
    is lost for 0.5 s, the contact wire rises to the steady arm's stop, or the two wires touch; the rest of
    the run is then charged as if without contact.

    ## Info
    `reset` and `step` give the same keys: contact force (N), heights of head and wire (m), forces of the
    actuators (N), position (m), speed (km/h), the reward's terms. `info["figures"]` holds the episode's
    figures when it ends, those of `Trajectory.summary()`. Until then they are infinite, as is always one that
    the run has not, such as uplift where no support is passed. A `TimeLimit` ends episodes without the
    environment's knowledge: `trajectory.summary()` has the figures then, too.

    ## Arguments
    {arguments}

    `reset(options=...)` takes the same for one episode, but those that change a space.

    ## Copies
    `copy.deepcopy` and `pickle` take the environment as it is, in the middle of an episode too; the copy goes
    on bit for bit as the original would, as tree search and worker processes need.

    ## Version History
    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 100}  # noqa: RUF012 - as Gymnasium declares it

    @takes(EnvironmentSettings)
    def __init__(self, given: dict[str, Any]) -> None:
        """See the class. Raises InputError for a value that is not valid, TypeError for an unknown name."""
        settings = read_settings(given, EnvironmentSettings)
        self.render_mode = settings.render_mode
        self.metadata = render_metadata(self.metadata, settings)
        self._in_use = InUse()
        self._viewer: Viewer | None = None
        self._reward_so_far = 0.0  # told in pictures
        self._spec: EnvSpec | None = None
        self._usual = Task(settings)
        self._watch(self._usual)
        self._running = False
        shape = self.task.results.observation[0].shape
        self.observation_space = gymnasium.spaces.Box(-BOUND, BOUND, shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, self._shape, np.float32)

    @property
    def spec(self) -> EnvSpec | None:
        """How `gymnasium.make` made it, with the steps of its longest episode without options."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = with_longest_episode(spec, self._usual.length.most_control_steps)

    @property
    def context(self) -> Context:
        """What a policy may know of the present episode."""
        return self.task.context(0)

    @property
    def trajectory(self) -> Trajectory:
        """Record of the episode so far."""
        return self.task.trajectory(0, policy="environment")

    @one_at_a_time
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; ``options`` are arguments of the class, for this episode alone."""
        task = task_with_options(self._usual, options or {})
        super().reset(seed=int(seed) if isinstance(seed, np.integer) else seed)
        if task is not self.task:
            self._watch(task)
        task.reset(0, self.np_random)
        self._speed_kmh = to_kmh(float(task.speed[0]))
        self._running = True
        self._reward_so_far = 0.0
        if self.render_mode == "human":
            self._show()
        return self._observation.copy(), first_info(task)

    def _watch(self, task: Task) -> None:
        """Make this the task, and keep its only lane's arrays at hand for ``step``."""
        self.task = task
        self._shape = (len(task.actuator.places),)
        results = task.results
        self._observation, self._values = results.observation[0], results.values[0]
        self._flags = results.flags[0]

    def __getstate__(self) -> dict[str, Any]:
        """All but what a copy has to see anew, since its arrays lie elsewhere, and its window."""
        return {name: value for name, value in vars(self).items() if name not in SEEN} | {"_viewer": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._watch(self.task)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold ``action`` for one control interval. Raises InputError for an action that is not valid."""
        if not self._in_use.begin(False):
            refuse()
        try:  # as ``one_at_a_time`` does, in half the time
            return self._step(action)
        finally:
            self._in_use.end()

    def _step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        if not self._running:
            raise InputError("The episode has not begun or has ended; call reset before step.")
        self.task.step(checked(action, self._shape))
        terminated, truncated = self._flags.tolist()
        values = self._values.tolist()
        reward, cost_function, contact_loss, effort, rate, mean_force, low_passed = values[:CONTACT_FORCE]
        contact_force, head, wire, frame_force, head_force, position = values[CONTACT_FORCE:]
        info: dict[str, Any] = {
            "contact_force": contact_force,
            "head": head,
            "wire": wire,
            "frame_force": frame_force,
            "head_force": head_force,
            "position": position,
            "speed_kmh": self._speed_kmh,
            "reward_terms": {
                "cost_function": cost_function,
                "contact_loss": contact_loss,
                "effort": effort,
                "rate": rate,
                "mean_force": mean_force,
                "low_passed": low_passed,
            },
            "figures": FIGURES_TO_COME.copy(),
        }
        if terminated or truncated:
            self._running = False
            info["figures"] = told(self.task)
        if self.render_mode is not None:
            self._reward_so_far += reward
            if self.render_mode == "human":
                self._show()
        return self._observation.copy(), reward, terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """The line and the pantograph now, (height, width, 3), with render_mode "rgb_array".

        With "human" a window shows each step by itself. Raises InputError without the extra 'render'.
        """
        return self._frame() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()

    def _frame(self) -> NDArray[np.uint8]:
        from ..render.viewer import Viewer  # fonts and drawing are slow to import

        if self._viewer is None:
            self._viewer = Viewer(self._usual.settings.render_size)  # type: ignore[attr-defined]
        return self._viewer.frame(self.task, 0, self._title, self._reward_so_far)

    def _show(self) -> None:
        frame = self._frame()
        assert self._viewer is not None
        self._viewer.show(frame, self._title, self.metadata["render_fps"])

    @property
    def _title(self) -> str:
        plant = self.task.plant
        return f"pantograph {plant.pantograph.name}, line {plant.catenary.name}"


PantographEnv.__doc__ = described(PantographEnv.__doc__ or "")
