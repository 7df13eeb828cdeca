import pytest

pytest.importorskip("ray.rllib")
import ray
from ray.rllib.algorithms.ppo import PPOConfig

import panto_env  # noqa: F401 - registers the ids


def test_rllib_trains_on_the_native_vector_environment():
    ray.init(num_cpus=2, include_dashboard=False, logging_level="ERROR")
    try:
        config = (
            PPOConfig()
            .environment("PantographStiffness-v0", env_config={"distance": 20.0})
            .env_runners(
                num_env_runners=0,
                num_envs_per_env_runner=8,
                gym_env_vectorize_mode="vector_entry_point",
            )
            .training(train_batch_size_per_learner=800, minibatch_size=100, num_epochs=1)
        )
        algorithm = config.build_algo()
        result = algorithm.train()
        assert "PantographVectorEnv" in str(algorithm.env_runner.env)
        assert result["env_runners"]["episode_return_mean"] < 0
        algorithm.stop()
    finally:
        ray.shutdown()
