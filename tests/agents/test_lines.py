"""Training on lines drawn from a family or a section, several side by side."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from panto_agents import train
from panto_agents.lanes import PolicyLanes, lane_seeds, make_lanes
from panto_agents.model_file import read_model
from panto_agents.settings import parse_training
from panto_env import InputError, simulate
from panto_env.control.lines import on_drawn_line
from panto_env.control.settings import run_settings

ENVIRONMENT = {
    "id": "Pantograph-v0",
    "catenary": "family:high-speed",
    "line_values": True,
    "reward": "agent:target=nominal",  # no passive runs
    "accuracy": "fast",
    "distance": 30.0,
    "settle": 0.0,
}


def training(**changes):
    table = {
        "algorithm": "ppo",
        "seed": 1,
        "total_steps": 512,
        "lanes": 4,
        "lines": 2,
        "checkpoint_steps": 512,
        "environment": ENVIRONMENT,
        "evaluation": {"interval_steps": 512, "speeds_kmh": [300]},
        "hyperparameters": {"n_steps": 64, "batch_size": 64, "n_epochs": 1, "net_arch": [8]},
    }
    return parse_training(table | changes, "test")


@pytest.mark.parametrize("source", ["family:high-speed", "section:fast-line"])
def test_a_training_gives_a_policy_for_lines_that_it_has_not_met(source, tmp_path):
    own = training(environment=ENVIRONMENT | {"catenary": source})
    folder = train.train(own, tmp_path / "run", progress=False)
    facts, actor = read_model(folder.model)
    assert facts.environment["catenary"] == source
    assert facts.needs.line_values
    # Readings 5, place 2, speed, nominal force, line 7, action, with the deviation in the place of the force.
    assert actor.weights[0].shape == (8, 17)
    assert facts.ratio == pytest.approx(1.0, abs=0.5)
    for line in (source, "re330"):
        run = simulate(line, speed_kmh=300, policy=str(folder.model), seed=3, accuracy="fast", distance=900.0)
        assert run.summary().std > 0
    with pytest.raises(InputError, match="Only a flexible catenary has the values"):
        simulate("periodic-stiffness", policy=str(folder.model))


def test_lanes_of_a_training_meet_the_lines_of_its_seeds():
    own = training(seed=3)
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


@pytest.mark.parametrize("source", ["family:high-speed", "section:fast-line"])
def test_a_speed_of_an_evaluation_must_be_one_for_the_lines(source):
    with pytest.raises(InputError, match="has no line for 500 km/h"):
        training(
            environment=ENVIRONMENT | {"catenary": source},
            evaluation={"interval_steps": 512, "speeds_kmh": [500]},
        )
