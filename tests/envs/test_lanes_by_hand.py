"""Lanes in groups, and what is drawn of them: at the edges."""

import itertools
import pickle
import warnings
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from panto_env import InputError
from panto_env.base.errors import AccuracyWarning
from panto_env.base.machine import cores
from panto_env.envs.lanes import ended_figures

from .test_lines import FAMILY, make_vec, values_of

QUICK = FAMILY | {"distance": 12.0}


def test_groups_are_copied_without_the_threads_that_step_them(monkeypatch):
    monkeypatch.setattr("panto_env.backend.threads.WORTH", 0.0)  # on threads, however short a step is
    envs = make_vec(4, lines=2, **QUICK)
    envs.reset(seed=0)
    still = np.zeros((4, 1), np.float32)
    for _ in range(6):
        envs.step(still)
    assert cores() == 1 or envs.unwrapped._lanes._threads._pool
    twin = pickle.loads(pickle.dumps(envs))
    assert twin.unwrapped._lanes._threads._pool is None
    np.testing.assert_array_equal(twin.step(still)[0], envs.step(still)[0])


@pytest.mark.longer
def test_a_line_that_has_had_more_than_enough_episodes_is_drawn_anew():
    """Two of three lanes begin at a time, so that the count of three is passed and not met."""
    envs = make_vec(3, lines=1, **QUICK)
    envs.reset(seed=0)
    lines = []
    for _ in range(6):
        envs.reset(options={"reset_mask": np.array([True, True, False])})
        lines.append(values_of(envs.unwrapped.context(0)))
    assert [one == other for one, other in itertools.pairwise(lines)] == [True, False] * 2 + [True]


def test_a_run_that_diverged_has_no_figures_and_the_warning_is_the_caller_s():
    without = np.array([False, True])
    task = SimpleNamespace(
        figures_of=lambda lanes: ({"mean": np.array([1.0, 2.0])}, without),
        divergence=lambda lane: f"Lane {lane} diverged.",
        agents=1,
    )
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        figures = ended_figures(task, np.array([4, 7]))
    np.testing.assert_array_equal(figures["mean"], [1.0, np.nan])
    (warning,) = said
    assert (str(warning.message), warning.category) == ("Lane 7 diverged.", AccuracyWarning)
    assert warning.filename == __file__


@pytest.mark.parametrize("lines", [{}, {"catenary": "family:high-speed", "lines": 2}], ids=["one", "groups"])
def test_the_action_of_a_lane_that_is_reset_does_not_count(lines):
    """Not even where it is no number, in lanes of one line or of several."""
    settings = {"distance": 12.0, "settle": 0.0, "speed_kmh": (200, 320), "accuracy": "fast"} | lines
    observed = []
    for of_waiting in (0.0, np.nan):
        envs = gymnasium.make_vec("panto_env:Pantograph-v0", 4, **settings)
        envs.reset(seed=0)
        ended = np.zeros(4, dtype=bool)
        while not ended.any():
            *_, terminated, truncated, _ = envs.step(np.zeros((4, 1), np.float32))
            ended = terminated | truncated
        assert not ended.all()
        wrong = np.where(ended, 0.0, np.nan)[:, None]
        lane = np.flatnonzero(~ended)[0]
        with pytest.raises(InputError, match=f"The action of lane {lane} must be finite"):
            envs.step(wrong)  # which moves no lane
        observed.append(envs.step(np.where(ended, of_waiting, 0.0)[:, None].astype(np.float32))[0])
    np.testing.assert_array_equal(*observed)
