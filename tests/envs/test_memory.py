"""The observation's memory of earlier spans."""

import gymnasium
import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.control.state import Now

from ..lanes import check_lanes_are_singles

AHEAD = (0.0, 0.05, 0.2)
RUN = {
    "speed_kmh": 275,
    "memory": AHEAD,
    "memory_spans": 2,
    "distance": 300,
    "settle": 0,
    "observation": "measured",
    "washout": 0,
}


def run(env, seed=3, gain=0.3):
    """Observations, actions and places as read of an episode under random actions."""
    random = np.random.default_rng(seed)
    observation, _ = env.reset(seed=seed)
    task, rows, ended = env.unwrapped.task, [], False
    now = task.episode.now[0]
    rows.append((observation, 0.0, now[Now.SPANS], now[Now.SPEED]))
    while not ended:
        action = gain * random.uniform(-1, 1, 1).astype(np.float32)
        observation, _, terminated, truncated, _ = env.step(action)
        now = task.episode.now[0]
        rows.append((observation, float(action[0]), now[Now.SPANS], now[Now.SPEED]))
        ended = terminated or truncated
    return task, *(np.array(each) for each in zip(*rows, strict=True))


@pytest.mark.parametrize(
    ("catenary", "sensors"), [("en50318-2002", "realistic"), ("section:fast-line", "ideal")]
)
def test_memory_is_what_was_read_and_done_at_the_same_share_of_earlier_spans(catenary, sensors):
    """Beside linear interpolation of the whole episode by place, on equal and on unequal spans."""
    env = gymnasium.make("Pantograph-v0", catenary=catenary, sensors=sensors, **RUN)
    task, seen, actions, places, speeds = run(env)
    layout = task.layout
    force = seen[:, layout.index("contact force")]
    per_step = speeds * 0.01 / task.plant.alignment.mean_length
    for span, words in ((1, "1 span ago"), (2, "2 spans ago")):
        for time in AHEAD:
            sought = places + per_step * time / 0.01 - span
            known = sought > places[0]
            assert known.sum() > 100
            for name, values, first in (("force", force, force[0]), ("frame action", actions, 0.0)):
                told = seen[:, layout.index(f"remembered {name}, {words}, {time:g} s ahead")]
                # Where a mast corrects the odometer, places as read may go back: left out.
                steady = known & np.isin(np.searchsorted(places, sought), _rising(places))
                np.testing.assert_allclose(told[steady], np.interp(sought[steady], places, values), atol=2e-5)
                np.testing.assert_allclose(told[sought < places[0]], first, atol=1e-6)


def _rising(places):
    """Indices of the steps beside which places rise."""
    rises = np.diff(places, prepend=-1.0) > 0
    low, high = np.maximum.accumulate(places), np.minimum.accumulate(places[::-1])[::-1]
    return np.flatnonzero(rises & (low == places) & (high == places))


def test_deviations_are_those_of_readings_from_their_slow_averages():
    """Beside the readings of "measured" and a recursion in numpy; remembered forces likewise."""
    given = RUN | {"catenary": "en50318-2002", "sensors": "ideal", "run_in": 0}
    measured, seen = (
        run(gymnasium.make("Pantograph-v0", **given | {"observation": kind}))
        for kind in ("measured", "deviations")
    )
    share = 1 - np.exp(-0.01 / 1.0)
    for name, scale, spread in (("contact force", 100, 30), ("head displacement", 0.1, 0.012)):
        readings = scale * measured[1][:, measured[0].layout.index(name)].astype(float)
        average, expected = readings[0], []
        for reading in readings:
            average += share * (reading - average)
            expected.append(reading - average)
        told = spread * seen[1][:, seen[0].layout.index(f"{name} deviation")]
        assert np.std(expected) > 0.3 * spread
        np.testing.assert_allclose(told, expected, atol=1e-4 * spread)
    force = seen[1][:, seen[0].layout.index("contact force deviation")]
    told = seen[1][:, seen[0].layout.index("remembered force deviation, 1 span ago, 0 s ahead")]
    sought = seen[3] - 1
    known = sought > seen[3][0]
    np.testing.assert_allclose(told[known], np.interp(sought[known], seen[3], force), atol=1e-5)
    np.testing.assert_allclose(told[~known], 0.0, atol=1e-6)


def test_lanes_remember_as_single_environments_do():
    settings = {"memory": AHEAD, "distance": 60.0}
    assert check_lanes_are_singles("panto_env:PantographStiffness-v0", settings, steps=100).ends >= 3


def test_a_second_episode_remembers_nothing_of_the_first():
    env = gymnasium.make("PantographStiffness-v0", **RUN | {"distance": 120})
    first = [run(env, seed)[1] for seed in (3, 4, 3)]
    np.testing.assert_array_equal(first[0], first[2])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"memory": (0.2, 0.1)}, "memory must be increasing times from 0 to 1 s"),
        ({"memory": (0.0, 1.5)}, "memory must be increasing times from 0 to 1 s"),
        ({"memory": (0.8,), "speed_kmh": 300}, "memory must be at most 0.72 s.*shortest span, 60 m"),
        ({"memory": AHEAD, "sensors": "blind"}, "which these sensors do not measure"),
        ({"memory": AHEAD, "memory_spans": 0}, "memory_spans"),
        ({"observation": "deviations", "normalise": 270}, "'deviations' has scales of its own"),
    ],
)
def test_a_memory_that_cannot_be_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make("Pantograph-v0", catenary="en50318-2002", **given)
