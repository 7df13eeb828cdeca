"""The environment: one pantograph, one lane."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from ..catalog import load_pantograph
from ..control import Context, Task
from ..control.arguments import table, takes
from ..control.observation import BOUND, layout
from ..control.settings import check_names, default, read_settings
from ..control.state import EPISODE_ROWS, TaskRow
from ..metrics.trajectory import Trajectory
from ..plant.actuators import actuator_settings
from ..plant.state import Row
from .settings import EnvironmentSettings

# Places in a lane's columns as plain integers: members of an enum would double the time that `step` takes.
CONTACT_FORCE, HEAD, WIRE = int(Row.CONTACT_FORCE), int(Row.HEAD_HEIGHT), int(Row.WIRE_HEIGHT)
FRAME_FORCE, HEAD_FORCE = int(Row.FRAME_FORCE), int(Row.HEAD_FORCE)
STEP, STRIDE = int(Row.STEP), int(Row.STRIDE)

SEEN = ("_shape", "_observation", "_plant_column", "_reward_and_terms", "_terminated", "_truncated")
"""Attributes that ``PantographEnv._watch`` takes from the task."""


class PantographEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A pantograph under a catenary, whose contact force an actuator is to keep steady.

    ## Description
    A train runs at constant speed; its pantograph, pressed up by its nominal force, slides along the
    contact wire. The line's uneven stiffness makes the contact force swing. An actuator on the
    pantograph can calm it. Ids: `Pantograph-v0` (flexible catenary, EN 50318:2002),
    `PantographStiffness-v0` (periodic stiffness, paper 3), `PantographThreeSpan-v0` (three-span
    modal catenary, paper 2).

    ## Action Space
    `Box(-1, 1, (1,), float32)`, or `(2,)` with `actuator={{"place": "both"}}`: share of the actuator's
    force limit (100 N unless told otherwise), up on the frame or up on the head and down on the mass
    below it. Held for one control interval (10 ms). Values outside are clipped; NaN, infinite or
    wrongly shaped actions raise an error and leave the environment as it was.

    ## Observation Space
    `Box(-10, 10, (n,), float32)`, each entry a physical value over its scale:

    {observation}

    `observation="full"` appends the wire's height, the actuators' forces and the state of masses
    between head and frame. Entries 0-4 carry the noise and delay of `sensors`.

    ## Rewards
    Minus the cost function CF over the control step (relative to the nominal force) and minus the
    share of the step without contact (paper 1, Eqs 13-14); weights by `reward`, where terms for
    effort and rate of the action have weight 0. `info["reward_terms"]` holds the unweighted terms:
    over an episode "cost_function" sums to CF (N m) and "contact_loss" to CL (%).

    ## Starting State
    At the start of the line, at rest under the nominal force.

    ## Episode End
    Truncated at the end of the line (or of `distance`). Terminated when the head leaves +-0.3 m or
    contact is lost for 0.5 s; the rest of the run is then charged as if without contact. At the end
    `info["figures"]` holds the episode's figures, those of `Trajectory.summary()`.

    ## Arguments
    {arguments}

    `reset(options=...)` takes the same for one episode, but those that change a space.

    ## Copies
    `copy.deepcopy` and `pickle` take the environment as it is, in the middle of an episode too; the copy goes
    on bit for bit as the original would, as tree search and worker processes need.

    ## Version History
    * v0: first version.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - as Gymnasium declares it

    @takes(EnvironmentSettings)
    def __init__(self, given: dict[str, Any]) -> None:
        """See the class. Raises InputError for a value that is not valid, TypeError for an unknown name."""
        settings = read_settings(given, EnvironmentSettings)
        self.render_mode = settings.render_mode
        self._settings = settings
        self._usual = Task(settings)
        self._watch(self._usual)
        self._running = False
        shape = self.task.episode.observation[0].shape
        self.observation_space = gymnasium.spaces.Box(-BOUND, BOUND, shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, self.task.episode.action[0].shape, np.float32)

    @property
    def context(self) -> Context:
        """What a policy may know of the present episode."""
        return self.task.context(0)

    @property
    def trajectory(self) -> Trajectory:
        """Record of the episode so far."""
        return self.task.trajectory(0, policy="environment")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; ``options`` are arguments of the class, for this episode alone."""
        task = self._episode_task(options or {})
        super().reset(seed=seed)
        if task is not self.task:
            self._watch(task)
        task.reset(0, self.np_random)
        self._running = True
        return task.episode.observation[0].copy(), {"speed_kmh": 3.6 * float(task.speed[0])}

    def _watch(self, task: Task) -> None:
        """Make this the task, and keep its only lane's arrays at hand for ``step``."""
        self.task, episode = task, task.episode
        self._shape = episode.action.shape[1:]
        self._observation = episode.observation[0]
        self._plant_column = task.plant.run.table[0, : STRIDE + 1, 0]
        self._reward_and_terms = episode.table[TaskRow.REWARD : EPISODE_ROWS, 0]
        self._terminated, self._truncated = episode.terminated, episode.truncated

    def __getstate__(self) -> dict[str, Any]:
        """All but what a copy has to see anew, since its arrays lie elsewhere."""
        return {name: value for name, value in vars(self).items() if name not in SEEN}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._watch(self.task)

    def _episode_task(self, options: dict[str, Any]) -> Task:
        check_names(options, "option")
        if not options:
            return self._usual
        task = Task(read_settings(dict(self._settings) | options, EnvironmentSettings))
        if task.layout != self._usual.layout or task.actuator.places != self._usual.actuator.places:
            raise InputError(
                f"The options {', '.join(options)} would change the observation or action space; "
                "make another environment for that."
            )
        return task

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold ``action`` for one control interval. Raises InputError for an action that is not valid."""
        if not self._running:
            raise InputError("The episode has not begun or has ended; call reset before step.")
        self.task.step(checked(action, self._shape))
        terminated, truncated = self._terminated.item(), self._truncated.item()
        plant = self._plant_column.tolist()
        reward, cost_function, contact_loss, effort, rate = self._reward_and_terms.tolist()
        info: dict[str, Any] = {
            "contact_force": plant[CONTACT_FORCE],
            "head": plant[HEAD],
            "wire": plant[WIRE],
            "frame_force": plant[FRAME_FORCE],
            "head_force": plant[HEAD_FORCE],
            "position": plant[STEP] * plant[STRIDE],
            "reward_terms": {
                "cost_function": cost_function,
                "contact_loss": contact_loss,
                "effort": effort,
                "rate": rate,
            },
        }
        if terminated or truncated:
            self._running = False
            info["figures"] = self.task.figures(0).as_dict()
        return self._observation.copy(), reward, terminated, truncated and not terminated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Picture of the last two spans, (height, width, 3), with render_mode "rgb_array"."""
        if self.render_mode is None:
            return None
        from ..render import picture  # Matplotlib is slow to import

        return picture(self.trajectory)


def checked(action: Any, shape: tuple[int, ...]) -> Array:
    """Action as an array of this shape. Raises InputError where it is of another or not finite."""
    force: Array = action
    if not (isinstance(action, np.ndarray) and action.dtype.char in "fd"):
        try:
            force = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"The action must be numbers in -1..1 of shape {shape}, not {action!r}."
            ) from error
    if force.shape != shape:
        raise InputError(f"The action must have the shape {shape}, not {force.shape}.")
    # The sum is finite where all are: cheaper than to ask each; Python adds up a few sooner than NumPy.
    if not math.isfinite(sum(force.tolist()) if len(shape) == 1 else force.sum(dtype=np.float64)):
        raise InputError(f"The action must be finite, not {action!r}; check the policy.")
    return force


def _observation_table() -> str:
    """The entries of the default observation as a Markdown table."""
    actuator, pantograph = actuator_settings(default("actuator")), load_pantograph(default("pantograph"))
    entries = layout(default("observation"), actuator, pantograph).entries
    rows = [f"| {k} | {each.name} | {each.scale:g} {each.unit} |" for k, each in enumerate(entries)]
    return "\n".join(("| Num | Observation | Scale |", "|-----|-------------|-------|", *rows))


def _indented(text: str) -> str:
    return text.replace("\n", "\n    ")


PantographEnv.__doc__ = (PantographEnv.__doc__ or "").format(
    observation=_indented(_observation_table()), arguments=_indented(table(EnvironmentSettings))
)
