"""What an agent learns from and when it is told to stop: each value worked out by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from panto_agents.cloning import Demonstrations, _rms, _split, demonstrate, returns
from panto_agents.policy import _first_difference
from panto_agents.settings import arguments, speeds
from panto_agents.train import EpisodeLog, EveryNSteps
from panto_env import InputError
from panto_env.envs import IDS


def test_something_is_done_where_an_interval_is_passed_and_once_at_the_end():
    done = []
    each = EveryNSteps(100, lambda: done.append(each.num_timesteps))
    each.num_timesteps = 50
    each._on_training_start()
    for steps in (50, 99, 100, 150, 199, 250, 300, 320):
        each.num_timesteps = steps
        each._on_rollout_start()
        assert each._on_step()
    assert done == [100, 250, 300]
    each._on_training_end()
    each._on_training_end()
    assert done == [100, 250, 300, 320]


def test_figures_are_logged_of_each_episode_that_ends_where_it_has_them():
    logged, log = [], EpisodeLog(("mean", "std"))
    log.model = SimpleNamespace(logger=SimpleNamespace(record_mean=lambda *given: logged.append(given)))
    infos = [{}, {"figures": {"mean": 120.0, "max": 1.0}}, {"figures": {"mean": 121.0, "std": 20.0}}]
    log.locals = {"infos": infos}
    assert log._on_step()
    assert logged == [("episode/mean", 120.0), ("episode/mean", 121.0), ("episode/std", 20.0)]


def test_what_is_held_out_are_the_last_steps_of_all_lanes():
    steps = np.arange(20.0).reshape(10, 2, 1)
    (first,), (last,) = _split(steps)
    assert first.shape[1] == last.shape[1] == 1
    assert first.ravel().tolist() + last.ravel().tolist() == steps.ravel().tolist()
    assert len(last) == 2
    assert _rms(np.array([3.0, -4.0], np.float32)) == pytest.approx(np.sqrt(12.5))


def examples(rewards, terminated, ended):
    empty = np.zeros((len(rewards), 1, 1), np.float32)
    as_bool = [np.array(each, bool)[:, None] for each in (terminated, ended)]
    return Demonstrations(empty, empty, empty, np.array(rewards, np.float32)[:, None], *as_bool, empty)


def test_sums_of_rewards_end_with_their_episode_and_are_known_where_nothing_is_missing():
    ends = examples([1.0, 2.0, 3.0, 4.0], [0, 1, 0, 0], [0, 1, 0, 0])
    sums, known = returns(ends, 0.5)
    assert sums.ravel().tolist() == [2.0, 2.0, 5.0, 4.0]
    assert known.ravel().tolist() == [True, True, False, False]
    cut = examples([1.0, 2.0, 3.0, 4.0], [0, 0, 0, 1], [0, 1, 0, 1])
    sums, known = returns(cut, 0.5)
    assert sums.ravel().tolist() == [2.0, 2.0, 5.0, 4.0]
    assert known.ravel().tolist() == [False, False, True, True]
    sums, known = returns(examples([1.0] * 8, [0] * 8, [0] * 8), 0.5)  # 0.5^7 is below 1 %
    assert known.ravel().tolist() == [True, True, *[False] * 6]
    assert sums[0, 0] == pytest.approx(2.0 - 2.0**-7)


class Lanes:
    """Two lanes; lane 1 ends early after the second step, lane 0 after the third, at the line's end."""

    num_envs = 2

    def __init__(self):
        self.steps, self.taken = 0, []

    def reset(self, seed):
        self.seeds = seed
        return np.zeros((2, 1), np.float32), {}

    def step(self, actions):
        self.steps += 1
        self.taken.append(actions)
        terminated, truncated = np.array([False, self.steps == 2]), np.array([self.steps == 3, False])
        infos = {"final_obs": np.array([np.array([100.0 + lane]) for lane in range(2)])}
        after = np.full((2, 1), float(self.steps), np.float32)
        return after, np.full(2, -1.0 * self.steps), terminated, truncated, infos


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_a_demonstration_keeps_what_was_seen_intended_done_and_followed(noise):
    lanes, begun = Lanes(), []
    policy = SimpleNamespace(
        act=lambda seen: 0.9 + 0.0 * seen, begin=lambda which: begun.append(which.tolist())
    )
    made = demonstrate(lanes, policy, range(7, 9), 4, noise)
    assert lanes.seeds == [7, 8]
    assert begun == [[0, 1], [1], [0]]
    first, *_ = made
    assert first[..., 0].tolist() == [[0, 0], [1, 1], [2, 2], [3, 3]]
    assert made.rewards.tolist() == [[-1, -1], [-2, -2], [-3, -3], [-4, -4]]
    assert made.terminated.tolist() == [[False, False], [False, True], [False, False], [False, False]]
    assert made.ended.tolist() == [[False, False], [False, True], [True, False], [False, False]]
    assert made.following[..., 0].tolist() == [[1, 1], [2, 101], [100, 3], [4, 4]]
    assert made[1] == pytest.approx(0.9)
    np.testing.assert_array_equal(made[2], np.array(lanes.taken))
    expected = np.random.default_rng(7).standard_normal((4, 2, 1))
    np.testing.assert_allclose(made[2], np.clip(0.9 + noise * expected, -1, 1), rtol=1e-6)


NEEDS = {"channels": (0,), "force_limit": 100.0, "control_interval": 0.01, "entries": (("a", 0.0, 1.0),)}
OTHERS = {
    "channels": ((0, 1), "set actuator={'place': 'frame'}"),
    "force_limit": (
        50.0,
        "had a force_limit of 100 N, this one has 50 N; set the actuator's force_limit to 100",
    ),
    "control_interval": (
        0.02,
        "a control_interval of 0.01 s, this task has 0.02 s; set control_interval to 0.01",
    ),
    "entries": ((), "trained with other observations (1: a / 1) than this task has (0: )"),
    "washout": (2.0, "trained with washout=1.0, this task has 2.0; set it to match"),
}


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("both_ways", [False, True])
def test_a_task_that_differs_is_named_by_its_first_difference(name, both_ways):
    from panto_agents.policy import OBSERVATION_SETTINGS

    needs = NEEDS | dict.fromkeys(OBSERVATION_SETTINGS, "same") | {"washout": 1.0}
    value, words = OTHERS[name]
    needed, offered = SimpleNamespace(**needs), SimpleNamespace(**needs | {name: value})
    if both_ways:
        assert _first_difference(offered, needed) != _first_difference(needed, offered)
    else:
        assert words in _first_difference(needed, offered)


def test_an_environment_s_speeds_are_the_ends_and_the_middle_of_its_range():
    assert speeds(arguments({"id": "Pantograph-v0"})) == (200.0, 275.0, 350.0)
    assert speeds(arguments({"id": "Pantograph-v0", "speed_kmh": (201.0, 302.0)})) == (201.0, 251.5, 302.0)
    assert speeds(arguments({"id": "Pantograph-v0", "speed_kmh": 250.0})) == (250.0,)
    given = arguments({"id": "Pantograph-v0", "speed_kmh": 250.0, "accuracy": "fast"})
    assert given == IDS["Pantograph-v0"] | {"speed_kmh": 250.0, "accuracy": "fast"}
    for name in ("Pantograf-v0", None, 3, ["Pantograph-v0"]):
        with pytest.raises(InputError, match="unknown id"):
            arguments({"id": name})
