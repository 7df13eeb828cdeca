import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import ClipAction, NormalizeObservation, RecordEpisodeStatistics

from panto_env import InputError
from panto_env.envs import BARE, IDS
from panto_env.plant.state import Row

LIVELY = {"sensors": "realistic", "actuator": "realistic", "line_condition": "fair", "speed_kmh": (250, 300)}


def make(name=None, lanes=3, **settings):
    """By default Pantograph-v0 in its bare form."""
    if name is None:
        name, settings = "Pantograph-v0", BARE | settings
    return gymnasium.make_vec(f"panto_env:{name}", num_envs=lanes, **settings)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("lanes", [3, 20])
def test_lane_i_is_the_single_environment_seeded_seed_plus_i(name, lanes):
    """Bit for bit, over the end of an episode and the autoreset, on one thread and on several."""
    settings = LIVELY | {"distance": 40.0}
    vector = make(name, lanes, **settings)
    singles = [gymnasium.make(name, **settings) for _ in range(lanes)]
    observations, _ = vector.reset(seed=5)
    alone = [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)]
    np.testing.assert_array_equal(observations, alone)
    random, ended = np.random.default_rng(0), [False] * lanes
    for _ in range(120):
        actions = random.uniform(-1, 1, vector.action_space.shape).astype(np.float32)
        observations, rewards, terminated, truncated, infos = vector.step(actions)
        for i, env in enumerate(singles):
            if ended[i]:
                observation, reward, ends = env.reset()[0], 0.0, (False, False)
            else:
                observation, reward, *ends, info = env.step(actions[i])
            np.testing.assert_array_equal(observations[i], observation)
            assert rewards[i] == reward
            assert (terminated[i], truncated[i]) == tuple(ends)
            ended[i] = any(ends)
            if ended[i]:
                all_of_them = infos["figures"]
                names = [name for name in all_of_them if name[0] != "_" and all_of_them[f"_{name}"][i]]
                figures = {name: all_of_them[name][i] for name in names}
                assert figures == pytest.approx(info["figures"], rel=1e-9, abs=1e-9, nan_ok=True)


def test_lanes_of_a_massless_line_are_single_environments():
    """Speed, pantograph and noise each of its own; over the ends of episodes."""
    settings = LIVELY | {"speed_kmh": (200, 330), "pantograph_scatter": 0.1, "distance": 15.0}
    vector, plain = (
        make("PantographStiffness-v0", **settings | more) for more in ({}, {"pantograph_scatter": 0})
    )
    singles = [gymnasium.make("panto_env:PantographStiffness-v0", **settings) for _ in range(3)]
    observations, info = vector.reset(seed=5)
    for i, env in enumerate(singles):
        np.testing.assert_array_equal(observations[i], env.reset(seed=5 + i)[0])
    assert np.ptp(info["speed_kmh"]) > 10
    assert not np.array_equal(plain.reset(seed=5)[0][:, 0], observations[:, 0])
    ended, ends = [False] * 3, 0
    for actions in np.random.default_rng(0).uniform(-1, 1, (70, 3, 1)):
        observations, rewards, *_, infos = vector.step(actions)
        for i, env in enumerate(singles):
            if ended[i]:
                (observation, _), reward, ended[i], position = env.reset(), 0.0, False, 0.0
            else:
                observation, reward, *ending, single = env.step(actions[i])
                ended[i], position = any(ending), single["position"]
                ends += ended[i]
            np.testing.assert_array_equal(observations[i], observation)
            assert (rewards[i], infos["position"][i]) == (reward, position)
    assert ends >= 6


def test_lanes_of_a_group_run_in_each_as_far_as_it_draws():
    """Those beside a lane that runs in stay as they are, also where more than a group of them are."""
    settings = LIVELY | {"speed_kmh": (200, 330), "distance": 25.0, "run_in": 2.0}
    vector = make("PantographStiffness-v0", 19, **settings)
    singles = [gymnasium.make("panto_env:PantographStiffness-v0", **settings) for _ in range(19)]
    observations, infos = vector.reset(seed=5)
    seen = [env.reset(seed=5 + i) for i, env in enumerate(singles)]
    assert len(set(infos["position"])) > 10
    mask = np.arange(19) % 5 == 2
    for actions in np.random.default_rng(0).uniform(-1, 1, (8, 19, 1)):
        for i, (observation, info) in enumerate(seen):
            np.testing.assert_array_equal(observations[i], observation)
            assert infos["position"][i] == info["position"] or not infos["_position"][i]
        observations, *_ = vector.step(actions)
        for env, action in zip(singles, actions, strict=True):
            env.step(action)
        observations, infos = vector.reset(options={"reset_mask": mask})
        seen = [
            env.reset() if mask[i] else (observations[i], {"position": None}) for i, env in enumerate(singles)
        ]
        mask = np.roll(mask, 1)
    observations, *_ = vector.step(actions)
    for i, env in enumerate(singles):
        np.testing.assert_array_equal(observations[i], env.step(actions[i])[0])


def test_figures_are_those_of_the_lanes_that_end_whatever_task_each_runs():
    """The middle lane runs an episode of its own speed; the others end later."""
    settings = LIVELY | {"speed_kmh": 200, "distance": 20.0}
    vector = make("PantographStiffness-v0", 3, **settings)
    vector.reset(seed=5)
    faster = {"reset_mask": np.array([False, True, False]), "speed_kmh": 300}
    vector.reset(options=faster)
    singles = [gymnasium.make("panto_env:PantographStiffness-v0", **settings) for _ in range(3)]
    for i, env in enumerate(singles):
        env.reset(seed=5 + i)
    singles[1].reset(options={"speed_kmh": 300})
    over, still = [], np.zeros((3, 1), np.float32)
    while len(over) < 3:
        *_, infos = vector.step(still)
        alone = {i: env.step(still[i]) for i, env in enumerate(singles) if i not in over}
        ended = {i: info["figures"] for i, (*_, truncated, info) in alone.items() if truncated}
        assert ("figures" in infos) == bool(ended)
        for i in range(3 if ended else 0):
            assert infos["_figures"][i] == (i in ended)
            figures = {key: values[i] for key, values in infos["figures"].items() if key[0] != "_"}
            expected = ended.get(i, dict.fromkeys(figures, 0.0))
            assert figures == pytest.approx(expected, rel=1e-9, nan_ok=True)
        over += list(ended)
    assert over == [1, 0, 2]


def test_autoreset_modes_are_declared_and_kept():
    same = make(distance=10.0, autoreset_mode="SameStep")
    assert same.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    first, _ = same.reset(seed=0)
    for _ in range(13):
        observation, _, _, truncated, infos = same.step(np.zeros((3, 1), np.float32))
        if truncated.all():
            break
    assert truncated.all()
    np.testing.assert_array_equal(observation, first)
    assert infos["final_obs"][1].shape == (9,)
    assert not np.array_equal(infos["final_obs"][1], first[1])
    assert infos["final_info"]["figures"]["std"].shape == (3,)
    assert make().metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP


def test_disabled_autoreset_waits_for_a_masked_reset():
    env = make(speed_kmh=(200, 300), distance=15.0, autoreset_mode="Disabled")
    env.reset(seed=3)
    ended = np.zeros(3, bool)
    while not ended.any():
        _, _, terminated, truncated, _ = env.step(np.zeros((3, 1), np.float32))
        ended = terminated | truncated
    with pytest.raises(InputError, match="has ended; call reset"):
        env.step(np.zeros((3, 1), np.float32))
    before = env.unwrapped.task.plant.row(Row.STEP)
    env.reset(options={"reset_mask": ended})
    after = env.unwrapped.task.plant.row(Row.STEP)
    assert (after[ended] == 0).all()
    assert (after[~ended] == before[~ended]).all()
    env.step(np.zeros((3, 1), np.float32))


def test_gymnasium_s_vector_wrappers_work():
    env = ClipAction(NormalizeObservation(RecordEpisodeStatistics(make(distance=20.0, lanes=4))))
    env.reset(seed=0)
    lengths = []
    for _ in range(60):
        observation, _, _, _, infos = env.step(np.full((4, 1), 3.0, np.float32))
        if "episode" in infos:
            lengths += infos["episode"]["l"][infos["_episode"]].tolist()
    assert observation.shape == (4, 9)
    assert set(lengths) == {24}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"autoreset_mode": "Never"}, "autoreset_mode must be one of NextStep, SameStep, Disabled"),
        ({"lanes": 0}, "num_envs must be a whole number from 1"),
        ({"render_mode": "human"}, "must be None or 'rgb_array'"),
    ],
)
def test_bad_arguments_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        make(**settings)


def test_bad_resets_are_refused():
    env = make()
    with pytest.raises(InputError, match="call reset before step"):
        env.step(np.zeros((3, 1)))
    with pytest.raises(InputError, match="seed must be a number or one per lane"):
        env.reset(seed=[1, 2])
    with pytest.raises(InputError, match="Unknown option 'speed'"):
        env.reset(options={"speed": 1})
    env.reset(seed=0)
    with pytest.raises(InputError, match="reset_mask must be 3 booleans"):
        env.reset(options={"reset_mask": np.ones(2, bool)})


def test_lanes_draw_their_own_pantograph_line_condition_and_speed():
    scattered = {
        "pantograph_scatter": 0.1,
        "line_condition": ["new", "worn", {"broken_droppers": [(2, 4)]}],
        "speed_kmh": (200, 320),
    }
    env = gymnasium.make_vec(
        "Pantograph-v0", num_envs=5, vectorization_mode="vector_entry_point", distance=200.0, **scattered
    )
    observations, _ = env.reset(seed=3)
    singles = [gymnasium.make("Pantograph-v0", distance=200.0, **scattered) for _ in range(5)]
    for lane, single in enumerate(singles):
        np.testing.assert_array_equal(observations[lane], single.reset(seed=3 + lane)[0])
    actions = np.random.default_rng(0).uniform(-1, 1, (5, 1)).astype(np.float32)
    for _ in range(150):
        observations, rewards, *_ = env.step(actions)
        for lane, single in enumerate(singles):
            seen, reward, *_ = single.step(actions[lane])
            np.testing.assert_array_equal(observations[lane], seen)
            assert rewards[lane] == reward
    plant = env.unwrapped.task.plant
    assert len({own.tobytes() for own in plant.pantographs.table[0]}) == 5
    amplitudes = plant.run.waves[:, ::3]
    assert set(np.count_nonzero(amplitudes, axis=1)) == {0, 4}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"pantograph_scatter": 2}, "pantograph_scatter must be a number from 0 to 0.3, not 2"),
        ({"line_condition": []}, "line_condition must name at least one condition"),
        ({"line_condition": ["new", "rusty"]}, "line_condition must be 'new' or"),
    ],
)
def test_scatter_that_is_not_valid(settings, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make("Pantograph-v0", **settings)
