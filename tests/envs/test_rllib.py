"""RLlib on the native vector environment; `make rllib` has it in an environment of its own."""

import os
import sys
from pathlib import Path

import pytest

os.environ.setdefault("OMP_NUM_THREADS", "1")  # such small networks are ten times slower with more

pytest.importorskip("ray.rllib")
import ray
from ray.rllib.algorithms.ppo import PPOConfig

BATCH, ITERATIONS = 4096, 8
EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_example_of_the_documents_learns(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.setattr(sys, "argv", ["with_rllib"])  # RLlib's processes look at it
    import with_rllib

    rewards = with_rllib.train(20)
    assert rewards[-1] > rewards[0]
    assert rewards[-1] > -1.0  # what a passive pantograph gets


@pytest.mark.parametrize("runners", [0, 2])
def test_rllib_learns_on_the_native_vector_environment(runners):
    """In the learner's own process, and in two others, as on a cluster."""
    ray.init(num_cpus=2, include_dashboard=False, logging_level="ERROR", object_store_memory=100 * 2**20)
    try:
        config = (
            PPOConfig()
            .environment(
                "panto_env:PantographStiffness-v0", env_config={"distance": 100.0, "reward": "agent"}
            )
            .env_runners(
                num_env_runners=runners,
                num_envs_per_env_runner=16 // max(runners, 1),
                gym_env_vectorize_mode="vector_entry_point",
            )
            .training(
                train_batch_size_per_learner=BATCH, minibatch_size=256, num_epochs=5, lr=1e-3, gamma=0.97
            )
            .rl_module(model_config={"fcnet_hiddens": [16], "vf_share_layers": False})
            .debugging(seed=0)
        )
        algorithm = config.build_algo()
        kinds = algorithm.env_runner_group.foreach_env_runner(lambda runner: str(runner.env))
        results = [algorithm.train() for _ in range(ITERATIONS)]
        algorithm.stop()
    finally:
        ray.shutdown()
    # With others the learner's own process, the first, has no environment.
    assert all("PantographVectorEnv" in kind for kind in kinds[-runners:])
    assert results[-1]["env_runners"]["num_env_steps_sampled_lifetime"] >= ITERATIONS * BATCH
    first, last = (result["env_runners"]["episode_return_mean"] for result in (results[0], results[-1]))
    assert last > 0.75 * first  # both are negative
