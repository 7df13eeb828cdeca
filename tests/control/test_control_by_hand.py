"""Parts of a task by themselves: records, starts, lines drawn, what a computation that diverged shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from panto_env.backend import python_function
from panto_env.catalog import load_catenary
from panto_env.control import Task, passive_run
from panto_env.control.lines import on_drawn_line, on_example
from panto_env.control.record import LARGEST_DEVIATION, diverged, trajectory
from panto_env.control.reward import add_to_limits
from panto_env.control.settings import run_settings
from panto_env.control.state import NOW, Now, TaskRow
from panto_env.plant.pantograph.step import shared_forces
from panto_env.plant.state import LARGEST_HEIGHT, Ending, Row

SHORT = {"distance": 120.0, "spans": 6, "window": 0}


def test_a_record_is_not_changed_by_what_its_task_does_next():
    task = Task(run_settings(SHORT), record_droppers=True)
    task.reset(0, np.random.default_rng(0))
    task.coast(np.array([20]), task.results)
    early = trajectory(task, 0)
    before = {
        name: getattr(early, name).copy() for name in ("uplift", "dropper_force", "contact_force", "wire")
    }
    shared = trajectory(task, 0, last=True)
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


def test_a_list_of_lines_is_drawn_from_and_all_else_stays():
    names = ("en50318-2002", "re250", "re330")
    settings = run_settings({"catenary": list(names), "speed_kmh": 220.0})
    drawn = [on_drawn_line(settings, lambda seed=seed: np.random.default_rng(seed)) for seed in range(40)]
    assert {each.catenary.name for each in drawn} == set(names)
    assert on_example(settings).catenary.name == names[0]
    for each in drawn:
        assert each.model_dump(exclude={"catenary"}) == settings.model_dump(exclude={"catenary"})
    one = on_example(settings)
    assert on_drawn_line(one, lambda: pytest.fail("nothing is drawn")) is one


def test_each_lane_keeps_the_sample_of_its_own_start():
    task = Task(
        run_settings(SHORT | {"speed_kmh": (200.0, 300.0), "pantograph": "dsa380"}),
        lanes=3,
        keep_samples=True,
    )
    task.reset(np.arange(3), lambda lane: np.random.default_rng(lane))
    kept = task.samples.rows[:, 0, 0]
    assert len({float(each[Row.HEAD_HEIGHT]) for each in kept}) == 3  # lift and height go by the speed
    for lane in range(3):
        np.testing.assert_array_equal(kept[lane], task.plant.run.table[0, lane, : kept.shape[1]])


def test_means_of_passive_runs_are_kept_for_a_line_with_all_its_values(monkeypatch):
    asked = []
    monkeypatch.setattr(
        passive_run, "kept", lambda kind, line, inputs, run: asked.append((kind, line, inputs)) or ([], [])
    )
    line = load_catenary("re330")
    other = line.model_copy(update={"encumbrance": line.encumbrance + 0.1})
    for each in (line, other):
        settings = run_settings({"catenary": each, "speed_kmh": 250.0})
        assert passive_run._at_speed(settings, lambda designed: None, 250.0 / 3.6) == []
    (kind, name, first), (_, _, second) = asked
    assert (kind, name) == ("passive_run", "re330")
    assert first["catenary"]["droppers"]["positions"] == list(line.droppers.positions)
    assert first != second


@pytest.mark.plain
@pytest.mark.parametrize(
    ("uplift", "force", "expected"), [(0.11, 301.0, (1, 1)), (0.1, 300.0, (0, 0)), (0.11, 300.0, (1, 0))]
)
def test_a_step_beyond_a_limit_counts_once(uplift, force, expected):
    task, now = np.zeros(len(TaskRow)), np.zeros(len(Now))
    task[TaskRow.UPLIFT_LIMIT], task[TaskRow.FORCE_LIMIT] = 0.1, 300.0
    python_function(add_to_limits)(task, now, force, uplift)
    assert (now[NOW.UPLIFT_STEPS], now[NOW.FORCE_STEPS]) == expected


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
