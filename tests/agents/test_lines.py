"""Training on lines drawn from a family or a section, and in variants such as with several pantographs."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3")


import csv
from typing import Any

import gymnasium
import numpy as np

from panto_agents import train
from panto_agents.lanes import PolicyLanes, SideBySide, lane_seeds, make_lanes
from panto_agents.model_file import read_model
from panto_agents.policy import load
from panto_agents.settings import Training
from panto_env import InputError, simulate
from panto_env.control.lines import on_drawn_line
from panto_env.control.settings import run_settings

from .test_agents import settings

ENVIRONMENT = {
    "id": "Pantograph-v0",
    "catenary": "family:high-speed",
    "line_values": True,
    "reward": "agent:target=nominal",  # no passive runs
    "accuracy": "fast",
    "distance": 30.0,
    "settle": 0.0,
}


def training(**changes: Any) -> Training:
    evaluation = {"interval_steps": 256, "speeds_kmh": [300]}
    usual = {"lanes": 4, "checkpoint_steps": 256, "environment": ENVIRONMENT, "evaluation": evaluation}
    return settings("ppo", **usual | changes)


@pytest.mark.longer
def test_a_training_gives_a_policy_for_lines_that_it_has_not_met(tmp_path):
    folder = train.train(training(lines=2), tmp_path / "run", progress=False)
    facts, actor = read_model(folder.model)
    assert facts.environment["catenary"] == "family:high-speed"
    assert facts.needs.line_values
    # Readings 5, place 2, speed, nominal force, line 7, action, with the deviation in the place of the force.
    assert actor.weights[0].shape == (8, 17)
    assert facts.ratio == pytest.approx(1.0, abs=0.5)
    run = simulate("re330", speed_kmh=300, policy=str(folder.model), accuracy="fast", distance=900.0)
    assert run.summary().std > 0
    with pytest.raises(InputError, match="Only a flexible catenary has the values"):
        simulate("periodic-stiffness", policy=str(folder.model))


def test_lanes_of_a_training_meet_the_lines_of_its_seeds():
    own = training(seed=3, lines=2)
    lanes = make_lanes(own)
    seeds = lane_seeds(own)
    lanes.seed(seeds[0])
    lanes.reset()
    native = lanes.unwrapped.env
    given = run_settings({"speed_kmh": (200, 350), "catenary": "family:high-speed"})
    for lane, first in ((0, 0), (1, 0), (2, 2), (3, 2)):
        expected = on_drawn_line(given, lambda seed=seeds[first]: np.random.default_rng(seed)).line
        assert native.context(lane).catenary == expected


def test_base_policies_get_the_context_of_their_lane_s_line(tmp_path):
    file = tmp_path / "keeper.py"
    file.write_text(
        "class Keeper:\n"
        "    def reset(self, context):\n"
        "        self.context = context\n"
        "    def act(self, observation):\n"
        "        return [0.0]\n"
    )
    given = {name: value for name, value in ENVIRONMENT.items() if name != "id"}
    native = gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=4, lines=2, **given).unwrapped
    native.reset(seed=2000)
    base = PolicyLanes(f"{file}:Keeper", native)
    base.begin(np.arange(4))
    lines = [policy.context.catenary for policy in base._policies]
    assert lines == [native.context(lane).catenary for lane in range(4)]
    assert lines[1] != lines[2]


def test_a_speed_of_an_evaluation_must_be_one_for_the_lines():
    with pytest.raises(InputError, match="has no line for 500 km/h"):
        training(evaluation={"interval_steps": 256, "speeds_kmh": [500]})


VARIANTS = [{"pantograph": "dsa250"}, {"pantograph": "dsa380", "speed_kmh": 280}]


def varied(environment: Any = None, **changes: Any) -> Training:
    usual = {"id": "Pantograph-v0", "distance": 60.0, "settle": 0, "observation": "deviations"}
    environment = usual | {"speed_kmh": 250} | (environment or {})
    evaluation = {"interval_steps": 256, "speeds_kmh": [250]}
    usual = {"environment": environment, "evaluation": evaluation, "variants": VARIANTS, "seed": 0}
    return training(**usual | changes)


def test_each_variant_has_its_share_of_the_lanes():
    """The lanes side by side are those of each variant alone, under the seeds that follow each other."""
    together = make_lanes(varied())
    alone = [make_lanes(varied(lanes=2, variants=[], environment=own)) for own in VARIANTS]
    together.seed(3000)
    for first, lanes in zip((3000, 3002), alone, strict=True):
        lanes.seed(first)
    np.testing.assert_array_equal(together.reset(), np.concatenate([lanes.reset() for lanes in alone]))
    random, ended = np.random.default_rng(0), 0
    for _ in range(95):
        actions = random.uniform(-1, 1, (4, 1)).astype(np.float32)
        observations, rewards, dones, infos = together.step(actions)
        each = [lanes.step(actions[k : k + 2]) for k, lanes in zip((0, 2), alone, strict=True)]
        for k, whole in enumerate((observations, rewards, dones)):
            np.testing.assert_array_equal(whole, np.concatenate([own[k] for own in each]))
        parts = [info for own in each for info in own[3]]
        assert [info.get("figures") for info in infos] == [info.get("figures") for info in parts]
        ended += int(dones.sum())
    assert ended >= 4
    assert isinstance(together, SideBySide)
    assert together.seconds > 0
    assert len(together.get_attr("num_envs")) == 4
    assert together.env_is_wrapped(object) == [False] * 4
    assert together.get_attr("num_envs", indices=[3]) == [2]
    for lanes in (together, *alone):
        lanes.close()


@pytest.mark.longer
def test_a_training_learns_from_all_and_evaluates_all(tmp_path):
    folder = train.train(varied(), tmp_path / "run", progress=False)
    with folder.evaluations.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2  # a speed and a seed for each variant
    assert rows[0]["passive_std"] != rows[1]["passive_std"]
    assert load(folder.best).facts.variants == tuple(VARIANTS)


def test_each_variant_is_evaluated_at_its_own_speeds_unless_they_are_given():
    training = varied(evaluation={"interval_steps": 256})
    assert [training.speeds_in(own) for own in training.environments] == [(250.0,), (280.0,)]
    training = varied()
    assert [training.speeds_in(own) for own in training.environments] == [(250.0,), (250.0,)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lanes": 3}, "3 lanes cannot be shared equally by 2 variants"),
        ({"start_from": "pd"}, "start_from and variants exclude each other"),
        ({"variants": [{"pantograph": "nobody"}]}, "nobody"),
        ({"variants": [{"panto": "dsa250"}]}, "panto"),
        ({"variants": [{"id": "PantographStiffness-v0"}]}, "its id stands in"),
        (
            {
                "environment": {"observation": "full"},
                "variants": [{"pantograph": "dsa250"}, {"pantograph": "identified-2dof"}],
            },
            "must have the same observations and actions, not .* and .* entries",
        ),
    ],
)
def test_variants_that_cannot_be_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        make_lanes(varied(**changes))
