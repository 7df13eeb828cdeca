"""What Gymnasium asks of environments, on all our ids."""

import json
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_match import check_environments_match
from gymnasium.wrappers import TimeAwareObservation

from panto_env.envs import IDS

LIVELY = {"sensors": "realistic", "line_condition": "fair", "speed_kmh": (200, 300)}
LIVELY |= {"distance": 20.0, "settle": 0.0}


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.longer
@pytest.mark.parametrize("name", IDS)
def test_public_checkers_find_no_fault(name):
    of_stable_baselines = pytest.importorskip("stable_baselines3.common.env_checker").check_env
    more = [{"actuator": {"place": "both"}, "observation": "full"}, LIVELY]
    for settings in ({}, *(more if name == "PantographStiffness-v0" else [])):
        env = gymnasium.make(name, disable_env_checker=True, **settings).unwrapped
        check_env(env, skip_render_check=bool(settings))
        of_stable_baselines(env)
    check_environments_match(*(gymnasium.make(name, **LIVELY) for _ in range(2)), num_steps=30)


def test_every_info_has_the_same_keys():
    """As recorders of episodes want it."""
    name = "Pantograph-v0"

    def keys(info):
        return {key: keys(value) if isinstance(value, dict) else type(value) for key, value in info.items()}

    env = gymnasium.make(name, **LIVELY)
    _, info = env.reset(seed=0)
    wanted, ended = keys(info), False
    terms = "cost_function contact_loss effort rate mean_force low_passed"
    assert list(wanted["reward_terms"]) == terms.split()
    run_in = IDS[name].get("run_in", 0.0) * 60
    assert 0 <= info["position"] <= run_in
    assert info["reward_terms"]["effort"] == 0.0
    assert info["contact_force"] > 0
    assert "figures" not in info
    while not ended:
        _, _, _, ended, info = env.step(env.action_space.sample())
        figures = info.pop("figures", None)
        assert (figures is not None) == ended
        assert keys(info) == wanted
        json.dumps(info, allow_nan=False)
    assert figures["mean"] > 0
    json.dumps(figures, allow_nan=False)
    assert 200 <= info["speed_kmh"] <= 300


def test_environment_is_made_again_from_its_spec():
    name = "PantographStiffness-v0"
    env = gymnasium.make(name, speed_kmh=250, distance=100.0, settle=0.0)
    again = gymnasium.make(env.spec)
    assert again.spec == env.spec
    assert env.spec.max_episode_steps == 144  # 100 m at 0.694 m
    assert gymnasium.spec(name).max_episode_steps is None
    for limit in ({}, {"max_episode_steps": 50}):
        for mode in ("vector_entry_point", "sync"):
            envs = gymnasium.make_vec(name, 2, vectorization_mode=mode, distance=100.0, **limit)
            twins = gymnasium.make_vec(envs.spec)
            assert twins.spec == envs.spec
            assert type(twins) is type(envs)
            assert twins.num_envs == 2
            assert twins.observation_space == envs.observation_space
            assert twins.single_action_space == envs.single_action_space
    assert gymnasium.make_vec(name, 2, **LIVELY).spec.max_episode_steps == 36  # 20 m at 200 km/h
    assert gymnasium.make_vec(name, 2, max_episode_steps=5).spec.max_episode_steps == 5


def test_time_aware_observation_knows_the_longest_episode():
    name = "PantographStiffness-v0"
    env = TimeAwareObservation(gymnasium.make(name, **LIVELY), normalize_time=True)
    first, _ = env.reset(seed=0)
    steps, ended = 0, False
    while not ended:
        observation, _, _, ended, _ = env.step(env.action_space.sample())
        assert observation in env.observation_space
        steps += 1
    assert first[-1] == 0
    assert observation[-1] == np.float32(steps / 36)
    envs = gymnasium.make_vec(name, 2, vectorization_mode="sync", wrappers=(TimeAwareObservation,))
    assert envs.reset(seed=0)[0].shape == (2, first.size)


def test_numpy_s_numbers_are_numbers():
    numbers = {"speed_kmh": (np.float32(200), np.int64(250)), "distance": np.int32(20)}
    numbers |= {"pantograph_scatter": np.float16(0.125), "bilateral": np.bool_(True)}
    numbers |= {"actuator": {"force_limit": np.float32(50), "delay": np.array(0.005)}}
    numbers |= {"line_condition": [{"irregularity": np.int8(1)}]}
    env = gymnasium.make("PantographStiffness-v0", **numbers)
    observation, info = env.reset(seed=np.int64(3), options={"distance": np.float32(10)})
    envs = gymnasium.make_vec("PantographStiffness-v0", np.int64(2), max_episode_steps=np.int16(9), **numbers)
    np.testing.assert_array_equal(envs.reset(seed=np.uint32(3))[0][0], observation)
    assert env.unwrapped.context.force_limit == 50
    assert 200 <= info["speed_kmh"] <= 250
    assert envs.num_envs == 2
