"""Parts of a task by themselves: records, starts, what a computation that diverged shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from panto_env.backend import python_function
from panto_env.control import Task
from panto_env.control.record import LARGEST_DEVIATION, diverged
from panto_env.control.settings import run_settings
from panto_env.control.state import TaskRow
from panto_env.plant.pantograph.step import shared_forces
from panto_env.plant.state import LARGEST_HEIGHT, Ending, Row

SHORT = {"distance": 120.0, "spans": 6, "window": 0}


def test_a_record_is_not_changed_by_what_its_task_does_next():
    task = Task(run_settings(SHORT), record_droppers=True)
    task.reset(0, np.random.default_rng(0))
    task.coast(np.array([20]), task.results)
    early, names = task.trajectory(0), ("uplift", "dropper_force", "contact_force", "wire")
    before = {name: getattr(early, name).copy() for name in names}
    shared = task.trajectory(0, last=True)
    assert np.shares_memory(shared.uplift, task.samples.uplift)
    assert np.shares_memory(shared.dropper_force, task.samples.tension)
    task.samples.uplift[:], task.samples.tension[:], task.samples.rows[:] = 1.0, 2.0, 3.0
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(early, name), values)
    assert (shared.uplift == 1.0).all()
    assert (shared.dropper_force == 2.0).all()


def test_one_impossible_value_shows_that_a_lane_diverged():
    endings = np.full((4, len(TaskRow)), float(Ending.NONE))
    endings[3, TaskRow.ENDING] = Ending.DIVERGED
    task = SimpleNamespace(episode=SimpleNamespace(table=endings))
    deviation = np.array([0.5, 1.0, 0.5, 0.5]) * LARGEST_DEVIATION
    height = np.array([0.5, 0.5, -1.0, 0.5]) * LARGEST_HEIGHT
    assert diverged(task, np.arange(4), deviation, height).tolist() == [False, True, True, True]
    assert diverged(task, np.array([2, 0]), deviation[:2], height[:2]).tolist() == [False, True]


def test_each_lane_keeps_the_sample_of_its_own_start():
    task = Task(run_settings(SHORT | {"speed_kmh": (200.0, 300.0), "pantograph": "dsa380"}), lanes=3)
    task.reset(np.arange(3), lambda lane: np.random.default_rng(lane))
    kept = task.samples.rows[:, 0, 0]
    assert len({float(each[Row.HEAD_HEIGHT]) for each in kept}) == 3  # lift and height go by the speed
    for lane in range(3):
        np.testing.assert_array_equal(kept[lane], task.plant.run.table[0, lane, : kept.shape[1]])


@pytest.mark.plain
def test_a_head_shares_its_force_as_two_springs_do():
    """Numerators are gaps, denominators compliances; a newton on one takes the head from the other."""
    share = python_function(shared_forces)
    gaps, compliance, through = np.array([2e-3, 1e-3]), np.array([3e-5, 4e-5]), 1e-5
    matrix = np.array([[compliance[0], through], [through, compliance[1]]])
    expected = np.linalg.solve(matrix, gaps)
    assert (expected > 0).all()
    assert share((gaps[0], compliance[0]), (gaps[1], compliance[1]), through) == pytest.approx(expected)
    # The second wire would pull, by little: then it is not touched.
    barely = through * gaps[0] / compliance[0] - 1e-9
    assert share((gaps[0], compliance[0]), (barely, compliance[1]), through) == pytest.approx(
        (gaps[0] / compliance[0], 0.0)
    )
    barely = through * gaps[1] / compliance[1] - 1e-9
    assert share((barely, compliance[0]), (gaps[1], compliance[1]), through) == pytest.approx(
        (0.0, gaps[1] / compliance[1])
    )
    assert share((-1e-3, 3e-5), (-1e-3, 3e-5), 0.0) == (0.0, 0.0)
