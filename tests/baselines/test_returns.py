"""Returns beside the benchmark: each is the sum of an episode's rewards, and the correlation is of ranks."""

import json
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from panto_baselines.benchmark.command import returns as command
from panto_baselines.benchmark.returns import INGREDIENTS, Returned, one_return, rank_correlation, returns
from panto_baselines.benchmark.run import parse_result, run
from panto_baselines.benchmark.settings import BenchmarkSettings, Line
from panto_env import InputError
from panto_env.control.settings import read_settings
from panto_env.envs import IDS
from panto_env.envs.settings import EnvironmentSettings
from panto_env.policies import find_policy

from .commands import called

LINE = "en50318-2002"
OF_RESULT = {"catenary": LINE, "pantograph": LINE, "actuator": "ideal", "sensors": "ideal"}
SHORT = {"distance": 120.0, "accuracy": "fast", "settle": 1.0, "speed_kmh": (250.0, 300.0)}


def returned(policy, mean, change, disqualified=""):
    return Returned(policy, mean, 0.0, change, disqualified)


def test_the_correlation_is_spearman_s_and_disqualified_policies_share_the_last_rank():
    found = [
        returned("best", -1.0, -40.0),
        returned("second", -2.0, -30.0),
        returned("loud", -3.0, -60.0, "moves the mean"),
        returned("passive", -4.0, 0.0),
        returned("lost", -5.0, -50.0, "ended early"),
    ]
    # Ranks by return 1 2 3 4 5, by the benchmark 1 2 4.5 3 4.5: Pearson's correlation of the ranks by hand.
    a, b = np.array([1.0, 2, 3, 4, 5]), np.array([1.0, 2, 4.5, 3, 4.5])
    assert rank_correlation(found) == pytest.approx(np.corrcoef(a, b)[0, 1])
    assert rank_correlation(found[:2]) == pytest.approx(1.0)
    assert rank_correlation([found[0], returned("second", 0.0, -30.0)]) == pytest.approx(-1.0)


@pytest.mark.parametrize("washout", [0.0, 1.0])
def test_a_return_is_the_sum_of_the_rewards_of_an_episode(washout):
    env, driver = gymnasium.make("panto_env:Pantograph-v0", **SHORT | {"washout": washout}), find_policy("pd")
    observation, _ = env.reset(seed=5)
    driver.reset(env.unwrapped.context)
    total, ended = 0.0, False
    while not ended:
        observation, reward, terminated, truncated, _ = env.step(driver.act(observation))
        total, ended = total + reward, terminated or truncated
    given = SHORT | ({"washout": washout} if washout else {})
    assert one_return("Pantograph-v0", given, "pd", 5) == pytest.approx(total)


@pytest.fixture(scope="module")
def result():
    line = Line(speeds_kmh=(250.0, 300.0), distance=310.0, spans=(3, 5))
    settings = BenchmarkSettings(policies=("pd", "p:gain=0.1"), lines=(line,), seeds=(0, 1))
    return run(settings, workers=1)


@pytest.fixture(scope="module")
def read(result):
    return parse_result(result.as_dict(), "the outcome")


@pytest.mark.slow
def test_every_policy_has_the_mean_of_its_episodes_at_the_speeds_of_the_result_in_turn(read):
    at_any = {name: value for name, value in SHORT.items() if name != "speed_kmh"}
    found = returns(read, episodes=3, arguments=at_any, workers=1)
    assert [each.policy for each in found] == ["passive", "pd", "p:gain=0.1"]
    assert [each.change for each in found] == [each.change for each in read.standings]
    for each in found[:2]:
        single = [
            one_return("Pantograph-v0", OF_RESULT | at_any | {"speed_kmh": speed}, each.policy, seed)
            for seed, speed in enumerate((250.0, 300.0, 250.0))
        ]
        assert each.mean == pytest.approx(np.mean(single))
        assert each.error == pytest.approx(np.std(single, ddof=1) / 3**0.5)


@pytest.mark.longer
def test_the_command_prints_policies_by_return_and_the_correlation(result, tmp_path):
    file = tmp_path / "result.json"
    result.save(file)
    printed = called(command, file, "--episodes", 2, "--workers", 1, "--json")
    assert printed.exit_code == 0, printed.output
    table = json.loads(printed.stdout)["all"]
    assert [each["policy"] for each in table["policies"]] == ["passive", "pd", "p:gain=0.1"]
    assert -1 <= table["rank_correlation"] <= 1


@pytest.mark.parametrize("name", INGREDIENTS)
def test_every_ingredient_is_a_valid_change_of_the_id(name):
    usual = read_settings(IDS["Pantograph-v0"], EnvironmentSettings)
    changed = read_settings(IDS["Pantograph-v0"] | INGREDIENTS[name], EnvironmentSettings)
    assert (changed == usual) == (name == "all")


def test_results_of_several_lines_and_unknown_ids_are_refused():
    line = {"catenary": "en50318-2002", "pantograph": "dsa380", "speeds_kmh": [280]}
    for other in ({"catenary": "re330"}, {"case": "another"}):
        with pytest.raises(InputError, match="one line or case is needed, not of 2"):
            returns(SimpleNamespace(settings={"lines": [line, line | other]}))
    with pytest.raises(InputError, match="Unknown id"):
        returns(SimpleNamespace(settings={"lines": [line]}), "Pantograph-v9")


def result_of_train(controlled):
    train = {"pantographs": ["dsa380", "en50318-2002"], "distances": [50.0], "controlled": controlled}
    cells = [SimpleNamespace(catenary=LINE, pantograph="dsa380", speed_kmh=300.0)]
    standings = [SimpleNamespace(policy="pd", trainings=(), change=-1.0, disqualified="")]
    settings = {"lines": [train], "actuator": "ideal", "sensors": "ideal"}
    return train, SimpleNamespace(cells=cells, standings=standings, settings=settings)


@pytest.mark.slow
def test_a_result_of_a_train_has_returns_of_its_controlled_pantograph():
    at_one = SHORT | {"speed_kmh": 300.0}
    train, result = result_of_train(2)
    (found,) = returns(result, episodes=2, arguments=at_one, workers=1)
    alike = {"actuator": "ideal", "sensors": "ideal"} | at_one
    single = [one_return("Pantograph-v0", train | alike, "pd", seed) for seed in (0, 1)]
    assert found.mean == pytest.approx(np.mean(single))
    lone = [one_return("Pantograph-v0", {"pantograph": "dsa380"} | alike, "pd", seed) for seed in (0, 1)]
    assert np.mean(lone) != pytest.approx(np.mean(single), rel=0.05)
    with pytest.raises(InputError, match="one controlled pantograph is needed, not of 1 and 2"):
        returns(result_of_train([1, 2])[1], episodes=2)
