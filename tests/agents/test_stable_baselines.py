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
from gymnasium.wrappers.vector import NormalizeObservation
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.evaluation import evaluate_policy
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
from panto_agents.model_file import Step, read_model, write_policy
from panto_agents.stable_baselines import save_policy
from panto_env import InputError, simulate
from panto_env.policies import find_policy, wishes

SHORT = {"distance": 120.0, "accuracy": "fast", "settle": 0.0}
NAME = "panto_env:Pantograph-v0"
torch.set_num_threads(1)  # more of them wait for each other where the networks are so small


def trained(kind, env, **more):
    return kind("MlpPolicy", env, seed=3, device="cpu", **more)


def bare(**more):
    return gymnasium.make(NAME, **SHORT | more)


def native(lanes=2, **more):
    return gymnasium.make_vec(NAME, num_envs=lanes, **SHORT | more)


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


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (lambda: trained(A2C, bare()), "ppo or sac"),
        (lambda: trained(PPO, gymnasium.make("Pendulum-v1")), "of this project|Pendulum"),
        (lambda: trained(PPO, VecNormalize(DummyVecEnv([bare] * 2))), "VecNormalize has no statistics"),
        (lambda: trained(PPO, bare(), policy_kwargs={"activation_fn": torch.nn.ELU}), "tanh or relu"),
        (lambda: trained(SAC, bare(), use_sde=True), "does more than linear layers"),
        (with_a_layer_of_its_own, "does more than linear layers"),
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


CHAINS = {
    "none": lambda: DummyVecEnv([bare] * 2),
    "normalised": lambda: single.NormalizeObservation(bare()),
    "stacked": lambda: single.FrameStackObservation(bare(), 3),
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
    "stacks on VecNormalize": lambda: VecFrameStack(VecNormalize(DummyVecEnv([bare] * 2), clip_obs=0.7), 3),
    "VecNormalize of rewards": lambda: VecNormalize(DummyVecEnv([bare] * 2), norm_obs=False),
    "many that change nothing": lambda: VecCheckNan(
        VecMonitor(
            DummyVecEnv([lambda: Monitor(Doubled(single.NormalizeReward(single.TimeLimit(bare(), 90))))])
        )
    ),
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


FEW = (
    *("normalised", "stacked on zeros, flat", "stacked twice, then normalised", "VecNormalize on stacks"),
    *("other actions", "vector"),
)


@pytest.mark.parametrize(
    ("kind", "chain"),
    [pytest.param(PPO, chain, marks=() if chain in FEW else pytest.mark.slow) for chain in CHAINS]
    + [
        pytest.param(SAC, chain, marks=() if chain == "vector" else pytest.mark.slow)
        for chain in ("none", "other actions", "VecNormalize on stacks", "vector")
    ],
)
def test_the_file_acts_as_the_model_does_through_its_wrappers(chain, kind, tmp_path):
    more = {"n_steps": 64, "batch_size": 64} if kind is PPO else {"learning_starts": 10, "batch_size": 8}
    model = trained(kind, CHAINS[chain](), policy_kwargs={"net_arch": [64, 64]}, **more).learn(100)
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
        (lambda: single.TransformAction(bare(), lambda a: -a, None), "TransformAction"),
        (lambda: Upside(bare()), "Upside"),
        (lambda: single.ClipReward(single.DelayObservation(bare(), 2), 0), "DelayObservation"),
        (lambda: single.TransformObservation(bare(), lambda o: -o, None), "TransformObservation"),
        (lambda: single.TimeAwareObservation(bare()), "TimeAwareObservation"),
        (lambda: single.RescaleObservation(bare(), -0.5, 3.0), "RescaleObservation"),
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
    model = trained(PPO, chain(), n_steps=32, batch_size=32).learn(32)
    with pytest.raises(InputError, match=name):
        save_policy(model, tmp_path / "mine.safetensors")
    assert not list(tmp_path.iterdir())
    model.get_env().close()


def test_of_lanes_in_processes_one_like_them_is_given(tmp_path):
    model = trained(PPO, SubprocVecEnv([bare] * 2, "fork"), n_steps=32, batch_size=32).learn(32)
    save_policy(model, tmp_path / "mine.safetensors", env=bare())
    model.get_env().close()
    assert wishes(find_policy(str(tmp_path / "mine.safetensors")))["observation"] == "centred"


def test_a_model_that_was_loaded_takes_the_environment_of_its_training(tmp_path):
    lanes = VecNormalize(DummyVecEnv([bare]))
    model = trained(PPO, single.RescaleAction(bare(), 0, 1), n_steps=32, batch_size=32).learn(32)
    trained(PPO, lanes, n_steps=32, batch_size=32).learn(32).save(tmp_path / "x")
    loaded = PPO.load(tmp_path / "x")
    mine = tmp_path / "mine.safetensors"
    with pytest.raises(InputError, match=r"has no environment, .* give as env that of its training"):
        save_policy(loaded, mine)
    with pytest.raises(InputError, match="env has other actions; give as env that"):
        save_policy(loaded, mine, env=model.get_env())
    with pytest.raises(InputError, match="NormalizeObservation has no statistics"):
        save_policy(loaded, mine, env=single.NormalizeObservation(bare()))
    with pytest.raises(InputError, match="The network has not the 20 inputs and 1 actions of the task"):
        save_policy(loaded, mine, env=single.FrameStackObservation(bare(), 2))
    assert not mine.exists()
    save_policy(loaded, mine, env=lanes)
    save_policy(loaded, tmp_path / "raw.safetensors", env=native())


def test_a_network_for_several_pantographs_is_refused(tmp_path):
    train = {"pantographs": ["dsa380", "dsa380"], "distances": [200.0], "controlled": [1, 2]}
    model = trained(PPO, bare(**train), n_steps=32, batch_size=32)
    with pytest.raises(InputError, match="in the vector environment, in which each is a lane"):
        save_policy(model, tmp_path / "mine.safetensors")


def test_a_stack_that_does_not_fit_is_not_a_whole_model_file(tmp_path):
    mine = tmp_path / "mine.safetensors"
    save_policy(trained(PPO, single.FrameStackObservation(bare(), 2), n_steps=32), mine)
    facts, actor = read_model(mine)
    wrong = facts.model_copy(
        update={"steps_before": (*facts.steps_before, Step(centre=(0.0,), scale=(1.0,)))}
    )
    write_policy(tmp_path / "wrong.safetensors", wrong, actor)
    with pytest.raises(InputError, match="do not fit each other"):
        find_policy(str(tmp_path / "wrong.safetensors"))


STIFFNESS = "panto_env:PantographStiffness-v0"


def make_lanes(lanes=3, mode="SameStep", **settings):
    return PantographVecEnv(gymnasium.make_vec(STIFFNESS, num_envs=lanes, autoreset_mode=mode, **settings))


@pytest.mark.parametrize("make_model", [PPO, SAC])
def test_stable_baselines_given_a_vector_environment_itself_names_its_wrapper(make_model):
    native = gymnasium.make_vec(STIFFNESS, num_envs=3)
    with pytest.raises(InputError, match=r"from panto_agents.lanes import PantographVecEnv"):
        make_model("MlpPolicy", native)
    assert repr(type(native)) == "<class 'panto_env.envs.vector.PantographVectorEnv'>"


def test_what_is_no_vector_environment_is_refused():
    for other in (gymnasium.make(STIFFNESS), gymnasium.make_vec("CartPole-v1"), "env"):
        with pytest.raises(
            InputError, match=r"needs an environment of gymnasium.make_vec for Pantograph-v0, .* not"
        ):
            PantographVecEnv(other)


@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_every_mode_of_autoreset_gives_the_same(mode):
    settings = {"distance": 20.0, "sensors": "realistic", "speed_kmh": (200, 300)}
    envs = [make_lanes(**settings), make_lanes(mode=mode, **settings)]
    for env in envs:
        env.seed(4)
    np.testing.assert_array_equal(*[env.reset() for env in envs])
    ends = 0
    for action in np.random.default_rng(0).uniform(-1, 1, (90, 3, 1)):
        mine, other = (env.step(action) for env in envs)
        for info in (*mine[3], *other[3]):
            info.get("episode", {"t": 0}).pop("t")  # on the clock
        np.testing.assert_equal(mine, other)
        ends += mine[2].sum()
    assert ends > 6


def test_wrappers_of_gymnasium_may_stand_between():
    native = gymnasium.make_vec(STIFFNESS, num_envs=3, distance=10.0)
    env = PantographVecEnv(NormalizeObservation(native))
    assert np.abs(env.reset()).max() < 10
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=32, device="cpu")
    model.learn(32)
    assert native.unwrapped.np_random_seed == env.get_attr("np_random_seed")[0]


def test_ends_as_stable_baselines_expects():
    env = make_lanes(distance=10.0)
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
    env = make_lanes(sensors="realistic")
    env.seed(4)
    observation = env.reset()
    for lane in range(3):
        single = gymnasium.make("panto_env:PantographStiffness-v0", sensors="realistic")
        np.testing.assert_array_equal(observation[lane], single.reset(seed=4 + lane)[0])


def test_an_agent_is_evaluated_without_a_wrapper(recwarn):
    env = make_lanes()
    env.seed(4)
    mean, _ = evaluate_policy(PPO("MlpPolicy", env, seed=0), env, n_eval_episodes=3)
    assert not [one for one in recwarn if "Monitor" in str(one.message)]
    env.seed(4)
    watched, _ = evaluate_policy(PPO("MlpPolicy", env, seed=0), VecMonitor(env), n_eval_episodes=3)
    assert mean == pytest.approx(watched, rel=1e-6)


def test_rest_of_the_interface():
    env = make_lanes()
    assert env.env_is_wrapped(VecMonitor) == [False] * 3
    assert env.get_attr("num_envs", indices=[0, 1]) == [3, 3]
    with pytest.raises(NotImplementedError, match="share one environment"):
        env.set_attr("num_envs", 1)


def test_the_end_of_an_episode_has_its_return_as_a_monitor_s():
    """Without it a training showed no reward."""
    plain, watched = make_lanes(distance=10.0), VecMonitor(make_lanes(distance=10.0))
    for env in (plain, watched):
        env.seed(4)
        env.reset()
    ends = 0
    for action in np.random.default_rng(0).uniform(-1, 1, (60, 3, 1)):
        *_, done, infos = plain.step(action)
        *_, others = watched.step(action)
        for lane in np.flatnonzero(done):
            ours, theirs = infos[lane]["episode"], others[lane]["episode"]
            assert set(ours) == {"r", "l", "t"}
            assert ours["l"] == theirs["l"]
            assert ours["r"] == pytest.approx(theirs["r"], rel=1e-5)
            ends += 1
    assert ends > 6
    model = PPO("MlpPolicy", plain, n_steps=64, batch_size=64, seed=0, device="cpu").learn(192)
    assert np.mean([episode["r"] for episode in model.ep_info_buffer]) < 0


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


def test_without_pictures_a_sentence_says_what_to_do():
    with pytest.raises(InputError, match="There are no pictures; add render_mode='rgb_array'"):
        make_lanes().get_images()


FILE = Path(__file__).parents[1] / "extensions" / "of_td3.py"


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
