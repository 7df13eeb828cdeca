"""Models that other libraries trained, as policies, and the lanes that Stable-Baselines3 learns in."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3")


from pathlib import Path

import gymnasium
import gymnasium.wrappers as single
import gymnasium.wrappers.vector as several
import numpy as np
import torch
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    SubprocVecEnv,
    VecCheckNan,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
    VecVideoRecorder,
)

from panto_agents.lanes import PantographVecEnv
from panto_agents.stable_baselines import save_policy
from panto_env import InputError, simulate
from panto_env.policies import find_policy, wishes

SHORT = {"distance": 120.0, "accuracy": "fast", "settle": 0.0}
NAME = "panto_env:Pantograph-v0"
TRAIN = {"pantographs": ["dsa380", "dsa380"], "distances": [200.0], "controlled": [1, 2]}
torch.set_num_threads(1)  # more of them wait for each other where the networks are so small


def trained(kind, env, **more):
    return kind("MlpPolicy", env, seed=3, device="cpu", **more)


def bare(**more):
    return gymnasium.make(NAME, **SHORT | more)


def native(lanes=2, **more):
    return gymnasium.make_vec(NAME, num_envs=lanes, **SHORT | more)


@pytest.mark.slow
def test_a_pass_of_it_has_the_washout_of_its_training(tmp_path):
    mine = str(tmp_path / "mine.safetensors")
    save_policy(trained(PPO, bare(), n_steps=64).learn(64), mine)
    asked = {"observation": "centred", "history": 0, "washout": 1.0}
    assert wishes(find_policy(mine)).items() >= asked.items()
    run = simulate(policy=mine, distance=60.0, actuator="realistic", sensors="realistic")
    assert run.settings["washout"] == 1.0


def with_a_layer_of_its_own():
    model = trained(PPO, bare(), n_steps=64)
    model.policy.action_net = torch.nn.Sequential(model.policy.action_net, torch.nn.Hardtanh(-1e-3, 1e-3))
    return model


@pytest.mark.longer
@pytest.mark.parametrize(
    ("model", "message"),
    [
        (lambda: trained(A2C, bare()), "ppo or sac"),
        (lambda: trained(PPO, gymnasium.make("Pendulum-v1")), "of this project|Pendulum"),
        (lambda: trained(PPO, VecNormalize(DummyVecEnv([bare] * 2))), "VecNormalize has no statistics"),
        (lambda: trained(PPO, bare(), policy_kwargs={"activation_fn": torch.nn.ELU}), "tanh or relu"),
        (lambda: trained(SAC, bare(), use_sde=True), "does more than linear layers"),
        (with_a_layer_of_its_own, "does more than linear layers"),
        (lambda: trained(PPO, bare(**TRAIN)), "in the vector environment, in which each is a lane"),
    ],
)
def test_models_that_a_file_cannot_hold_are_refused(model, message, tmp_path):
    with pytest.raises(InputError, match=message):
        save_policy(model(), tmp_path / "mine.safetensors")
    assert not list(tmp_path.iterdir())


class Doubled(gymnasium.RewardWrapper):
    """A reward of one's own, which no policy sees."""

    def reward(self, reward):
        return 2 * reward


class Upside(gymnasium.RewardWrapper):
    """It looks like one of rewards only."""

    def reward(self, reward):
        return reward

    def step(self, action):
        return self.env.step(-action)


def unchanged():
    return DummyVecEnv([lambda: Monitor(Doubled(single.NormalizeReward(single.TimeLimit(bare(), 90))))])


CHAINS = {
    "normalised": lambda: single.NormalizeObservation(bare()),
    "stacked on zeros, flat": lambda: single.FlattenObservation(
        single.FrameStackObservation(bare(), 3, padding_type="zero")
    ),
    "stacked twice, then normalised": lambda: single.NormalizeObservation(
        single.FrameStackObservation(single.FrameStackObservation(bare(), 2), 2)
    ),
    "other actions": lambda: single.RescaleAction(single.RescaleAction(bare(), -3.0, 5.0), 0.0, 0.5),
    "VecNormalize on stacks": lambda: VecNormalize(
        VecFrameStack(DummyVecEnv([bare] * 2), 3), clip_obs=0.7, norm_reward=True
    ),
    "many that change nothing": lambda: VecNormalize(VecCheckNan(VecMonitor(unchanged())), norm_obs=False),
    "vector": lambda: PantographVecEnv(several.RescaleAction(several.NormalizeObservation(native()), 0, 1)),
}


def freeze(env):
    """Stop the statistics of all wrappers, as a saved file has them."""
    while env is not None:
        for name in ("training", "update_running_mean"):
            if hasattr(type(env), name) or name in vars(env):
                setattr(env, name, False)
        for each in getattr(env, "envs", ()):
            freeze(each)
        env = vars(env).get("venv", vars(env).get("env"))


def make_lively(model, env):
    """Large weights in the last layer, and the middle of the range for a first observation."""
    last = model.policy.action_net if isinstance(model, PPO) else model.actor.mu
    last.weight.data.normal_(0, 0.1, generator=torch.Generator().manual_seed(0))
    values = []
    env.seed(5)
    hook = last.register_forward_hook(lambda layer, given, value: values.append(value[0]))
    model.predict(env.reset(), deterministic=True)
    hook.remove()
    middle = model.action_space.low + model.action_space.high if isinstance(model, PPO) else np.zeros(1)
    last.bias.data += torch.as_tensor(middle / 2, dtype=torch.float32) - values[0]


def base_of(env):
    """The environment without wrappers, and how to read an action of its first lane."""
    while "venv" in vars(env):
        env = env.venv
    return (env.envs[0] if "envs" in vars(env) else env.env).unwrapped


@pytest.mark.longer
@pytest.mark.parametrize(("kind", "chain"), [*((PPO, chain) for chain in CHAINS), (SAC, "vector")])
def test_the_file_acts_as_the_model_does_through_its_wrappers(chain, kind, tmp_path):
    more = {"n_steps": 64, "batch_size": 64} if kind is PPO else {"learning_starts": 10, "batch_size": 8}
    model = trained(kind, CHAINS[chain](), policy_kwargs={"net_arch": [64, 64]}, **more).learn(64)
    env = model.get_env()
    freeze(env)
    make_lively(model, env)
    save_policy(model, tmp_path / "mine.safetensors")
    policy = find_policy(str(tmp_path / "mine.safetensors"))
    base, raw = base_of(env), []
    step = base.step
    base.step = lambda action: raw.append(action) or step(action)
    env.seed(5)
    observation, twin = env.reset(), bare().unwrapped
    seen, _ = twin.reset(seed=5)
    policy.reset(twin.context)
    for _ in range(25):
        action, _ = model.predict(observation, deterministic=True)
        observation, *_ = env.step(action)
        own = policy.act(seen)
        np.testing.assert_allclose(own, np.clip(np.reshape(raw[-1], (-1, 1))[0], -1, 1), atol=2e-5)
        seen, *_ = twin.step(own.astype(np.float32))
    assert np.ptp(raw) > 1e-3
    policy.reset(twin.context)  # and begins anew
    np.testing.assert_allclose(policy.act(twin.reset(seed=5)[0]), np.reshape(raw[0], (-1, 1))[0], atol=2e-5)


@pytest.mark.parametrize(
    ("chain", "name"),
    [
        (lambda: Upside(bare()), "Upside"),
        (lambda: single.ClipReward(single.DelayObservation(bare(), 2), 0), "DelayObservation"),
        (lambda: single.StickyAction(bare(), 0.5), "StickyAction"),
        (lambda: PantographVecEnv(several.TransformAction(native(), lambda a: -a)), "TransformAction"),
        (lambda: DummyVecEnv([lambda: Upside(bare())] * 2), "Upside"),
        (lambda: VecMonitor(SubprocVecEnv([bare], "fork")), "SubprocVecEnv"),
        (
            lambda: DummyVecEnv([lambda: single.NormalizeObservation(bare())] * 2),
            "statistics or wrappers of their own",
        ),
    ],
)
def test_other_wrappers_are_refused_by_name_before_anything_is_written(chain, name, tmp_path):
    model = trained(PPO, chain(), n_steps=2, batch_size=2).learn(2)
    with pytest.raises(InputError, match=name):
        save_policy(model, tmp_path / "mine.safetensors")
    assert not list(tmp_path.iterdir())
    model.get_env().close()


def test_a_model_that_was_loaded_takes_the_environment_of_its_training(tmp_path):
    lanes = VecNormalize(DummyVecEnv([bare]))
    trained(PPO, lanes, n_steps=8, batch_size=8).learn(8).save(tmp_path / "x")
    loaded = PPO.load(tmp_path / "x")
    mine = tmp_path / "mine.safetensors"
    for message, env in {
        r"has no environment, .* give as env that of its training": None,
        "env has other actions; give as env that": single.RescaleAction(bare(), 0, 1),
        "NormalizeObservation has no statistics": single.NormalizeObservation(bare()),
        "not the 20 inputs and 1 actions of the task": single.FrameStackObservation(bare(), 2),
    }.items():
        with pytest.raises(InputError, match=message):
            save_policy(loaded, mine, env=env)
    assert not mine.exists()
    save_policy(loaded, mine, env=lanes)
    save_policy(loaded, tmp_path / "raw.safetensors", env=native())


STIFFNESS = "panto_env:PantographStiffness-v0"


def make_lanes(lanes=3, mode="SameStep", **settings):
    return PantographVecEnv(gymnasium.make_vec(STIFFNESS, num_envs=lanes, autoreset_mode=mode, **settings))


def test_what_is_no_vector_environment_is_refused_as_is_one_without_its_wrapper():
    for other in (gymnasium.make(STIFFNESS), gymnasium.make_vec("CartPole-v1"), "env"):
        with pytest.raises(InputError, match=r"needs an environment of gymnasium.make_vec for Pantograph-v0"):
            PantographVecEnv(other)
    with pytest.raises(InputError, match=r"from panto_agents.lanes import PantographVecEnv"):
        PPO("MlpPolicy", gymnasium.make_vec(STIFFNESS, num_envs=3))


def test_every_mode_of_autoreset_gives_the_same():
    settings = {"distance": 20.0, "sensors": "realistic", "speed_kmh": (200, 300)}
    envs = [make_lanes(mode=mode, **settings) for mode in ("SameStep", "NextStep", "Disabled")]
    for env in envs:
        env.seed(4)
    first, *others = [env.reset() for env in envs]
    for each in others:
        np.testing.assert_array_equal(each, first)
    ends = 0
    for action in np.random.default_rng(0).uniform(-1, 1, (90, 3, 1)):
        mine, *others = [env.step(action) for env in envs]
        for each in (mine, *others):
            for info in each[3]:
                info.get("episode", {"t": 0}).pop("t")  # on the clock
            np.testing.assert_equal(mine, each)
        ends += mine[2].sum()
    assert ends > 6


def test_ends_as_stable_baselines_expects_with_its_return_as_a_monitor_s():
    """Without it a training showed no reward."""
    plain, watched = make_lanes(distance=10.0), VecMonitor(make_lanes(distance=10.0))
    for env in (plain, watched):
        env.seed(4)
        first = env.reset()
    assert first.dtype == np.float32
    ends = 0
    for action in np.random.default_rng(0).uniform(-1, 1, (60, 3, 1)):
        observation, reward, done, infos = plain.step(action)
        *_, others = watched.step(action)
        assert reward.dtype == np.float32
        for lane in np.flatnonzero(done):
            np.testing.assert_array_equal(observation[lane], first[lane])
            assert infos[lane]["TimeLimit.truncated"]
            assert infos[lane]["terminal_observation"].shape == (9,)
            assert infos[lane]["figures"]["mean"] > 0
            ours, theirs = infos[lane]["episode"], others[lane]["episode"]
            assert (set(ours), ours["l"]) == ({"r", "l", "t"}, theirs["l"])
            assert ours["r"] == pytest.approx(theirs["r"], rel=1e-5)
            ends += 1
    assert ends > 6


def test_seed_of_lane_i_is_seed_plus_i():
    env = make_lanes(sensors="realistic")
    env.seed(4)
    observation = env.reset()
    for lane in range(3):
        single = gymnasium.make(STIFFNESS, sensors="realistic")
        np.testing.assert_array_equal(observation[lane], single.reset(seed=4 + lane)[0])


def test_rest_of_the_interface():
    env = make_lanes()
    assert env.env_is_wrapped(VecMonitor) == [False] * 3
    assert env.env_is_wrapped(Monitor, indices=[0, 1]) == [True] * 2  # so that an evaluation does not warn
    with pytest.raises(InputError, match="There are no pictures; add render_mode='rgb_array'"):
        env.get_images()
    assert env.get_attr("num_envs", indices=[0, 1]) == [3, 3]
    with pytest.raises(NotImplementedError, match="share one environment"):
        env.set_attr("num_envs", 1)


def test_options_go_to_the_lanes():
    env = make_lanes()
    env.set_options({"speed_kmh": 200})
    env.reset()
    assert [info["speed_kmh"] for info in env.reset_infos] == pytest.approx([200] * 3)
    env.set_options([{"speed_kmh": 200}, {}, {}])
    with pytest.raises(InputError, match="the same options for all"):
        env.reset()


def test_pictures_are_those_of_the_lanes(tmp_path):
    pytest.importorskip("PIL")
    env = make_lanes(render_mode="rgb_array", render_size=(128, 96), distance=30.0)
    env.reset()
    frames = env.get_images()
    assert [frame.shape for frame in frames] == [(96, 128, 3)] * 3
    assert env.render().shape[2] == 3
    pytest.importorskip("moviepy")
    recorder = VecVideoRecorder(env, str(tmp_path), lambda step: step == 0, video_length=5)
    assert recorder.frames_per_sec == env.env.metadata["render_fps"]
    recorder.reset()
    for _ in range(7):
        recorder.step(np.zeros((3, 1), np.float32))
    recorder.close()
    assert len(list(tmp_path.glob("*.mp4"))) == 1


FILE = Path(__file__).parents[1] / "extensions" / "of_td3.py"


@pytest.mark.longer
def test_a_file_of_any_library_acts_as_the_model_does(tmp_path):
    lanes = DummyVecEnv([bare])
    kwargs = {"learning_starts": 20, "batch_size": 8, "policy_kwargs": {"net_arch": [16]}}
    model = TD3("MlpPolicy", lanes, seed=0, device="cpu", **kwargs).learn(40)
    model.save(tmp_path / "td3.zip")
    (tmp_path / "policy.py").write_text(FILE.read_text())
    policy = find_policy(f"{tmp_path / 'policy.py'}:Mine")
    assert wishes(policy) == {"observation": "centred", "history": 0, "washout": 1.0}
    lanes.seed(5)
    observation, twin = lanes.reset(), bare().unwrapped
    seen, _ = twin.reset(seed=5)
    policy.reset(twin.context)
    for _ in range(10):
        action = model.predict(observation, deterministic=True)[0]
        np.testing.assert_allclose(policy.act(seen), action[0], atol=1e-6)
        observation, *_ = lanes.step(action)
        seen, *_ = twin.step(action[0])
    real = {"actuator": "realistic", "sensors": "realistic"}
    run = simulate(policy=f"{tmp_path / 'policy.py'}:Mine", distance=60.0, accuracy="fast", **real)
    assert np.ptp(run.frame_force) > 0
