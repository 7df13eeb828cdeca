"""What an odometer adds to position and speed: a saw-tooth from mast to mast, a scale, noise."""

import copy

import gymnasium
import numpy as np
import pytest

from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.sensors import sensor_settings

from ..lanes import check_lanes_are_singles

NAME = "panto_env:PantographStiffness-v0"
SPAN, SPEED = 50.0, 200 / 3.6
"""Of the environment's line (m), and of the runs (m/s)."""
PLACES = ("sine of span position", "cosine of span position")


def runs(sensors, seeds=1, distance=600.0, **settings):
    """True positions (m), errors of the position read (m) and of the speed (m/s) of an episode per seed."""
    env = gymnasium.make(NAME, sensors=sensors, speed_kmh=200.0, distance=distance, **settings).unwrapped
    layout = env.context.layout
    assert env.context.alignment.mean_length == SPAN
    for seed in range(seeds):
        seen, info = env.reset(seed=seed)
        told, ended = [(info["position"], seen)], False
        while not ended:
            seen, _, *ends, info = env.step(np.zeros(1))
            told.append((info["position"], seen))
            ended = any(ends)
        position = np.array([each for each, _ in told])
        sine, cosine, speed = (
            np.array([layout.read(seen, name) for _, seen in told]) for name in (*PLACES, "speed")
        )
        turns = np.arctan2(sine, cosine) / (2 * np.pi) - position / SPAN
        yield position, SPAN * (turns - np.round(turns)), speed - SPEED


def test_a_wrong_wheel_makes_a_saw_tooth_and_a_wrong_speed():
    """Of one slope along the run, zero at every mast; the slope is the share by which speed is wrong."""
    scales = []
    for position, error, speed in runs("ideal:odometer_scale=0.02", seeds=60, distance=80.0):
        scale = speed[1] / SPEED
        np.testing.assert_allclose(speed, scale * SPEED, atol=2e-5)
        np.testing.assert_allclose(error, scale * (position % SPAN), atol=2e-5)
        scales.append(scale)
    assert np.std(scales) == pytest.approx(0.02, rel=0.25)
    assert abs(np.mean(scales)) < 4 * 0.02 / 60**0.5


def test_a_mast_is_detected_with_an_error_that_lasts_until_the_next():
    jitter = []
    for position, error, speed in runs("ideal:mast_jitter=0.3", seeds=10, distance=1000.0):
        number = np.floor(position / SPAN).astype(int)
        for mast in range(number.max() + 1):
            errors = error[number == mast]
            np.testing.assert_allclose(errors, errors[0], atol=2e-5)
            jitter.append(errors[0])
        np.testing.assert_allclose(speed, 0.0, atol=2e-5)
    assert np.std(jitter) == pytest.approx(0.3, rel=0.15)
    assert abs(np.corrcoef(jitter[1:], jitter[:-1])[0, 1]) < 0.25


def test_slip_is_a_random_walk_from_mast_to_mast():
    """Its variance grows with the way, and increments are independent."""
    steps, ends = [], []
    for position, error, _ in runs("ideal:odometer_walk=1.0", seeds=8, distance=1000.0):
        number = np.floor(position / SPAN).astype(int)
        for mast in range(1, number.max()):
            errors = error[number == mast]
            steps += list(np.diff(errors))
            ends.append(errors[-1])
    assert np.std(steps) == pytest.approx(np.sqrt(SPEED * 0.01 / 100.0), rel=0.05)
    assert abs(np.corrcoef(steps[1:], steps[:-1])[0, 1]) < 0.05
    assert np.std(ends) == pytest.approx(np.sqrt(SPAN / 100.0), rel=0.15)


def test_noise_of_the_speed_is_on_the_speed_alone():
    ((_, error, speed),) = runs("ideal:speed_noise=0.5", distance=1000.0)
    np.testing.assert_allclose(error, 0.0, atol=2e-5)
    assert speed.std() == pytest.approx(0.5, rel=0.1)
    assert abs(np.corrcoef(speed[1:], speed[:-1])[0, 1]) < 0.1


@pytest.mark.plain
def test_blind_sensors_read_no_position_and_all_else_as_realistic_ones():
    """Sine and cosine of the place are zero, and else of a point on the unit circle."""
    envs = [gymnasium.make(NAME, sensors=sensors).unwrapped for sensors in ("realistic", "blind")]
    seen = [[env.reset(seed=4)[0]] for env in envs]
    for env, told in zip(envs, seen, strict=True):
        told += [env.step(np.zeros(1))[0] for _ in range(30)]
    realistic, blind = np.array(seen)
    layout = envs[0].context.layout
    places = [layout.index(name) for name in PLACES]
    assert not blind[:, places].any()
    assert (realistic[:, places] ** 2).sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    rest = np.delete(np.arange(len(layout.entries)), places)
    np.testing.assert_array_equal(realistic[:, rest], blind[:, rest])


def test_an_odometer_leaves_the_other_noise_and_the_motion_as_they_were():
    """Over several episodes, and more readings than are drawn at a time."""
    quiet = {"force_noise": 2.0, "displacement_noise": 2e-5, "velocity_noise": 5e-3, "delay": 0.005}
    tasks = [
        Task(run_settings({"sensors": sensors, "line_condition": "fair", "speed_kmh": (200, 300)}))
        for sensors in (quiet, "realistic")
    ]
    generators = [np.random.default_rng(5), np.random.default_rng(5)]
    layout = tasks[0].layout
    same = [k for k, entry in enumerate(layout.entries) if entry.name not in (*PLACES, "speed")]
    for _ in range(3):
        for task, random in zip(tasks, generators, strict=True):
            task.reset(0, random)
        for _ in range(100):
            for task in tasks:
                task.step(np.zeros((1, 1)))
            first, second = (task.results.observation[0] for task in tasks)
            np.testing.assert_array_equal(first[same], second[same])
            assert not np.array_equal(first, second)


def test_each_episode_has_another_wheel():
    """Where nothing else is drawn, too."""
    task = Task(run_settings({"sensors": "ideal:odometer_scale=0.01", "distance": 20.0}))
    random, speeds = np.random.default_rng(0), set()
    for _ in range(5):
        task.reset(0, random)
        speeds.add(float(task.results.observation[0, task.layout.index("speed")]))
    assert len(speeds) == 5


def test_lanes_have_odometers_of_their_own_as_single_environments_do():
    settings = {"sensors": "realistic", "distance": 25.0, "run_in": 1.5, "speed_drift": 4.0, "settle": 0.0}
    assert check_lanes_are_singles(NAME, settings, steps=130).ends >= 8


def test_a_copy_goes_on_as_the_original():
    task = Task(run_settings({"sensors": "realistic", "catenary": "periodic-stiffness"}))
    task.reset(0, np.random.default_rng(1))
    other = copy.deepcopy(task)
    for _ in range(100):
        for each in (task, other):
            each.step(np.full((1, 1), 0.3))
        np.testing.assert_array_equal(task.results.observation, other.results.observation)


def test_realistic_sensors_are_within_the_bounds_of_etcs():
    """5 m and 5 % of the way, at three standard deviations."""
    sensors = sensor_settings("realistic")
    worst = 3 * (sensors.odometer_scale * SPAN + sensors.odometer_walk + sensors.mast_jitter)
    assert worst < 5.0 + 0.05 * SPAN
    assert 3 * sensors.odometer_scale < 0.05
