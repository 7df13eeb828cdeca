"""Copies of environments, in this process and in others, go on as the original does."""

import copy
import pickle
from typing import Any, NamedTuple

import cloudpickle
import gymnasium
import numpy as np
import pytest

import panto_env
from panto_env.backend.packed import PAGE, aligned_zeros, copy_whole
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row

LIVELY = {"sensors": "realistic", "actuator": "realistic", "line_condition": "worn", "distance": 40.0}
LIVELY |= {"speed_kmh": (200, 300), "pantograph_scatter": 0.1}
DEFECTIVE = {"line_condition": ["worn", {"dropper_scatter": 0.003, "broken_droppers": [(1, 3)]}]}


def settings_of(name):
    return LIVELY | (DEFECTIVE if name == "Pantograph-v0" else {})


def make(name, lanes=None):
    settings = settings_of(name)
    return gymnasium.make(name, **settings) if lanes is None else gymnasium.make_vec(name, lanes, **settings)


def run(env, steps, seed=0):
    """All that an environment answers to actions drawn with ``seed``, over the ends of episodes."""
    random, answers = np.random.default_rng(seed), []
    for _ in range(steps):
        answers.append(env.step(random.uniform(-1, 1, env.action_space.shape)))
        if isinstance(env, gymnasium.Env) and any(answers[-1][2:4]):
            answers.append(env.reset())
    return answers


@pytest.mark.parametrize(
    ("name", "lanes"),
    [
        ("Pantograph-v0", None),
        ("Pantograph-v0", 3),
        ("PantographStiffness-v0", 3),
        ("PantographThreeSpan-v0", None),
    ],
)
def test_copies_go_on_bit_for_bit_and_touch_no_other(name, lanes):
    """Made before the first reset and in mid-episode; more ways and classes: tests/envs/test_contract.py."""
    env = make(name, lanes)
    env.action_space.seed(3)
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_equal(twin.reset(seed=4), env.reset(seed=4))
    np.testing.assert_equal(twin.action_space.sample(), env.action_space.sample())
    run(env, 15)
    twin, other = copy.deepcopy(pickle.loads(cloudpickle.dumps(env))), copy.deepcopy(env)
    run(other, 20, seed=2)  # on another way
    other.reset(seed=9)
    np.testing.assert_equal(run(twin, 80, seed=1), run(env, 80, seed=1))


def test_lanes_begun_with_options_go_on_in_a_copy():
    envs = gymnasium.make_vec("PantographStiffness-v0", 3, distance=40.0)
    envs.reset(seed=0)
    envs.reset(options={"speed_kmh": 200, "reset_mask": np.array([False, True, False])})
    twin = copy.deepcopy(envs)
    answers = run(twin, 80)
    np.testing.assert_equal(answers, run(envs, 80))
    assert answers[0][4]["speed_kmh"].tolist() == pytest.approx([300, 200, 300])
    assert answers[-1][4]["speed_kmh"].tolist() == pytest.approx([300, 300, 300])


def test_copy_needs_no_file_of_the_user(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text((panto_env.catalog.loader.FOLDERS["catenary"] / "periodic-stiffness.toml").read_text())
    env = gymnasium.make("PantographStiffness-v0", catenary=str(mine))
    twin = pickle.loads(pickle.dumps(env))
    mine.unlink()
    options = {"distance": 9}
    np.testing.assert_equal(twin.reset(seed=0, options=options), env.reset(seed=0, options=options))


def test_tasks_and_plants_are_copied_too():
    task = Task(run_settings(settings_of("Pantograph-v0")), lanes=2)
    task.reset(np.arange(2), np.random.default_rng)
    action = np.full((2, 1), 0.3)
    task.step(action)
    twin = copy.deepcopy(task)
    for _ in range(3):
        task.step(action)
        twin.step(action)
    np.testing.assert_array_equal(twin.results.observation, task.results.observation)
    np.testing.assert_array_equal(twin.results.values, task.results.values)
    np.testing.assert_equal(twin.figures(1).as_dict(), task.figures(1).as_dict())
    settings = run_settings({})
    plant = Plant(settings.catenary, settings.train, lanes=2)
    plant.start(np.arange(2), np.array([80.0, 81.0]))
    samples = [each.samples(51) for each in (plant, plant)]
    twin = pickle.loads(pickle.dumps(plant))
    plant.advance_passively(50, samples[0])
    twin.advance_passively(50, samples[1])
    np.testing.assert_array_equal(samples[0].rows, samples[1].rows)
    assert np.ptp(samples[0].rows[:, -1, 0, 0]) > 0
    np.testing.assert_array_equal(twin.row(Row.STEP), 50)


class Wire(NamedTuple):
    displacement: Any
    first_span: Any
    nothing: Any


def test_copied_arrays_lie_as_before():
    wire = Wire(aligned_zeros((2, 2, 5), np.float32, place=192), np.arange(3), np.zeros(0))
    copy_whole(wire)
    for twin in (copy.deepcopy(wire), pickle.loads(pickle.dumps(wire))):
        assert not np.shares_memory(twin.displacement, wire.displacement)
        assert twin.displacement.ctypes.data % PAGE == 192
        twin.displacement[1, 1, 2] = 3.0
        assert (wire.displacement == 0).all()
        np.testing.assert_array_equal(twin.first_span, np.arange(3))
        assert twin.nothing.shape == (0,)
