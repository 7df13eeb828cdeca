"""Figures kept as an episode runs are those of its whole trajectory."""

import math

import gymnasium
import numpy as np
import pytest

from panto_env.catalog import load_catenary
from panto_env.envs import BARE

SPAN = load_catenary("ohl-three-span").span_length
WITH_SUPPORTS = {"catenary": "ohl-three-span", "pantograph": "own-two-mass", "distance": 2 * SPAN - 1.0}


def make(settings):
    actuator = {"place": "both", "force_limit": 300.0}
    return gymnasium.make("panto_env:Pantograph-v0", **BARE | {"actuator": actuator} | settings).unwrapped


def play(env, act):
    """Figures at the end of an episode, under actions by position (m)."""
    env.reset(seed=0)
    ended, position = (False, False), 0.0
    while not any(ended):
        _, _, *ended, info = env.step(act(position))
        position = info["position"]
    return info["figures"]


def same(figures, run):
    expected = {k: v for k, v in run.summary("all").as_dict().items() if not math.isnan(v)}
    return figures == pytest.approx(expected, rel=1e-9)


def test_uplift_of_an_episode_is_that_of_its_trajectory():
    """A push lifts the support ahead, which the train has not come to when the episode ends."""
    env = make(WITH_SUPPORTS)
    for push, before in ((0.25, 0.03), (0.05, -0.05)):  # the second episode lifts both supports less

        def act(position, p=push, b=before):
            return np.full(2, p if position > 1.4 * SPAN else b)

        figures = play(env, act)
        run = env.trajectory
        assert same(figures, run)
        same_push = make(WITH_SUPPORTS)  # in an environment without a past
        play(same_push, act)
        np.testing.assert_array_equal(run.uplift, same_push.trajectory.uplift)
        np.testing.assert_array_equal(run.contact_force, same_push.trajectory.contact_force)
        passed, ahead = run.uplift[:, 0], run.uplift[:, 1]
        assert passed[-1] < passed.max() == figures["max_uplift"]
        assert push < 0.2 or ahead.max() > 1.1 * passed.max()
