"""A line of many span lengths, through everything that asks where something is.

The line of periodic stiffness computes with any alignment that it is given, so that here it has many
lengths; what is expected follows from the supports' positions alone.
"""

import io

import numpy as np
import pytest
from rich.console import Console

from panto_baselines.oracle.problem import Problem
from panto_baselines.oracle.search import span_periodic
from panto_baselines.policies.feedback import Skyhook
from panto_baselines.tuning.tune import Still, run_batch
from panto_env import Trajectory, simulate
from panto_env.analysis.plots import plot_run
from panto_env.analysis.sweep import sweep
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.diagnosis.features import Evidence, Region, candidates
from panto_env.plant.alignment import Alignment
from panto_env.plant.catenary.periodic_stiffness import PeriodicStiffnessData
from panto_env.render.moment import moment_of
from panto_env.render.strip import Strip
from panto_env.report.findings import Findings

LENGTHS = [50.0, 65.0, 42.5, 60.0, 55.0, 48.0, 63.0, 57.5, 44.0, 61.0, 52.0, 58.0, 46.0]
SUPPORTS = np.concatenate([[0.0], np.cumsum(LENGTHS)])
LINE = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 250.0}
WHOLE = LINE | {"distance": float(SUPPORTS[-1])}


@pytest.fixture(autouse=True)
def many_lengths(monkeypatch):
    monkeypatch.setattr(
        PeriodicStiffnessData, "alignment", lambda line, spans=None: Alignment.of_spans(LENGTHS)
    )


def share(x):
    """Share of its own span at which a position lies."""
    k = np.clip(np.searchsorted(SUPPORTS, x, side="right") - 1, 0, len(LENGTHS) - 1)
    return (x - SUPPORTS[k]) / np.array(LENGTHS)[k]


def between(x, first, last):
    return (x >= SUPPORTS[first - 1]) & (x < SUPPORTS[last])


def test_figures_and_their_spans_file_and_sweep(tmp_path):
    run = simulate(**WHOLE)
    assert run.spans() == (10, 13)
    inside = between(run.position, 3, 5)
    figures = run.summary((3, 5))
    assert figures.distance == pytest.approx(SUPPORTS[5] - SUPPORTS[2], abs=0.5)
    assert figures.contact_loss == pytest.approx(100 * np.mean(run.contact_force[inside] <= 0))
    run.save(tmp_path / "run.parquet")
    loaded = Trajectory.load(tmp_path / "run.parquet")
    assert loaded.alignment == run.alignment
    assert loaded.summary((3, 5)).as_dict() == pytest.approx(figures.as_dict(), nan_ok=True)
    row = sweep({"speed_kmh": [250.0]}, **WHOLE, spans=(3, 5), workers=1)[0]
    assert row["std"] == figures.std


def test_a_train_that_runs_in_covers_whole_spans_of_its_own_lengths():
    task = Task(run_settings(LINE | {"run_in": 3.0, "distance": 200.0}))
    task.reset(0, np.random.default_rng(4))
    drawn = np.random.default_rng(4).uniform(0, 3.0)
    k = int(drawn)
    way = SUPPORTS[k] + (drawn - k) * LENGTHS[k]
    assert task.plant.position(0, task.plant.of(0, 8))[0] == pytest.approx(way, abs=0.7)  # a control step


def test_a_policy_is_in_step_with_the_spans():
    run = simulate(**WHOLE, policy="fb+ff:gain=0.0,theta=0.0", actuator="ideal")
    held = run.position - (run.position % (0.01 * 250 / 3.6))  # at the start of the control step
    np.testing.assert_allclose(run.frame_force, 10 * np.sin(2 * np.pi * share(held + 1e-9)), atol=0.02)


def test_tuning_and_single_passes_evaluate_the_same_spans():
    settings = WHOLE | {"line_condition": "fair", "speed_drift": 3.0}
    force = run_batch(run_settings(settings), [Still(), Skyhook(gains=(50.0, 0.0))], [1000])
    figures = simulate(**settings, seed=1000).summary()
    assert force.mean[0, 0] == pytest.approx(figures.mean, rel=2e-3)
    assert force.std[0, 0] == pytest.approx(figures.std, rel=1e-2)


def test_an_oracle_begins_before_its_spans_and_repeats_with_them():
    problem = Problem(WHOLE, 0, (7, 9))
    assert problem.begin == int((SUPPORTS[6] / (250 / 3.6) - 2.0) / 0.01 + 1e-9)
    waves = span_periodic(problem)
    x = (problem.begin + 1.0 + np.arange(problem.count)) * 0.01 * 250 / 3.6
    np.testing.assert_allclose(waves[:, 1], np.cos(2 * np.pi * share(x)), atol=1e-6)


def test_a_diagnosis_knows_the_supports_near_a_place():
    x = np.arange(0, 600, 0.5)
    evidence = Evidence(x, 0 * x, 0 * x, 1.0, Alignment.of_spans(LENGTHS), np.zeros(0), 70.0, 120.0, 1.0)
    peak = int(np.searchsorted(x, SUPPORTS[5] + 3.0))
    supports = [
        each.position
        for each in candidates(evidence, Region(peak, peak, peak))
        if each.sort.name == "SUPPORT"
    ]
    assert SUPPORTS[5] in supports
    assert set(supports) <= set(SUPPORTS)


def test_report_pictures_and_terminal():
    run = simulate(**WHOLE)
    folded = Findings(run, "run").folded
    at = np.array([np.interp(SUPPORTS[9] + 0.25 * LENGTHS[9], run.position, Findings(run, "run").filtered)])
    assert folded.low[60] <= at[0] <= folded.high[60]
    marks = sorted(
        {line.get_xdata()[0] for line in plot_run(run, "all").axes[0].lines if len(line.get_xdata()) == 2}
    )
    assert set(SUPPORTS[:-1]) <= set(marks)
    task = Task(run_settings(LINE | {"distance": float(SUPPORTS[4] + 20.0)}))
    task.reset(0, np.random.default_rng(0))
    task.run_passively()
    assert moment_of(task, 0, "", {}).alignment.span_of(moment_of(task, 0, "", {}).position) == 5
    console = Console(file=io.StringIO(), width=120)
    console.print(Strip(task, "passive"))
    assert "span 5" in console.file.getvalue()
