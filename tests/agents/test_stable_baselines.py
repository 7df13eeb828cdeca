"""A model that Stable-Baselines3 trained by itself, saved as a policy: the same actions, in every command."""

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from panto_agents.stable_baselines import save_policy
from panto_agents.vec_env import PantographVecEnv
from panto_env import InputError, simulate
from panto_env.policies import find_policy, wishes

SHORT = {"distance": 120.0, "accuracy": "fast", "settle": 0.0}
NAME = "panto_env:Pantograph-v0"


def trained(kind, env, **more):
    return kind("MlpPolicy", env, seed=3, device="cpu", **more)


def environments():
    return {
        "single": gymnasium.make(NAME, **SHORT),
        "dummy": DummyVecEnv([lambda: gymnasium.make(NAME, **SHORT)] * 2),
        "native": PantographVecEnv(gymnasium.make_vec(NAME, num_envs=2, **SHORT)),
    }


@pytest.mark.parametrize("env", ["single", "dummy", "native"])
@pytest.mark.parametrize(
    ("kind", "more"),
    [(PPO, {"n_steps": 64, "batch_size": 64}), (SAC, {"learning_starts": 10}), (PPO, {"n_steps": 64})],
)
def test_the_file_acts_as_the_model_does(env, kind, more, tmp_path):
    model = trained(kind, environments()[env], **more).learn(80)
    save_policy(model, tmp_path / "mine.safetensors")
    policy = find_policy(str(tmp_path / "mine.safetensors"))
    assert wishes(policy).items() >= {"observation": "centred", "history": 0, "washout": 1.0}.items()
    test = gymnasium.make(NAME, **SHORT).unwrapped
    observation, _ = test.reset(seed=0)
    policy.reset(test.context)
    for _ in range(20):
        action, _ = model.predict(observation, deterministic=True)
        np.testing.assert_allclose(policy.act(observation), action, atol=1e-6)
        observation, *_ = test.step(action)


def test_a_pass_of_it_has_the_washout_of_its_training(tmp_path):
    save_policy(
        trained(PPO, gymnasium.make(NAME, **SHORT), n_steps=64).learn(64), tmp_path / "mine.safetensors"
    )
    run = simulate(
        policy=str(tmp_path / "mine.safetensors"), distance=60.0, actuator="realistic", sensors="realistic"
    )
    assert run.settings["washout"] == 1.0


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (lambda: trained(A2C, gymnasium.make(NAME, **SHORT)), "ppo or sac"),
        (lambda: trained(PPO, gymnasium.make("Pendulum-v1")), "of this project|Pendulum"),
        (lambda: trained(PPO, VecNormalize(environments()["dummy"])), "VecNormalize"),
        (
            lambda: PPO(
                "MlpPolicy",
                gymnasium.make(NAME, **SHORT),
                policy_kwargs={"activation_fn": __import__("torch").nn.ELU},
            ),
            "tanh or relu",
        ),
    ],
)
def test_models_that_a_file_cannot_hold_are_refused(model, message, tmp_path):
    with pytest.raises(InputError, match=message):
        save_policy(model(), tmp_path / "mine.safetensors")
    assert not list(tmp_path.iterdir())
