import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from panto_agents.vec_env import PantographVecEnv


def make(lanes=3, **settings):
    native = gymnasium.make_vec(
        "panto_env:PantographStiffness-v0", num_envs=lanes, autoreset_mode="SameStep", **settings
    )
    return PantographVecEnv(native.unwrapped)


def test_ends_as_stable_baselines_expects():
    env = make(distance=10.0)
    env.seed(4)
    first = env.reset()
    assert first.dtype == np.float32
    for _ in range(20):
        observation, reward, done, infos = env.step(np.zeros((3, 1), np.float32))
        if done.all():
            break
    assert done.all()
    assert reward.dtype == np.float32
    np.testing.assert_array_equal(observation, first)
    assert infos[2]["TimeLimit.truncated"]
    assert infos[2]["terminal_observation"].shape == (9,)
    assert infos[2]["figures"]["mean"] > 0


def test_seed_of_lane_i_is_seed_plus_i():
    env = make(sensors="realistic")
    env.seed(4)
    observation = env.reset()
    for lane in range(3):
        single = gymnasium.make("panto_env:PantographStiffness-v0", sensors="realistic")
        np.testing.assert_array_equal(observation[lane], single.reset(seed=4 + lane)[0])


def test_rest_of_the_interface():
    env = make()
    assert env.env_is_wrapped(VecMonitor) == [False] * 3
    assert env.get_attr("num_envs", indices=[0, 1]) == [3, 3]
    with pytest.raises(NotImplementedError, match="share one environment"):
        env.set_attr("num_envs", 1)


def test_ppo_learns_on_it_and_sees_whole_episodes():
    env = VecMonitor(make(distance=30.0))
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, seed=0, device="cpu")
    model.learn(400)
    assert {episode["l"] for episode in model.ep_info_buffer} == {36}
