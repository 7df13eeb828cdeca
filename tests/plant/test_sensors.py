"""What the sensors add: a reading is the sample of the right time step, and noise of the right size."""

import gymnasium
import numpy as np
import pytest

from ..lanes import check_lanes_are_singles

NAME = "panto_env:PantographStiffness-v0"
TIME_STEP, STEPS = 1e-3, 10  # s; time steps in a control step
SERIES = {
    "head displacement": "head",
    "frame displacement": "frame",
    "head velocity": "head_velocity",
    "frame velocity": "frame_velocity",
    "contact force": "contact_force",
}
"""Of the trajectory, behind each entry that is measured."""


def make(**settings):
    return gymnasium.make(
        NAME, time_step=TIME_STEP, actuator={"place": "both"}, observation="full", **settings
    ).unwrapped


def observe(env, steps=25, seed=0):
    """Observations at the start and after each control step, under random actions."""
    observations = [env.reset(seed=seed)[0]]
    for action in np.random.default_rng(seed).uniform(-1, 1, (steps, 2)):
        observations.append(env.step(action)[0])
    return np.array(observations)


def column(env, observations, name):
    return np.array([env.context.layout.read(observation, name) for observation in observations])


@pytest.mark.parametrize("age", [0, 1, 9, 10, 25, 30, 3.25, 9.75, 12.5])
def test_reading_is_as_old_as_the_delay(age):
    """Of so many time steps and half a one, as a sample is a mean over its step: shorter than a control step
    of 10 ms, as long, longer, and between two samples."""
    env = make(sensors={"delay": (age + 0.5) * 1e-3})
    for seed in (0, 1):  # a second episode has no readings of the first
        observations = observe(env, seed=seed)
        run = env.trajectory
        for name, series in SERIES.items():
            at_rest = env.context.layout.read(observations[0], name)
            samples = np.append(at_rest, getattr(run, series))  # row n: of time step n, counted from 1
            row = np.maximum(STEPS * np.arange(len(observations)) - age, 0)
            expected = np.interp(row, np.arange(len(samples)), samples)
            observed = column(env, observations, name)
            assert observed == pytest.approx(expected, rel=1e-6, abs=1e-9), name
            assert np.abs(np.diff(samples[-STEPS:])).min() > 3e-6 * np.abs(samples).max(), name


def test_a_reading_is_at_least_half_a_time_step_old():
    """It is a mean over one."""
    observations = observe(make(sensors={"delay": 0.0}))
    np.testing.assert_array_equal(observations, observe(make(sensors={"delay": 0.5e-3})))
    assert not np.array_equal(observations, observe(make(sensors={"delay": 0.6e-3})))


def test_only_readings_are_late():
    """Not where the train is, what was done, nor what "full" adds."""
    prompt, late = make(), make(sensors={"delay": 0.013})
    first, second = observe(prompt), observe(late)
    for entry in prompt.context.layout.entries:
        same = np.array_equal(column(prompt, first, entry.name), column(late, second, entry.name))
        assert same == (entry.name not in SERIES), entry.name


@pytest.mark.parametrize(
    ("noise", "rms", "names"),
    [
        ("force_noise", 3.0, {"contact force"}),
        ("displacement_noise", 1e-3, {"head displacement", "frame displacement"}),
        ("velocity_noise", 2e-2, {"head velocity", "frame velocity"}),
    ],
)
def test_noise_is_of_its_size_independent_and_on_its_readings_alone(noise, rms, names):
    quiet = make(sensors={"delay": 0.013})
    noisy = make(sensors={noise: rms, "delay": 0.013})
    first, second = observe(quiet, 200), observe(noisy, 200)
    errors = {}
    for entry in quiet.context.layout.entries:
        error = column(noisy, second, entry.name) - column(quiet, first, entry.name)
        if entry.name in names:
            errors[entry.name] = error
        else:
            assert not error.any(), entry.name
    for name, error in errors.items():
        assert error.std() == pytest.approx(rms, rel=0.2), name
        assert abs(error.mean()) < 4 * rms / len(error) ** 0.5, name
        assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.25, name
    if len(errors) == 2:
        assert abs(np.corrcoef(*errors.values())[0, 1]) < 0.25


def test_noise_follows_the_seed():
    env = make(sensors="realistic")
    first = observe(env)
    np.testing.assert_array_equal(first, observe(env))
    assert not np.array_equal(first[0], observe(env, seed=1)[0])


def test_late_readings_of_each_lane_are_its_own():
    """Over the ends of episodes: a lane that begins anew has no readings of its last one."""
    settings = {"sensors": {"delay": 0.025}, "speed_kmh": (200, 300), "distance": 10.0}
    assert check_lanes_are_singles(NAME, settings, steps=60).ends >= 9
