"""Environments whose line is drawn: from a list, a family or a section, in one lane or in groups of lanes."""

import gymnasium
import numpy as np
import pytest

from panto_env import InputError
from panto_env.backend import LaneThreads
from panto_env.base.machine import cores
from panto_env.catalog import load_catenary
from panto_env.control.lines import on_drawn_line
from panto_env.control.settings import run_settings

from ..lanes import check_lanes_are_singles

SHORT = {"distance": 25.0, "settle": 0.0, "reward": "agent", "accuracy": "fast"}
FAMILY = {"catenary": "family:high-speed"} | SHORT
SECTION = {"catenary": "section:main-line", "speed_kmh": (120, 160)} | SHORT | {"distance": 12.5}
LIST = {"catenary": ["re250", "beijing-tianjin", "ln2"], "speed_kmh": (200, 300)} | SHORT

drawn = pytest.mark.parametrize(
    "settings",
    [pytest.param(FAMILY, id="family"), pytest.param(SECTION, id="section", marks=pytest.mark.slow)],
)


def make(**settings):
    return gymnasium.make("panto_env:Pantograph-v0", **settings)


def make_vec(lanes, **settings):
    return gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=lanes, **settings)


def values_of(context):
    return context.catenary.model_dump_json(exclude={"sources"})


def line_of(seed, **settings):
    """The line of the first episode under a seed."""
    given = run_settings({"speed_kmh": (200, 350)} | settings)
    return on_drawn_line(given, lambda: np.random.default_rng(seed)).line


def run_to_end(env, action=0.0):
    """Observations of a whole episode that has begun."""
    seen = []
    while True:
        observation, _, terminated, truncated, _ = env.step(np.full(1, action, np.float32))
        seen.append(observation)
        if terminated or truncated:
            return np.array(seen)


@pytest.mark.longer
def test_a_list_gives_its_lines():
    names = [line_of(seed, **LIST).name for seed in range(12)]
    assert set(names) == set(LIST["catenary"])
    env = make(**LIST)
    for seed in range(3):
        env.reset(seed=seed)
        assert env.unwrapped.context.catenary.name == names[seed]


def test_an_option_chooses_the_line_of_an_episode():
    env, plain = make(**LIST), make(**LIST | {"catenary": "ln2"})
    observation, _ = env.reset(seed=3, options={"catenary": "ln2"})
    np.testing.assert_array_equal(observation, plain.reset(seed=3)[0])
    np.testing.assert_array_equal(run_to_end(env), run_to_end(plain))
    plain.reset(seed=0, options={"catenary": load_catenary("re330")})
    assert plain.unwrapped.context.catenary == load_catenary("re330")
    plain.reset(seed=3, options={"catenary": "family:high-speed"})
    assert plain.unwrapped.context.catenary == line_of(3, catenary="family:high-speed", speed_kmh=(200, 300))


def test_the_episode_on_a_drawn_line_is_that_on_the_same_line_given():
    """So what is drawn besides the line does not depend on whether the line is drawn."""
    drawn = make(**LIST)
    observation, _ = drawn.reset(seed=8)
    given = make(**LIST | {"catenary": drawn.unwrapped.context.catenary})
    np.testing.assert_array_equal(observation, given.reset(seed=8)[0])
    np.testing.assert_array_equal(run_to_end(drawn, 0.3), run_to_end(given, 0.3))


def test_every_line_of_a_list_must_be_possible():
    with pytest.raises(InputError, match=r"wave speed of the contact wire, .* on line 're250'"):
        make(**LIST | {"speed_kmh": (400, 430)})


def test_the_benchmark_s_reward_counts_from_the_drawn_line_s_own_passive_run():
    env = make(**FAMILY | {"reward": "benchmark", "speed_kmh": 300})
    targets = []
    for seed in (0, 1):
        env.reset(seed=seed)
        task = env.unwrapped.task
        target, spread = task.targets(0, task.speed, np.array([120.0]))
        targets.append((float(target[0]), float(spread[0])))
    assert targets[0] != targets[1]
    assert all(100 < target < 125 and 8 < spread < 60 for target, spread in targets)


# --- lanes -----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        FAMILY,
        SECTION,
        LIST,
        SECTION | {"catenary": "section:curved-line", "line_condition": "new:side_wind=15", "window": 0},
    ],
    ids=["family", "section", "list", "plan in wind"],
)
def test_lane_i_is_the_single_environment_seeded_seed_plus_i(settings):
    ran = check_lanes_are_singles("Pantograph-v0", settings, steps=70)
    assert ran.ends > 3


@pytest.mark.longer
@drawn
def test_lanes_of_a_group_share_the_line_of_its_first_lane(settings):
    envs = make_vec(7, lines=3, **settings)
    envs.reset(seed=10)
    lines = [values_of(envs.unwrapped.context(lane)) for lane in range(7)]
    firsts = [line_of(seed, **settings).model_dump_json(exclude={"sources"}) for seed in (10, 13, 15)]
    assert lines == [firsts[0]] * 3 + [firsts[1]] * 2 + [firsts[2]] * 2
    envs.reset(seed=10)
    assert lines == [values_of(envs.unwrapped.context(lane)) for lane in range(7)]
    envs.reset()
    assert not {values_of(envs.unwrapped.context(lane)) for lane in range(7)} & set(lines)


@pytest.mark.longer
@drawn
def test_lanes_that_share_a_line_are_single_environments_on_it(settings):
    """The first of a group in all; the others on its line and at speeds for it."""
    envs = make_vec(4, lines=2, autoreset_mode="Disabled", **settings)
    observations, infos = envs.reset(seed=20)
    singles = []
    for lane in range(4):
        single = make(**settings)
        task, _ = envs.unwrapped._lanes.task_of(lane)
        own = {"catenary": task.settings.catenary, "speed_kmh": task.settings.speed_kmh}
        observation, info = single.reset(seed=20 + lane, options=own if lane % 2 else None)
        np.testing.assert_array_equal(observations[lane], observation)
        assert infos["speed_kmh"][lane] == info["speed_kmh"]
        singles.append(single)
    for actions in np.random.default_rng(0).uniform(-1, 1, (12, 4, 1)).astype(np.float32):
        observations, rewards, *_ = envs.step(actions)
        for lane, single in enumerate(singles):
            observation, reward, *_ = single.step(actions[lane])
            np.testing.assert_array_equal(observations[lane], observation)
            assert rewards[lane] == reward


@pytest.mark.longer
@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_lines_are_drawn_anew_after_so_many_episodes(mode):
    """Episodes on a line go on to their end while others begin on the next one."""
    short = FAMILY | {"speed_kmh": (250, 350), "distance": 10.0}
    envs = make_vec(3, lines=1, episodes_per_line=2, autoreset_mode=mode, **short)
    envs.reset(seed=1)
    now = [values_of(envs.unwrapped.context(lane)) for lane in range(3)]
    begun, between = {now[0]: 3}, 0
    ended = np.zeros(3, bool)
    for actions in np.random.default_rng(0).uniform(-1, 1, (110, 3, 1)).astype(np.float32):
        waiting = ended
        _, _, terminated, truncated, _ = envs.step(actions)
        ended = terminated | truncated
        started = waiting if mode == "NextStep" else ended
        if mode == "Disabled" and ended.any():
            envs.reset(options={"reset_mask": ended})
        lines = [values_of(envs.unwrapped.context(lane)) for lane in range(3)]
        for lane in range(3):
            if started[lane]:
                begun[lines[lane]] = begun.get(lines[lane], 0) + 1
            else:
                assert lines[lane] == now[lane]
        between += len(set(lines)) > 1
        now = lines
    counts = list(begun.values())
    assert len(counts) > 3
    assert all(6 <= count <= 8 for count in counts[:-1])
    assert between > 0


@pytest.mark.longer
def test_options_go_to_each_group():
    envs = make_vec(4, lines=2, **FAMILY)
    envs.reset(seed=0)
    envs.reset(seed=5, options={"catenary": "re330", "reset_mask": np.array([True, False, False, True])})
    names = [envs.unwrapped.context(lane).catenary.name for lane in range(4)]
    assert names == ["re330", "family:high-speed", "family:high-speed", "re330"]
    observations, *_ = envs.step(np.zeros((4, 1), np.float32))
    single = make(**FAMILY)
    single.reset(seed=5, options={"catenary": "re330"})
    np.testing.assert_array_equal(observations[0], single.step(np.zeros(1, np.float32))[0])


@pytest.mark.parametrize(
    ("lanes", "settings", "message"),
    [
        (2, {"lines": 3} | FAMILY, "2 lanes are too few for 3 lines"),
        (2, {"lines": 2} | SHORT, "lines are drawn from a list, a family or a section"),
        (2, {"episodes_per_line": 0} | FAMILY, "episodes_per_line must be a whole number from 1"),
        (3, {"render_lanes": (3,)} | SHORT, "render_lanes has lane 3, but lanes are 0 to 2"),
    ],
)
def test_bad_numbers_of_lines_and_lanes_are_refused(lanes, settings, message):
    with pytest.raises(InputError, match=message):
        make_vec(lanes, **settings)


@pytest.mark.slow
@drawn
def test_groups_step_on_several_threads_as_on_one(settings, monkeypatch):
    """Over the ends of episodes, with new lines drawn within a step."""
    monkeypatch.setattr("panto_env.backend.threads.WORTH", 0.0)  # on threads, however short a step is
    many, alone = (make_vec(8, lines=4, **settings) for _ in range(2))
    groups = alone.unwrapped._lanes
    groups._threads = LaneThreads(groups._step_groups, 4, threads=1)
    many.reset(seed=0)
    alone.reset(seed=0)
    ends = 0
    for actions in np.random.default_rng(0).uniform(-1, 1, (90, 8, 1)).astype(np.float32):
        ours, theirs = many.step(actions), alone.step(actions)
        ends += int((ours[2] | ours[3]).sum())
        for k in range(4):
            np.testing.assert_array_equal(ours[k], theirs[k])
    assert ends > 8
    assert cores() == 1 or many.unwrapped._lanes._threads._pool


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "limits"),
    [
        (FAMILY, lambda wave_speed: (0.45 * wave_speed, min(350, 0.7 * wave_speed))),
        (SECTION, lambda wave_speed: (120, 160)),
    ],
    ids=["family", "section"],
)
def test_each_episode_has_a_line_of_its_own(settings, limits):
    env = make(**settings)
    lines, space = [], env.observation_space
    for seed in (4, None, None, 4):
        observation, info = env.reset(seed=seed)
        assert observation in space
        context = env.unwrapped.context
        lines.append(values_of(context))
        slowest, fastest = limits(3.6 * context.catenary.contact_wire.wave_speed)
        assert slowest <= info["speed_kmh"] <= fastest
        run_to_end(env)
    assert lines[0] == lines[3]
    assert len(set(lines)) == 3
    assert lines[0] == line_of(4, **settings).model_dump_json(exclude={"sources"})
