"""Harmonics of the span, a history, and readings counted from the passive run, beside what they should be."""

import json

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import load_catenary
from panto_env.control.task import Task
from panto_env.envs import BARE

LIGHT = "panto_env:PantographStiffness-v0"
NAME = "panto_env:Pantograph-v0"


def play(env, steps, seed=0):
    """Observations under random actions, the first one included, and the actions."""
    random = np.random.default_rng(0)
    seen = [env.reset(seed=seed)[0]]
    actions = random.uniform(-1, 1, (steps, *env.action_space.shape))
    seen += [env.step(action)[0] for action in actions]
    return np.array(seen), actions


def test_harmonics_are_sines_and_cosines_of_the_place_in_the_span():
    env = gymnasium.make(LIGHT, harmonics=14, speed_kmh=287.0).unwrapped
    seen, _ = play(env, 40)
    layout, turns = env.context.layout, np.arange(41) * 0.01 * 287 / 3.6 / env.context.alignment.mean_length
    for k in range(1, 15):
        for wave, function in (("sine", np.sin), ("cosine", np.cos)):
            entry = f"{wave} of span position" + (f", harmonic {k}" if k > 1 else "")
            assert seen[:, layout.index(entry)] == pytest.approx(function(2 * np.pi * k * turns), abs=1e-6)


def test_blind_sensors_tell_no_harmonic_of_the_place():
    env = gymnasium.make(LIGHT, harmonics=14, sensors="blind").unwrapped
    seen, _ = play(env, 20)
    entries = [k for k, entry in enumerate(env.context.layout.entries) if "of span position" in entry.name]
    assert len(entries) == 28
    assert not seen[:, entries].any()


@pytest.mark.parametrize("kind", ["full", "centred"])
def test_history_is_what_was_seen_before(kind):
    env = gymnasium.make(LIGHT, history=3, observation=kind, actuator={"place": "both"}).unwrapped
    seen, _ = play(env, 30)
    layout = env.context.layout
    names = [entry.name for entry in layout.entries]
    assert sum("ago" in each for each in names) == 3 * 7
    for place, entry in enumerate(names):
        now, comma, ago = entry.partition(", ")
        if comma:
            steps = int(ago.split()[0])
            expected = np.concatenate([np.repeat(seen[:1], steps, axis=0), seen])[: len(seen)]
            np.testing.assert_array_equal(seen[:, place], expected[:, names.index(now)], err_msg=entry)


def test_no_history_begins_before_its_episode():
    """What a lane saw in its last episode, or while it ran in, is not part of it."""
    env = gymnasium.make_vec(LIGHT, num_envs=3, history=2, run_in=1.0, distance=15.0, speed_kmh=(200, 300))
    observations, _ = env.reset(seed=0)
    past, now = env.task.layout.earlier
    random, begun = np.random.default_rng(0), np.ones(3, dtype=bool)
    begins = 0
    for _ in range(80):
        np.testing.assert_array_equal(observations[begun][:, past], observations[begun][:, now])
        begins += begun.sum()
        observations, _, terminated, truncated, infos = env.step(random.uniform(-1, 1, (3, 1)))
        ended = terminated | truncated
        begun = (infos["reward_terms"]["effort"] == 0) & ~ended
    assert begins >= 9


def test_normalised_readings_have_a_mean_near_0_and_a_spread_near_1():
    speed = 350.0
    bare = BARE | {"speed_kmh": speed, "normalise": (200, 350), "history": 1, "observation": "measured"}
    env = gymnasium.make(NAME, **bare, distance=1140.0, spans=27).unwrapped
    seen = [env.reset(seed=0)[0]]
    ended = False
    while not ended:
        observation, _, *ends, _ = env.step(np.zeros(1, np.float32))
        seen.append(observation)
        ended = any(ends)
    layout = env.context.layout
    settled = np.array(seen)[round(9 * 60 / (speed / 3.6 * 0.01)) :]
    for name in ("head displacement", "frame velocity", "contact force", "contact force, 1 step ago"):
        column = settled[:, layout.index(name)]
        assert abs(column.mean()) < 0.5, name
        assert 0.5 < column.std() < 2.0, name
    assert settled[0, layout.index("speed")] == pytest.approx((speed - 275) / 75, abs=1e-6)
    run = env.trajectory
    every = round(0.01 / run.time_step)
    heads = [layout.read(each, "head displacement") for each in seen[1:]]
    assert heads == pytest.approx(run.head[every - 1 :: every], abs=1e-7)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"harmonics": 15}, "harmonics must be a whole number from 1 to 14"),
        ({"history": 9}, "history must be a whole number from 0 to 8"),
        ({"normalise": (300, 200)}, "The range normalise must not fall"),
        ({"normalise": "fast"}, "normalise must be a number or a range of two"),
        ({"normalise": 5000.0, "catenary": "en50318-2002"}, "wave speed"),
    ],
)
def test_what_is_out_of_range_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make(LIGHT, **given)


def test_a_policy_is_shown_what_it_asks_for():
    class Curious:
        observation, harmonics, history = "measured", 2, 1

        def reset(self, context):
            self.names = [entry.name for entry in context.layout.entries]

        def act(self, observation):
            return np.zeros(1)

    policy = Curious()
    simulate("periodic-stiffness", "three-mass", policy=policy, distance=20.0)
    assert {"cosine of span position, harmonic 2", "contact force, 1 step ago"} <= set(policy.names)


def test_the_passive_run_is_kept_and_made_anew_where_it_is_damaged(tmp_path, monkeypatch):
    monkeypatch.setattr("panto_env.backend.cache.cache_folder", lambda: tmp_path)
    runs, whole = [], Task.run_passively
    monkeypatch.setattr(
        Task, "run_passively", lambda self, watch=None: (runs.append(1), whole(self, watch))[1]
    )
    make = lambda **given: gymnasium.make(LIGHT, normalise=300, **given).unwrapped.context.layout  # noqa: E731
    first = make()
    assert len(runs) == 1
    assert make(sensors="realistic", actuator="realistic", reward="paper1") == first
    assert len(runs) == 1
    (file,) = (tmp_path / "passive_run").iterdir()
    table = json.loads(file.read_text())
    table["value"][0][0] += 1.0
    file.write_text(json.dumps(table))
    assert make() == first
    assert len(runs) == 2
    assert make(pantograph="own-two-mass") != first
    line = load_catenary("periodic-stiffness")
    assert make(catenary=line.model_copy(update={"mean_stiffness": 4100.0})) != first
