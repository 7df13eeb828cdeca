"""One pass along a line, under a policy or none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..control import Task
from ..metrics.trajectory import Trajectory
from ..policies import Policy, find_policy


def simulate(
    catenary: Any = "en50318-2002",
    pantograph: Any = "en50318-2002",
    speed_kmh: float = 300.0,
    policy: Any = None,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    **settings: Any,
) -> Trajectory:
    """Simulate one pass of a pantograph along a line.

    catenary, pantograph: catalogue names or TOML files. policy: None, a name ("pd"), a model file, or
    an object with reset and act. seed: of the line's irregularity and the sensors' noise. progress:
    called with the share done. settings: any other of ``Task`` (actuator, sensors, line_condition,
    distance (m), spans, control_interval (s), time_step (s), spacing (m), bilateral, ...).

    Raises InputError for what is not valid.
    """
    task = Task(
        catenary=catenary,
        pantograph=pantograph,
        speed_kmh=speed_kmh,
        **{"record_droppers": True} | settings,
    )
    if task.lanes != 1:
        raise InputError("simulate makes one pass; leave lanes at 1.")
    task.reset(0, np.random.default_rng(seed))
    if policy is None:
        task.coast()
        return task.trajectory(0, seed=seed)
    name = policy if isinstance(policy, str) else type(policy).__name__
    run_policy(task, find_policy(policy), progress)
    return task.trajectory(0, policy=name, seed=seed)


def run_policy(task: Task, policy: Policy, progress: Callable[[float], None] | None = None) -> None:
    """Drive lane 0, already reset, to the end of its run.

    Raises InputError where the policy's action is not finite or not of the right shape.
    """
    policy.reset(task.context(0))
    episode = task.episode
    while not (episode.truncated[0] or episode.terminated[0]):
        # A copy: a policy may keep what it was shown.
        action = np.asarray(policy.act(episode.observation[0].copy()), dtype=float)
        if action.shape != episode.action[0].shape or not np.isfinite(action).all():
            raise InputError(
                f"The policy must return {episode.action.shape[1]} finite numbers as its action, "
                f"not {action!r}."
            )
        task.step(action[None])
        if progress is not None:
            progress(float(task.plant.step[0] / task.end(0)))
