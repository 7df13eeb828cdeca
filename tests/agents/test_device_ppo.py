"""PPO whose environments and network share a device: here the processor's tensors, which need no GPU."""

import math
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box

pytest.importorskip("torch")

import stable_baselines3 as sb3
import torch
from stable_baselines3.common.logger import configure

from panto_agents.algorithm import PPO
from panto_agents.device_ppo import DevicePPO
from panto_agents.model_file import read_model
from panto_agents.settings import parse_training
from panto_agents.train import train
from panto_env import InputError

RECIPE = {
    "algorithm": "ppo",
    "device": "cpu",
    "total_steps": 8_192,
    "lanes": 64,
    "checkpoint_steps": 8_192,
    "environment": {"id": "PantographStiffness-v0", "distance": 300.0},
    "evaluation": {"interval_steps": 8_192, "speeds_kmh": [300]},
    "hyperparameters": {"n_steps": 32, "batch_size": 256, "n_epochs": 5, "learning_rate": 1e-3},
}
SHARED = (
    "batch_size",
    "n_epochs",
    "learning_rate",
    "clip_range",
    "target_kl",
    "ent_coef",
    "vf_coef",
    "max_grad_norm",
)
LAYERS = {
    "actor.0": "mlp_extractor.policy_net.0",
    "actor.2": "action_net",
    "critic.0": "mlp_extractor.value_net.0",
    "critic.2": "value_net",
}
NAMES = {"log_std": "log_std"} | {
    f"{own}.{part}": f"{other}.{part}" for own, other in LAYERS.items() for part in ("weight", "bias")
}
"""Of parameters here, in Stable-Baselines3."""


@pytest.mark.longer
def test_learns_and_goes_on(tmp_path):
    training = parse_training(RECIPE, "test")
    run = train(training, tmp_path / "run", progress=False)
    facts, actor = read_model(run.model)
    assert (facts.steps, facts.algorithm) == (8_192, "ppo")
    assert facts.ratio < 0.95  # of a passive pantograph's sigma
    more = training.model_copy(update={"total_steps": 10_240})
    again = train(more, tmp_path / "run", resume=True, progress=False)
    first, (facts, later) = facts, read_model(again.model)
    assert facts.steps == 10_240
    assert read_model(again.best)[0].ratio == min(first.ratio, facts.ratio)
    assert math.isfinite(facts.ratio)
    assert any((a != b).any() for a, b in zip(actor.weights, later.weights, strict=True))


@pytest.mark.longer
def test_same_seed_same_model(tmp_path):
    short = RECIPE | {"total_steps": 2_048}
    actors = [
        read_model(train(parse_training(short, "test"), tmp_path / name, progress=False).model)[1]
        for name in ("one", "two")
    ]
    assert all((a == b).all() for a, b in zip(*(each.weights for each in actors), strict=True))


class Still(gymnasium.Env):
    """Nothing happens in it."""

    observation_space, action_space = Box(-1, 1, (3,)), Box(-1, 1, (2,))


@pytest.mark.longer
@pytest.mark.parametrize("target_kl", [None, 0.05, 0.01])
def test_an_update_is_that_of_stable_baselines_3(target_kl):
    """From the same steps, whose policy was so different that many ratios are clipped."""
    given = {"batch_size": 96, "n_epochs": 9, "net_arch": (8,), "ent_coef": 0.01, "learning_rate": 1e-2}
    settings = PPO(**given, target_kl=target_kl)
    shared = {name: getattr(settings, name) for name in SHARED}
    theirs = sb3.PPO("MlpPolicy", Still(), n_steps=96, **shared, policy_kwargs=settings.policy_kwargs())
    theirs.set_logger(configure(None, []))
    spaces = {f"single_{name}": getattr(Still, name) for name in ("observation_space", "action_space")}
    ours = DevicePPO(settings, SimpleNamespace(env=SimpleNamespace(device="cpu", **spaces)), seed=0)
    ours._optimiser.param_groups[0]["lr"] = 1e-2
    weights = theirs.policy.state_dict()
    ours.network.load_state_dict({name: weights[other] for name, other in NAMES.items()})

    random = np.random.default_rng(0)
    steps = [random.normal(size=shape).astype(np.float32) for shape in ((96, 3), (96, 2), 96, 96, 96)]
    observations, actions, changes, advantages, returns = map(torch.as_tensor, steps)
    with torch.no_grad():
        before = ours.network.actions(observations).log_prob(actions) + 0.3 * changes
    ours._learn_from((observations, actions, before, advantages, returns))
    buffer = theirs.rollout_buffer
    kept = buffer.observations, buffer.actions, buffer.log_probs, buffer.advantages, buffer.returns
    for array, given in zip(kept, (*steps[:2], before, *steps[3:]), strict=True):
        array[:, 0] = given
    buffer.full = True
    theirs.train()
    weights = theirs.policy.state_dict()
    for name, own in ours.network.state_dict().items():
        torch.testing.assert_close(own, weights[NAMES[name]], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"washout": {}}, "leave out washout"),
        ({"residual_of": "repetitive"}, "leave out residual_of"),
        ({"algorithm": "sac", "hyperparameters": {}}, "only ppo learns"),
    ],
)
def test_refused(changes, said):
    with pytest.raises(InputError, match=said):
        parse_training(RECIPE | changes, "test")
