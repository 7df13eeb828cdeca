"""The environment: one pantograph, one lane."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.settings import suggest
from ..control import Task
from ..control.context import Context
from ..control.observation import BOUND
from ..control.reward import CONTACT_LOSS, COST_FUNCTION, EFFORT, RATE
from ..control.rows import REWARD, TERM
from ..metrics.trajectory import Trajectory
from ..plant.step import CONTACT_FORCE, FRAME_FORCE, HEAD_FORCE, HEAD_HEIGHT, STEP, STRIDE, WIRE_HEIGHT

SETTINGS = (
    "catenary",
    "pantograph",
    "speed_kmh",
    "actuator",
    "sensors",
    "line_condition",
    "pantograph_scatter",
    "observation",
    "reward",
    "distance",
    "spans",
    "control_interval",
    "time_step",
    "spacing",
    "window",
    "precision",
    "bilateral",
)


class PantographEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A pantograph under a catenary, whose contact force an actuator is to keep steady.

    ## Description
    A train runs at constant speed; its pantograph, pressed up by its nominal force, slides along the
    contact wire. The line's uneven stiffness makes the contact force swing. An actuator on the
    pantograph can calm it. Ids: `Pantograph-v0` (flexible catenary, EN 50318:2002),
    `PantographStiffness-v0` (periodic stiffness, paper 3), `PantographThreeSpan-v0` (three-span
    modal catenary, paper 2).

    ## Action Space
    `Box(-1, 1, (1,), float32)`, or `(2,)` with `actuator={"place": "both"}`: share of the actuator's
    force limit (100 N unless told otherwise), up on the frame or up on the head and down on the mass
    below it. Held for one control interval (10 ms). Values outside are clipped; NaN, infinite or
    wrongly shaped actions raise an error and leave the environment as it was.

    ## Observation Space
    `Box(-10, 10, (n,), float32)`, each entry a physical value over its scale:

    | Num | Observation | Scale |
    |-----|-------------|-------|
    | 0 | head displacement | 0.1 m |
    | 1 | frame displacement | 0.1 m |
    | 2 | head velocity | 1 m/s |
    | 3 | frame velocity | 1 m/s |
    | 4 | measured contact force | 100 N |
    | 5 | sine of the position within the span | 1 |
    | 6 | cosine of the position within the span | 1 |
    | 7 | speed | 100 m/s |
    | 8 | last action (8 and 9 with two actuators) | 1 |

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
    `catenary`, `pantograph` (catalogue names or TOML files), `speed_kmh` (a number or a range to draw
    from), `actuator` ("ideal", "realistic" or a table), `sensors` (likewise), `line_condition` ("new",
    "fair", "worn" or a table; of a list one is drawn for each episode), `pantograph_scatter` (rms
    relative difference of masses, springs and dampers, drawn for each episode), `observation` ("measured"
    or "full"), `reward` (a table of weights), `distance` (m), `spans`, `control_interval` (s),
    `time_step` (s), `spacing` (grid, m), `window` (spans computed about the train), `precision`,
    `bilateral` (let the contact pull, as paper 3's equations do), `render_mode` (None or "rgb_array").
    `reset(options=...)` takes the same for one episode, but those that change a space.

    ## Version History
    * v0: first version.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(self, render_mode: str | None = None, **settings: Any) -> None:
        """See the class. Raises InputError for an argument that is unknown or not valid."""
        check_names(settings, "argument")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode must be None or 'rgb_array', not {render_mode!r}.")
        self.render_mode = render_mode
        self._settings = settings
        self._usual = Task(**settings)
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
        self._plant_column, self._task_column = task.plant.run.lanes[:, 0], episode.lanes[:, 0]
        self._terminated, self._truncated = episode.terminated, episode.truncated

    def _episode_task(self, options: dict[str, Any]) -> Task:
        check_names(options, "option")
        if not options:
            return self._usual
        task = Task(**self._settings | options)
        if task.layout != self._usual.layout or task.actuator.channels != self._usual.actuator.channels:
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
        plant, scores = self._plant_column.tolist(), self._task_column.tolist()
        info: dict[str, Any] = {
            "contact_force": plant[CONTACT_FORCE],
            "head": plant[HEAD_HEIGHT],
            "wire": plant[WIRE_HEIGHT],
            "frame_force": plant[FRAME_FORCE],
            "head_force": plant[HEAD_FORCE],
            "position": plant[STEP] * plant[STRIDE],
            "reward_terms": {
                "cost_function": scores[TERM + COST_FUNCTION],
                "contact_loss": scores[TERM + CONTACT_LOSS],
                "effort": scores[TERM + EFFORT],
                "rate": scores[TERM + RATE],
            },
        }
        if terminated or truncated:
            self._running = False
            info["figures"] = self.task.figures(0).as_dict()
        reward = scores[REWARD]
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
    if not math.isfinite(sum(force.tolist()) if force.ndim == 1 else force.sum(dtype=np.float64)):
        raise InputError(f"The action must be finite, not {action!r}; check the policy.")
    return force


def check_names(given: dict[str, Any], what: str) -> None:
    """Raise InputError for a name that is not one of ``SETTINGS``."""
    for name in given:
        if name not in SETTINGS:
            raise InputError(f"Unknown {what} '{name}': {suggest(str(name), SETTINGS)}.")
