"""A model that Stable-Baselines3 trained by itself, saved as a policy: the same actions, in every command."""

import gymnasium
import gymnasium.wrappers as single
import gymnasium.wrappers.vector as several
import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    SubprocVecEnv,
    VecCheckNan,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)

from panto_agents.lanes import PantographVecEnv
from panto_agents.model_file import Step, read_model, write_policy
from panto_agents.stable_baselines import save_policy
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


def with_a_layer_of_its_own():
    model = trained(PPO, gymnasium.make(NAME, **SHORT), n_steps=64)
    model.policy.action_net = torch.nn.Sequential(model.policy.action_net, torch.nn.Hardtanh(-1e-3, 1e-3))
    return model


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (lambda: trained(A2C, gymnasium.make(NAME, **SHORT)), "ppo or sac"),
        (lambda: trained(PPO, gymnasium.make("Pendulum-v1")), "of this project|Pendulum"),
        (lambda: trained(PPO, VecNormalize(environments()["dummy"])), "VecNormalize has no statistics"),
        (
            lambda: PPO(
                "MlpPolicy",
                gymnasium.make(NAME, **SHORT),
                policy_kwargs={"activation_fn": torch.nn.ELU},
            ),
            "tanh or relu",
        ),
        (lambda: trained(SAC, gymnasium.make(NAME, **SHORT), use_sde=True), "does more than linear layers"),
        (lambda: with_a_layer_of_its_own(), "does more than linear layers"),
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


def bare(**more):
    return gymnasium.make(NAME, **SHORT | more)


def native(lanes=2, **more):
    return gymnasium.make_vec(NAME, num_envs=lanes, **SHORT | more)


CHAINS = {
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


@pytest.mark.parametrize(
    ("kind", "chain"),
    [(PPO, chain) for chain in CHAINS]
    # Stable-Baselines3's buffer takes no stacks of what VecNormalize has normalised.
    + [(SAC, chain) for chain in CHAINS if chain != "stacks on VecNormalize"],
)
def test_the_file_acts_as_the_model_does_through_its_wrappers(chain, kind, tmp_path):
    more = {"n_steps": 64, "batch_size": 64} if kind is PPO else {"learning_starts": 10, "batch_size": 8}
    model = trained(kind, CHAINS[chain](), **more).learn(100)
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
