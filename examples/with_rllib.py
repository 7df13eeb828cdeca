"""RLlib's PPO on the native vector environment, which is stepped in the learner's process or in others.

RLlib pins a version of Gymnasium: `make rllib` makes an environment for it, where this is run and tested.

    .venv-rllib/bin/python examples/with_rllib.py --iterations 40

printed after a minute of one core

    mean reward per step: -1.462 at first, -0.641 at last

A passive pantograph gets -1.
"""

from __future__ import annotations

import argparse
import math
import os
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # such small networks are ten times slower with more

import ray
from ray.rllib.algorithms.ppo import PPOConfig

TASK: dict[str, Any] = {
    "speed_kmh": 300.0,
    "line_condition": "fair",
    "pantograph_scatter": 0.0,
    # Forces as commanded, counted from the start: the reward "agent" holds the mean by itself.
    "washout": None,
    "settle": 0.0,
    "observation": "measured",
    "history": 3,
    "normalise": (290.0, 310.0),
    "reward": "agent",  # what the benchmark measures
    "accuracy": "fast",
    "run_in": 10,  # episodes begin up to ten spans after the line's start
    "distance": 900.0,
}
LANES, BATCH = 64, 8192


def train(iterations: int, runners: int = 0) -> list[float]:
    """Mean reward per control step of each iteration in which episodes ended.

    runners: processes that step the lanes, besides the learner's; 0: the learner's process does.
    """
    ray.init(num_cpus=max(1, runners), include_dashboard=False, logging_level="ERROR")
    try:
        config = (
            PPOConfig()
            .environment("panto_env:Pantograph-v0", env_config=TASK)
            .env_runners(
                num_env_runners=runners,
                num_envs_per_env_runner=LANES // max(1, runners),
                gym_env_vectorize_mode="vector_entry_point",  # the native one, of all lanes
            )
            .training(
                train_batch_size_per_learner=BATCH,
                minibatch_size=2048,
                num_epochs=8,
                lr=1e-3,
                gamma=0.97,
                grad_clip=0.5,
            )
            .rl_module(model_config={"fcnet_hiddens": [128, 128], "vf_share_layers": False})
            .debugging(seed=0, log_level="ERROR")
        )
        algorithm = config.build_algo()
        results = [algorithm.train()["env_runners"] for _ in range(iterations)]
        algorithm.stop()
    finally:
        ray.shutdown()
    returns = [each.get("episode_return_mean", math.nan) for each in results]
    lengths = [each.get("episode_len_mean", math.nan) for each in results]
    means = [total / length for total, length in zip(returns, lengths, strict=True)]
    return [float(mean) for mean in means if not math.isnan(mean)]


def main() -> None:
    """Print the reward at first and at last."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--iterations", type=int, default=40)
    rewards = train(parser.parse_args().iterations)
    print(f"mean reward per step: {rewards[0]:.3f} at first, {rewards[-1]:.3f} at last")


if __name__ == "__main__":
    main()
