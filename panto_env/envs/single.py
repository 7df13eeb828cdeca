"""The environment: one pantograph, one lane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..base.arrays import to_kmh
from ..base.errors import InputError
from ..control import Context, Task
from ..control.arguments import checked, takes
from ..control.observation import BOUND
from ..control.settings import read_settings
from ..control.state import TaskRow
from ..metrics.trajectory import Trajectory
from ..plant.state import Row
from .episodes import CopiedAlone, Episodes, InUse, checked_options, checked_seed, one_at_a_time, refuse
from .lanes import CONTACT_FORCE, REWARD, final_figures, first_info, own_infos
from .settings import OF_VECTORS, EnvironmentSettings, described, render_metadata

if TYPE_CHECKING:
    from ..render.viewer import Viewer

SEEN = ("_shape", "_observation", "_values", "_flags", "_steps", "_counted_from")
"""Attributes that ``PantographEnv._watch`` sets from the task."""


class PantographEnv(CopiedAlone, gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A pantograph under a catenary, with an actuator that reduces variations of the contact force.

    ## Description
    A train runs at constant speed; its pantograph, lifted by its nominal force, slides along the
    contact wire. The non-uniform stiffness of the line makes the contact force vary. An actuator on the
    pantograph can reduce this variation. Ids: `Pantograph-v0` (flexible catenary, EN 50318:2002),
    `PantographStiffness-v0` (periodic stiffness, paper 3), `PantographThreeSpan-v0` (three-span
    modal catenary, paper 2).

    `Pantograph-v0` sets these arguments; your own arguments replace them:

    {in_service}

    So no two episodes are alike, and a policy cannot learn one line by heart. `**panto_env.envs.BARE` among
    the arguments gives the papers' bare form, the default of the class and of the other ids.

    ## Action Space
    `Box(-1, 1, (1,), float32)`, or `(2,)` with `actuator={{"place": "both"}}`: share of the actuator's
    force limit (100 N by default), up on the frame or up on the head and down on the mass
    below it; as many times as pantographs are `controlled`. Held for one control interval (10 ms). Values
    outside are clipped; NaN, infinite or wrongly shaped actions raise an error and do not change the
    environment. With `washout`, as in
    `Pantograph-v0`, the slow average of the actuator's force is subtracted from the action, so that no policy
    can gain by a larger or smaller mean contact force; `washout=None` for policies that command forces.

    ## Observation Space
    `Box(-10, 10, (n,), float32)`; each entry is a physical value minus its centre, divided by its scale. In
    `Pantograph-v0`, with `observation="centred"`, these are fixed, so that entries have a mean near 0 and a
    spread near 1 in a passive run of its own line and pantograph. With others they may have not: heights
    under `identified-2dof` are 3 to 5 scales low. `observation="measured", normalise=[200, 350]` takes
    centres and scales from passive runs of the given line and pantograph at these speeds (km/h):

    {centred}

    `observation="measured"`, the default of the class, has no nominal force:

    {observation}

    `observation="full"` appends the wire's height, the actuators' forces and the state of masses
    between head and frame. Heights, velocities and contact force
    carry the noise and delay of `sensors`.

    ## Rewards
    Minus the cost function CF over the control step (relative to the nominal force) and minus the
    share of the step without contact (paper 1, Eqs 13-14), and further terms that have weight 0 in
    `reward="paper1"`, the default of the class. `Pantograph-v0` has `reward="benchmark"`, whose return ranks
    policies as the benchmark does: CF and CL, beside them the squared deviation of the low-passed contact
    force over its variance in a passive run, and a tenth of the squared rate of the action, all from the mean
    of a passive run. Your own `reward` replaces all weights. `info["reward_terms"]` holds the unweighted
    terms: over an episode "cost_function" sums to CF (N m), about the reward's target, and "contact_loss" to
    CL (%). In the spans of `settle`, six in `Pantograph-v0`, waves build up about the train: a policy acts,
    and the reward and its terms are 0.

    ## Starting State
    At the start of the line, at rest under the nominal force; with `run_in`, up to that many spans later.
    Where `catenary` is a list, a family or a section, on a line drawn for this episode, which `context`
    describes.

    ## Episode End
    Truncated at the end of the line (or of `distance`). Terminated when the head leaves +-0.3 m, contact
    is lost for 0.5 s, the contact wire takes up all its room at a support, or the two wires touch; the
    reward is then charged for the rest of the run as if without contact.

    ## Info
    `reset` and `step` give the same keys: contact force (N), heights of head and wire (m), forces of the
    actuators (N), position (m), speed (km/h), the reward's terms, and the cost of safe learning: the share of
    the step without contact, with an uplift beyond its limit at a support, and with a low-passed contact
    force beyond the line's maximum, in sum, with the weights of `cost`. `info["counts"]` is whether reward
    and cost of the step count: neither at `reset` nor in the spans of `settle` do they. The last info of an
    episode has one key more, as Gymnasium's "episode" is: `info["figures"]`, its figures over the part that
    counts for the reward, after `run_in` and `settle`, to the end. `trajectory.summary()` has those of whole
    spans after the start has died out, which the benchmark compares. A figure that the run does not have,
    such as uplift where no support is passed, is left out. A `TimeLimit` ends episodes without the
    environment's knowledge: `trajectory.summary("all")` has the figures of all of it then, too.

    ## Several Pantographs
    `pantographs=["dsa380", "dsa380"], distances=[200]` is a train; `controlled=2` controls the second one,
    whose episode begins where it comes onto the line, while the first is passive. With `controlled=[1, 2]`
    observation and action hold those of the first, then those of the second, and the reward is the mean of
    theirs; `info["pantographs"]` has each one's contact force, position, reward, cost and whether they
    count, in the last info with its figures. `trajectory.train` has the records of all.
    `panto_env.parallel_env` is the same task as a PettingZoo environment, an agent for each controlled
    pantograph.

    ## Arguments
    {arguments}

    `reset(options=...)` takes the same for one episode, except those that change a space.

    ## Copies
    `copy.deepcopy` and `pickle` copy the environment with its state, also in the middle of an episode; the
    copy continues bit for bit as the original, as tree search and worker processes require. While another
    thread is in one of its methods a copy is refused, as any other use is.

    ## Version History
    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 100}  # noqa: RUF012 - as Gymnasium declares it

    @takes(EnvironmentSettings, OF_VECTORS, "only gymnasium.make_vec")
    def __init__(self, given: dict[str, Any]) -> None:
        """See the class. Raises InputError for a value that is not valid, TypeError for an unknown name."""
        settings = read_settings(given, EnvironmentSettings)
        self.render_mode = settings.render_mode
        self.metadata = render_metadata(self.metadata, settings)
        self._in_use = InUse()
        self._viewer: Viewer | None = None
        self._reward_so_far = 0.0  # shown in pictures
        self._usual = Episodes(settings)
        self._watch(self._usual.task)
        self._longest = None if self._usual.draws_line else self.task.length.most_control_steps
        self._running = False
        self.observation_space = gymnasium.spaces.Box(-BOUND, BOUND, self._observation.shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, self._shape, np.float32)

    @property
    @one_at_a_time
    def context(self) -> Context:
        """Information about the present episode that a policy may use."""
        return self.task.context(0)

    @property
    @one_at_a_time
    def trajectory(self) -> Trajectory:
        """Record of the episode so far."""
        return self.task.trajectory(0, policy="environment")

    @one_at_a_time
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; ``options`` are arguments of the class, only for this episode.

        Raises InputError, and changes nothing, where seed or options are not valid.
        """
        seed = checked_seed(seed)
        episodes = self._usual.with_options(checked_options(options))
        super().reset(seed=seed)
        task = episodes.draw(lambda: self.np_random)
        if task is not self.task:
            self._watch(task)
        task.reset(0, self.np_random)
        self._speed_kmh = to_kmh(float(task.speed[0]))
        self._running = True
        self._reward_so_far = 0.0
        if self.render_mode == "human":
            self._show()
        info = first_info(task)
        if task.agents > 1:
            info["pantographs"] = own_infos(task)
        return self._observation.copy(), info

    def _watch(self, task: Task) -> None:
        """Set the task, and keep its only lane's arrays for ``step``."""
        self.task = task
        self._shape = (task.agents * len(task.actuator.places),)
        results, first = task.results, int(task.episode.controlled[0])
        self._observation, self._values = results.observation.reshape(-1), results.values[0]
        self._flags = results.flags[0]
        self._steps = task.plant.run.table[first, 0, Row.STEP, ...]
        self._counted_from = task.episode.table[0, TaskRow.COUNTED_FROM, ...]

    def _state(self) -> dict[str, Any]:
        """State without the views of the task's arrays, which a copy makes again, and without the window."""
        return {name: value for name, value in vars(self).items() if name not in SEEN} | {"_viewer": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
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
        force = checked(action, self._shape)
        several = self.task.agents > 1
        self.task.step(force.reshape(self.task.agents, -1) if several else force)
        terminated, truncated = self._flags.tolist()
        values = self._values.tolist()
        reward, cost_function, contact_loss, effort, rate, mean_force, low_passed = values[:CONTACT_FORCE]
        contact_force, head, wire, frame_force, head_force, position, cost = values[CONTACT_FORCE:]
        info: dict[str, Any] = {  # written out: a loop over INFOS and TERMS takes a quarter of a step
            "contact_force": contact_force,
            "head": head,
            "wire": wire,
            "frame_force": frame_force,
            "head_force": head_force,
            "position": position,
            "cost": cost,
            "speed_kmh": self._speed_kmh,
            "counts": terminated or self._steps.item() > self._counted_from.item(),
            "reward_terms": {
                "cost_function": cost_function,
                "contact_loss": contact_loss,
                "effort": effort,
                "rate": rate,
                "mean_force": mean_force,
                "low_passed": low_passed,
            },
        }
        if several:
            reward = float(self.task.results.values[:, REWARD].mean())
            info["pantographs"] = own_infos(self.task)
            info["counts"] = any(own["counts"] for own in info["pantographs"])
        if terminated or truncated:
            self._running = False
            info["figures"] = final_figures(self.task)
            for row, own in enumerate(info.get("pantographs", ())):
                own["figures"] = final_figures(self.task, row)
        if self.render_mode is not None:
            self._reward_so_far += reward
            if self.render_mode == "human":
                self._show()
        return self._observation.copy(), reward, terminated, truncated, info

    @one_at_a_time
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
        words = "pantographs" if len(plant.train.collectors) > 1 else "pantograph"
        return f"{words} {self.task.settings.names}, line {plant.catenary.name}"


PantographEnv.__doc__ = described(PantographEnv.__doc__ or "")
