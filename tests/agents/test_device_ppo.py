"""PPO whose environments and network share a device: here the processor's tensors, which need no GPU."""

import math

import pytest

pytest.importorskip("torch")

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


@pytest.mark.longer
def test_learns_and_goes_on(tmp_path):
    training = parse_training(RECIPE, "test")
    run = train(training, tmp_path / "run", progress=False)
    facts, actor = read_model(run.model)
    assert (facts.steps, facts.algorithm) == (8_192, "ppo")
    assert facts.ratio < 0.95  # of a passive pantograph's sigma
    more = training.model_copy(update={"total_steps": 10_240})
    again = train(more, tmp_path / "run", resume=True, progress=False)
    facts, later = read_model(again.model)
    assert facts.steps == 10_240
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
