"""The agents that come with the project: whole, safe, small, told what made them, better than nothing."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import load_file

from panto_agents.model_file import read_model
from panto_agents.policy import Ensemble
from panto_agents.stored import FOLDER, further_trainings
from panto_configs import find
from panto_env import InputError, simulate
from panto_env.analysis.simulation import ready_pass
from panto_env.base.files import read_toml
from panto_env.catalog import load_catenary
from panto_env.policies import find_policy, policy_names

from ..marks import some_at_once

NAMES = sorted(path.stem for path in FOLDER.glob("*.safetensors"))
KEPT = ("catenary", "pantograph", "pantographs", "distances", "controlled", "actuator", "sensors")
AGENTS = {
    "known-line": ("agent-clone", 0.72),
    "head": ("agent-head", 0.40),
    "high-speed": ("agent-high-speed", 0.75),
    "train": ("agent-train", 0.55),
    "any-line": ("agent-any-line", 0.6),
    "any-pantograph": ("agent-any-pantograph", 0.6),
    "robust": ("agent-robust", 0.6),
    "small": ("agent-small", 0.65),
    "trailing": ("agent-trailing", 0.6),
    "trailing-alone": ("agent-trailing-alone", 0.6),
}
"""Configuration, and sigma over that of the passive pantograph at 300 km/h on a test seed: at most."""


def recipe(name):
    """The table of an agent's training."""
    return read_toml(find(AGENTS[name][0], "training"))


def given(name):
    """Settings of a pass as in the agent's training."""
    environment = recipe(name)["environment"]
    kept = {key: environment[key] for key in KEPT if key in environment}
    return {"actuator": "realistic", "sensors": "realistic", "speed_kmh": 300.0, "seed": 0} | kept


def test_each_file_is_a_policy_and_each_policy_has_its_file():
    assert sorted(AGENTS) == NAMES
    agents = {each for each in policy_names() if each.startswith("agent-")}
    assert agents == {f"agent-{name}" for name in NAMES} | {"agent-any-line-five"}


def test_five_trainings_act_by_the_mean_of_their_actions():
    settings = {key: value for key, value in given("any-line").items() if key != "seed"}
    task, _ = ready_pass("agent-any-line-five", settings, 0)
    members = [find_policy(f"agent-any-line:seed={seed}") for seed in range(5)]
    for policy in (five := find_policy("agent-any-line-five"), *members):
        policy.reset(task.context(0))
    random = np.random.default_rng(0)
    for _ in range(10):
        observation = (task.results.observation[0] + random.normal(0, 0.3)).astype(np.float32)
        actions = [member.act(observation) for member in members]
        np.testing.assert_array_equal(five.act(observation), np.mean(actions, axis=0))
    assert np.ptp(actions) > 1e-3  # they differ


def test_an_ensemble_is_of_agents_for_the_same_task():
    with pytest.raises(ValueError, match="the same task"):
        Ensemble([find_policy("agent-any-line"), find_policy("agent-head")])


@pytest.mark.parametrize("name", NAMES)
def test_each_is_small_holds_nothing_pickled_and_says_what_made_it(name):
    training = recipe(name)
    paths = {0: FOLDER / f"{name}.safetensors"} | further_trainings(name)
    first, _ = read_model(paths[0])
    assert first.environment == training["environment"]
    assert first.variants == tuple(training.get("variants", ()))
    assert training.get("seed", 0) == 0
    assert first.command.split()[:3] == ["panto", "train", AGENTS[name][0]]
    for seed, path in paths.items():
        assert path.stat().st_size < 500_000
        assert all(each.startswith("actor/") for each in load_file(path))
        facts, _ = read_model(path)
        assert facts.seed == seed
        assert facts.qualified
        same = facts.environment, facts.variants, facts.needs
        assert same == (first.environment, first.variants, first.needs)
        assert facts.commit
        assert "dirty" not in facts.commit
        assert find_policy(f"agent-{name}:seed={seed}").facts == facts
        assert facts.needs.observation in ("measured", "deviations")


def test_the_small_one_has_less_than_four_kilobytes_of_weights():
    assert sum(each.nbytes for each in load_file(FOLDER / "small.safetensors").values()) < 4000


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_each_steadies_the_force_at_its_mean(name):
    passive, steadied = (
        simulate(**given(name), policy=policy, record_droppers=False).worst_controlled().summary()
        for policy in ("passive", f"agent-{name}")
    )
    assert steadied.std < AGENTS[name][1] * passive.std
    assert abs(steadied.mean / passive.mean - 1) < 0.015


@pytest.mark.parametrize("seed", ["999", "-1", "0.5", "'../head'"])
def test_a_seed_that_nothing_was_trained_under_is_refused(seed):
    with pytest.raises(InputError, match=r"agent-any-line was trained under the seeds 0.*, not "):
        find_policy(f"agent-any-line:seed={seed}")


def test_agent_trailing_alone_lacks_what_the_one_in_front_measured_and_nothing_else():
    seeing, alone = (recipe(name) for name in ("trailing", "trailing-alone"))
    assert seeing["environment"].pop("front")
    assert alone == seeing


@pytest.mark.slow
def test_they_need_no_torch():
    code = (
        "import sys, panto_env, panto_agents.command\n"
        "panto_env.simulate(policy='agent-known-line', distance=120, record_droppers=False)\n"
        "assert not {'torch', 'stable_baselines3'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_line_too_slow_for_an_agent_is_refused_with_the_reason():
    """The train runs at 160 km/h: it must be said what another speed has to do with it."""
    line = load_catenary("sweden-st15")
    wire = line.contact_wire.model_copy(update={"tension": 12e3})
    line = line.model_copy(update={"contact_wire": wire})
    sentence = r"normalised by passive runs at 250 to 400 km/h; take .* below the wave speed"
    with pytest.raises(InputError, match=sentence) as caught:
        simulate(line, "dsa250", 160.0, "agent-high-speed", actuator="realistic", sensors="realistic")
    assert "or a range 'normalise' for the speeds of this line" in str(caught.value)


@pytest.mark.longer
@pytest.mark.parametrize("name", some_at_once(NAMES, ["small"]))
def test_a_card_is_of_today_and_a_hub_can_read_it(name):
    hub = pytest.importorskip("huggingface_hub")
    from ..cards import _results, card

    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert text == card(name), "run `make cards`"
    data = hub.ModelCard(text).data
    assert data.license == "mit"
    ranked = _results(f"agent-{name}")  # one that is ranked on no stored track has no results there
    assert [each.metric_value for each in data.eval_results or []] == [each.metric_value for each in ranked]
    assert all(each.metric_value < 0 for each in ranked)
    for told in ("What it is", "Where it fails", "Limits"):
        assert told in text
