import gymnasium
import numpy as np
import pytest

from panto_env import InputError

from ..lanes import check_lanes_are_singles


def make(lanes=3, **settings):
    return gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=lanes, **settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"autoreset_mode": "Never"}, "autoreset_mode must be one of NextStep, SameStep, Disabled"),
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


@pytest.mark.longer
def test_lanes_draw_their_own_pantograph_line_condition_and_speed():
    """Bit for bit as single environments with the seeds that follow, over ends of episodes."""
    scattered = {"pantograph_scatter": 0.1, "line_condition": ["new", "worn", {"broken_droppers": [(2, 4)]}]}
    scattered |= {"speed_kmh": (200, 320), "distance": 20.0, "settle": 0.0, "run_in": 2.0}
    ran = check_lanes_are_singles("panto_env:Pantograph-v0", scattered, steps=60, lanes=5)
    assert ran.ends >= 5
    ran.vector.reset(seed=3)
    plant = ran.vector.unwrapped.task.plant
    assert len({own.tobytes() for own in plant.pantographs.table[0]}) == 5
    amplitudes = plant.run.waves[:, ::3]
    assert set(np.count_nonzero(amplitudes, axis=1)) == {0, 4}
