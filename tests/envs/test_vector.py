import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import ClipAction, NormalizeObservation, RecordEpisodeStatistics

from panto_env import InputError
from panto_env.envs import BARE

from ..lanes import check_lanes_are_singles

LIVELY = {"sensors": "realistic", "actuator": "realistic", "line_condition": "fair", "speed_kmh": (250, 300)}


def make(name=None, lanes=3, **settings):
    """By default Pantograph-v0 in its bare form."""
    if name is None:
        name, settings = "Pantograph-v0", BARE | settings
    return gymnasium.make_vec(f"panto_env:{name}", num_envs=lanes, **settings)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("Pantograph-v0", LIVELY | {"distance": 40.0}),
        ("PantographStiffness-v0", LIVELY | {"speed_kmh": (200, 330), "distance": 15.0}),
        ("PantographStiffness-v0", LIVELY | {"pantograph_scatter": 0.1, "distance": 15.0}),
    ],
)
def test_many_lanes_are_single_environments_with_the_seeds_that_follow(name, settings):
    """Bit for bit, over the end of an episode and the autoreset, on one thread and on several."""
    ran = check_lanes_are_singles(f"panto_env:{name}", settings, steps=120, lanes=20)
    assert ran.ends >= 20


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
        ({"pantograph_scatter": 2}, "pantograph_scatter must be a number from 0 to 0.3, not 2"),
        ({"line_condition": []}, "line_condition must name at least one condition"),
        ({"line_condition": ["new", "rusty"]}, "line_condition must be 'new' or"),
    ],
)
def test_bad_arguments_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        make(**settings)


def test_bad_resets_are_refused():
    env = make(distance=10.0, autoreset_mode="Disabled")
    with pytest.raises(InputError, match="call reset before step"):
        env.step(np.zeros((3, 1)))
    env.reset(seed=0)
    ended = False
    while not ended:
        ended = env.step(np.zeros((3, 1), np.float32))[3].all()
    with pytest.raises(InputError, match="has ended; call reset"):
        env.step(np.zeros((3, 1)))


def test_lanes_draw_their_own_pantograph_line_condition_and_speed():
    scattered = {
        "pantograph_scatter": 0.1,
        "line_condition": ["new", "worn", {"broken_droppers": [(2, 4)]}],
        "speed_kmh": (200, 320),
        "distance": 200.0,
    }
    ran = check_lanes_are_singles("panto_env:Pantograph-v0", scattered, steps=60, lanes=5)
    ran.vector.reset(seed=3)
    plant = ran.vector.unwrapped.task.plant
    assert len({own.tobytes() for own in plant.pantographs.table[0]}) == 5
    amplitudes = plant.run.waves[:, ::3]
    assert set(np.count_nonzero(amplitudes, axis=1)) == {0, 4}
