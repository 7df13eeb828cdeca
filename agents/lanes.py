"""The environments of a training."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
from stable_baselines3.common.vec_env import VecMonitor

from panto_baselines.benchmark.seeds import TRAINING, check_seeds
from panto_env.envs import PantographVectorEnv

from .apg import APG
from .base_policy import PolicyLanes
from .residual import ResidualVecEnv
from .settings import Training
from .side_by_side import SideBySide
from .vec_env import PantographVecEnv
from .washout import WashoutVecEnv


def make_lanes(training: Training) -> Any:
    """``VecEnv`` of the training's lanes; if the training has a base policy, it acts there too.

    Where the algorithm learns from whole passes they stand for lanes. Raises InputError if the environment's
    arguments are not valid.
    """
    if isinstance(training.hyperparameters, APG):
        from .pass_lanes import PassLanes

        return PassLanes(training, training.hyperparameters.pulsing())
    if training.device is not None:
        from .device_ppo import DeviceLanes

        return DeviceLanes(training)
    parts = [_part(training, changes) for changes in training.variants or ({},)]
    return VecMonitor(parts[0] if len(parts) == 1 else SideBySide(parts))


def _part(training: Training, changes: Mapping[str, Any]) -> Any:
    """Lanes of one variant."""
    arguments = {key: value for key, value in {**training.environment, **changes}.items() if key != "id"}
    native = gymnasium.make_vec(
        training.environment["id"],
        num_envs=training.lanes // max(1, len(training.variants)),
        lines=training.lines,
        episodes_per_line=training.episodes_per_line,
        autoreset_mode="SameStep",
        **arguments,
    )
    assert isinstance(native, PantographVectorEnv)  # a training accepts no other ids
    lanes: Any = PantographVecEnv(native)
    if training.residual_of is not None:
        base = PolicyLanes(training.residual_of, native)
        lanes = ResidualVecEnv(lanes, base, training.residual_share)
    if training.washout is not None:
        lanes = WashoutVecEnv(lanes, native.context(0), training.washout)
    return lanes


def lane_seeds(training: Training, steps: int = 0) -> range:
    """Seeds of the lanes, within those for training, by the training's seed and the steps done."""
    places = len(TRAINING) - training.lanes + 1
    first = TRAINING[(training.seed * training.lanes + steps) % places]
    seeds = range(first, first + training.lanes)
    check_seeds(seeds, "training")
    return seeds
