"""Trainings in several variants of an environment, such as with several pantographs."""

from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from panto_agents.lanes import SideBySide, make_lanes
from panto_agents.policy import load
from panto_agents.settings import Training, parse_training
from panto_agents.train import train
from panto_env import InputError

VARIANTS = [{"pantograph": "dsa250"}, {"pantograph": "dsa380", "speed_kmh": 280}]


def settings(**changes: Any) -> Training:
    environment = {"id": "Pantograph-v0", "distance": 60.0, "settle": 0, "observation": "deviations"}
    table = {
        "algorithm": "ppo",
        "total_steps": 256,
        "lanes": 4,
        "checkpoint_steps": 256,
        "environment": environment | {"speed_kmh": 250} | changes.pop("environment", {}),
        "evaluation": {"interval_steps": 256, "speeds_kmh": [250]},
        "hyperparameters": {"n_steps": 64, "batch_size": 64, "n_epochs": 1, "net_arch": [8]},
        "variants": VARIANTS,
    }
    return parse_training(table | changes, "the test")


def test_each_variant_has_its_share_of_the_lanes():
    """The lanes side by side are those of each variant alone, under the seeds that follow each other."""
    together = make_lanes(settings())
    alone = [make_lanes(settings(lanes=2, variants=[], environment=own)) for own in VARIANTS]
    together.seed(3000)
    for first, lanes in zip((3000, 3002), alone, strict=True):
        lanes.seed(first)
    np.testing.assert_array_equal(together.reset(), np.concatenate([lanes.reset() for lanes in alone]))
    random, ended = np.random.default_rng(0), 0
    for _ in range(120):
        actions = random.uniform(-1, 1, (4, 1)).astype(np.float32)
        observations, rewards, dones, infos = together.step(actions)
        each = [lanes.step(actions[k : k + 2]) for k, lanes in zip((0, 2), alone, strict=True)]
        for whole, parts in zip(
            (observations, rewards, dones), zip(*(own[:3] for own in each), strict=True), strict=True
        ):
            np.testing.assert_array_equal(whole, np.concatenate(parts))
        assert [info.get("figures") for info in infos] == [
            info.get("figures") for own in each for info in own[3]
        ]
        ended += int(dones.sum())
    assert ended >= 4
    side_by_side = together.venv
    assert isinstance(side_by_side, SideBySide)
    assert side_by_side.seconds > 0
    assert len(side_by_side.get_attr("num_envs")) == 4
    assert side_by_side.env_is_wrapped(object) == [False] * 4
    assert side_by_side.get_attr("num_envs", indices=[3]) == [2]
    for lanes in (together, *alone):
        lanes.close()


def test_a_training_learns_from_all_and_evaluates_all(tmp_path):
    folder = train(settings(), tmp_path / "run", progress=False)
    with folder.evaluations.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2  # a speed and a seed for each variant
    assert rows[0]["passive_std"] != rows[1]["passive_std"]
    assert load(folder.best).facts.variants == tuple(VARIANTS)


def test_each_variant_is_evaluated_at_its_own_speeds_unless_they_are_given():
    training = settings(evaluation={"interval_steps": 256})
    assert [training.speeds_in(own) for own in training.environments] == [(250.0,), (280.0,)]
    training = settings()
    assert [training.speeds_in(own) for own in training.environments] == [(250.0,), (250.0,)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lanes": 3}, "3 lanes cannot be shared equally by 2 variants"),
        ({"start_from": "pd"}, "start_from and variants exclude each other"),
        ({"variants": [{"pantograph": "nobody"}]}, "nobody"),
        ({"variants": [{"panto": "dsa250"}]}, "panto"),
    ],
)
def test_variants_that_cannot_be_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        settings(**changes)


def test_variants_with_other_observations_are_refused():
    environment = {"observation": "full"}
    variants = [{"pantograph": "dsa250"}, {"pantograph": "identified-2dof"}]
    with pytest.raises(InputError, match="must have the same observations and actions"):
        make_lanes(settings(environment=environment, variants=variants))
