"""What Gymnasium asks of vector environments, and what its own answer, on all our ids."""

import warnings
from itertools import combinations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import ClipAction, DictInfoToList, NormalizeReward, RecordEpisodeStatistics

from panto_env import InputError
from panto_env.plant.state import Row

LIVELY = {"sensors": "realistic", "line_condition": "fair", "speed_kmh": (200, 300)}
LIVELY |= {"distance": 20.0, "settle": 0.0}
MODES = list(AutoresetMode)


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def native(name, lanes=3, **settings):
    return gymnasium.make_vec(name, lanes, **LIVELY | settings)


def of_singles(name, lanes=3, mode=AutoresetMode.NEXT_STEP, kind="sync", **settings):
    vector = {"autoreset_mode": mode}
    return gymnasium.make_vec(name, lanes, vectorization_mode=kind, vector_kwargs=vector, **LIVELY | settings)


def actions_of(envs, count):
    shape = envs.action_space.shape
    return np.random.default_rng(0).uniform(-1, 1, (count, *shape)).astype(np.float32)


def assert_same(ours, theirs, where="infos"):
    """The same keys and values; of figures, those of the lanes that ours says have some."""
    assert set(ours) <= set(theirs), where
    assert {key.removeprefix("_") for key in set(theirs) - set(ours)} <= {"figures"}, where
    for key, value in ours.items():
        if isinstance(value, dict):
            assert_same(value, theirs[key], f"{where}[{key}]")
        elif "figures" in where or "figures" in key:
            # Each of the single environments has the figures of its own episodes that have ended.
            mask = ours[key if key[0] == "_" else f"_{key}"]
            np.testing.assert_allclose(value[mask], theirs[key][mask], rtol=1e-9, atol=1e-9)
        elif key == "final_obs":
            for mine, other in zip(value, theirs[key], strict=True):
                np.testing.assert_array_equal(mine, other)
        else:
            assert value.dtype == theirs[key].dtype, f"{where}[{key}]"
            np.testing.assert_array_equal(value, theirs[key], f"{where}[{key}]")


def check_alike(ours, theirs, steps, mode=AutoresetMode.NEXT_STEP, changes=None):
    """Both answer alike over the ends of episodes, of which the number is returned, and lengths.

    changes: options of resets, by the step before which they come.
    """

    def check_resets(**arguments):
        mine, other = (each.reset(**arguments) for each in (ours, theirs))
        np.testing.assert_array_equal(mine[0], other[0])
        assert_same(mine[1], other[1])

    check_resets(seed=5)
    ends, lengths, length = 0, set(), np.zeros(ours.num_envs, int)
    for k, action in enumerate(actions_of(ours, steps)):
        if changes and k in changes:
            check_resets(options=dict(changes[k]))
        mine, other = ours.step(action), theirs.step(action)
        for part in range(4):
            np.testing.assert_array_equal(mine[part], other[part])
            assert mine[part].dtype == other[part].dtype
        assert_same(mine[4], other[4])
        ended = mine[2] | mine[3]
        ends, length = ends + ended.sum(), length + 1
        lengths |= set(length[ended].tolist())
        length[ended] = -1 if mode == AutoresetMode.NEXT_STEP else 0
        if mode == AutoresetMode.DISABLED and ended.any():
            check_resets(options={"reset_mask": ended})
    return ends, lengths


@pytest.mark.parametrize(
    ("name", "mode"),
    [*(("PantographStiffness-v0", mode) for mode in MODES), ("Pantograph-v0", AutoresetMode.NEXT_STEP)],
)
def test_native_vector_environment_answers_as_gymnasium_s_does(name, mode):
    """Observations, rewards, ends, and infos with their masks, over the ends of episodes."""
    ours, theirs = native(name, autoreset_mode=mode), of_singles(name, mode=mode)
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"] == mode
    for space in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(ours, space) == getattr(theirs, space)
    ends, _ = check_alike(ours, theirs, 90, mode)
    assert ends > 6


def test_asynchronous_environments_answer_the_same():
    theirs = of_singles("PantographStiffness-v0", kind="async")
    assert isinstance(theirs, AsyncVectorEnv)
    try:
        check_alike(native("PantographStiffness-v0"), theirs, 40)
    finally:
        theirs.close()


@pytest.mark.parametrize("kind", [SyncVectorEnv, None])
def test_lanes_are_seeded_as_gymnasium_seeds_them(kind):
    name = "PantographStiffness-v0"
    envs = native(name) if kind is None else of_singles(name)
    unseeded = envs.np_random_seed
    assert len(set(unseeded)) == 3
    envs.reset()
    assert envs.np_random_seed == unseeded
    envs.reset(seed=42)
    assert envs.np_random_seed == (42, 43, 44)
    state = [random.bit_generator.state for random in envs.np_random]
    envs.reset()
    assert envs.np_random_seed == (42, 43, 44)
    envs.reset(seed=[7, None, 9])
    assert envs.np_random_seed == (7, 43, 9)
    envs.reset(seed=42)
    assert [random.bit_generator.state for random in envs.np_random] == state
    if kind is None:
        with pytest.raises(InputError, match="seed must be a whole number from 0 up, or a list of 3 such"):
            envs.reset(seed=[4, -1, 4])
        assert envs.np_random_seed == (42, 43, 44)


def test_reset_mask_is_an_array_of_booleans_with_one_true():
    envs = native("PantographStiffness-v0")
    with pytest.raises(InputError, match="first reset must begin episodes in all lanes"):
        envs.reset(options={"reset_mask": np.array([True, True, False])})
    envs.reset(seed=0, options={"reset_mask": np.ones(3, bool)})
    odd = [True], [[True, True, True]], [1, 1, 0], [False, False, False]
    for mask in (*map(np.array, odd), [True, False, True], "all"):
        with pytest.raises(InputError, match="reset_mask must be 3 booleans, an array with one true or more"):
            envs.reset(options={"reset_mask": mask})


def test_masked_reset_leaves_the_other_lanes_and_the_user_s_options_alone():
    envs = native("PantographStiffness-v0", autoreset_mode="Disabled")
    start, _ = envs.reset(seed=[0, 1, 2])
    for action in actions_of(envs, 3):
        before, *_ = envs.step(action)
    mask = np.array([True, True, False])
    options = {"reset_mask": mask}
    observations, infos = envs.reset(seed=[0, 1, 0], options=options)
    assert options["reset_mask"] is mask
    np.testing.assert_array_equal(observations[:2], start[:2])
    np.testing.assert_array_equal(observations[2], before[2])
    assert envs.np_random_seed == (0, 1, 2)
    np.testing.assert_array_equal(infos["_head"], mask)
    np.testing.assert_array_equal(infos["reward_terms"]["_effort"], mask)
    assert infos["contact_force"][2] == 0


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_what_is_returned_is_the_user_s(mode):
    """No answer shares memory with a later one, which would change it."""

    def arrays(data):
        if isinstance(data, np.ndarray) and data.dtype != object:
            return [data]
        several = data.values() if isinstance(data, dict) else data
        return [each for item in several if item is not None for each in arrays(item)]

    envs = native("PantographStiffness-v0", autoreset_mode=mode)
    answers = [envs.reset(seed=1)]
    for k, action in enumerate(actions_of(envs, 40)):
        answer = envs.step(action)
        if k < 2 or (answer[2] | answer[3]).any():
            answers.append(answer)
        if k == 1:
            answers.append(envs.reset(options={"reset_mask": np.array([True, False, False])}))
    assert len(answers) > 5
    for one, other in combinations(answers, 2):
        assert not any(np.shares_memory(a, b) for a in arrays(one) for b in arrays(other))


def test_wrappers_that_read_infos_work():
    envs = DictInfoToList(NormalizeReward(native("PantographStiffness-v0")))
    _, infos = envs.reset(seed=0)
    assert infos[1]["speed_kmh"] != infos[2]["speed_kmh"]
    ends, figures = 0, []
    for action in actions_of(envs, 90):
        _, _, terminated, truncated, infos = envs.step(action)
        ends += (terminated | truncated).sum()
        figures += [info["figures"]["mean"] for info in infos if "figures" in info]
    assert len(figures) == ends > 3
    assert np.all(np.array(figures) > 50)
    envs = ClipAction(RecordEpisodeStatistics(native("PantographStiffness-v0")))
    envs.reset(seed=0)
    for action in 3 * actions_of(envs, 90):
        infos = envs.step(action)[4]
        if "episode" in infos:
            np.testing.assert_array_equal(infos["_episode"], infos["_figures"])
            ends -= infos["_episode"].sum()
    assert ends == 0


@pytest.mark.parametrize("mode", MODES)
def test_time_limit_of_the_vector_environment_is_gymnasium_s(mode):
    limit = {"max_episode_steps": 30}  # within some of the episodes, beyond others
    ours = native("PantographStiffness-v0", autoreset_mode=mode, **limit)
    ours.unwrapped._figures = dict  # a time limit ends Gymnasium's without figures
    theirs = of_singles("PantographStiffness-v0", mode=mode, **limit)
    _, lengths = check_alike(ours, theirs, 90, mode)
    assert 30 in lengths
    assert min(lengths) < 30
    with pytest.raises(InputError, match="max_episode_steps must be a whole number from 1 to"):
        native("PantographStiffness-v0", max_episode_steps=0)


def test_options_are_of_one_episode_in_the_lanes_begun():
    """What the single environment takes, another line or control interval even; autoreset forgets them."""
    name = "PantographStiffness-v0"
    ours = native(name)
    changes = {
        4: {"speed_kmh": 250, "sensors": "ideal", "reset_mask": np.array([True, False, True])},
        9: {"control_interval": 0.02, "line_condition": "worn", "reset_mask": np.array([False, True, False])},
        40: {"distance": np.float32(7.0)},
    }
    ends, _ = check_alike(ours, of_singles(name), 90, changes=changes)
    assert ends > 6
    _, infos = ours.reset(options={"speed_kmh": 250})
    assert infos["speed_kmh"] == pytest.approx(250)


def test_options_that_are_not_valid_change_nothing():
    envs = native("PantographStiffness-v0")
    before, _ = envs.reset(seed=1)
    for options, message in (
        ({"sped_kmh": 200}, "Unknown option 'sped_kmh': did you mean 'speed_kmh'"),
        ({"speed_kmh": -5}, "speed must lie above 0"),
        ({"observation": "full"}, "would change the observation or action space"),
    ):
        with pytest.raises(InputError, match=message):
            envs.reset(seed=8, options=options)
    assert envs.np_random_seed == (1, 2, 3)
    assert (envs.unwrapped.task.plant.row(Row.STEP) == 0).all()
    np.testing.assert_array_equal(envs.reset(seed=1)[0], before)
