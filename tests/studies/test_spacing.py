"""Distances between two pantographs: how theories are held against curves, and what the whole study says."""

import csv
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from panto_env import simulate
from panto_env.studies import Outcome, write
from panto_env.studies.spacing import study as passes
from panto_env.studies.spacing.study import distances_table, extremes_table, verdict

from ..pages import check_page
from . import made

DISTANCES = np.arange(35.0, 400.0, 2.5)
SPEED = 250.0


def made_up(frequency, phase, swing=10.0):
    """σ that goes up and down over the distance."""
    std = 40.0 + swing * np.cos(2 * pi * (frequency * DISTANCES / (SPEED / 3.6) - phase))
    figures = dict.fromkeys(("mean", "std", "max", "min", "contact_loss", "max_uplift"), std)
    return passes.Curve(passes.CASES[0], SPEED, DISTANCES, figures, figures)


@pytest.mark.parametrize(("frequency", "phase"), [(0.9, 0.0), (1.3, 0.3), (1.3, 0.9)])
def test_a_fit_finds_what_a_curve_was_made_of(frequency, phase):
    curve = made_up(frequency, phase)
    right, wrong = passes.fit(curve, frequency), passes.fit(curve, 0.7 * frequency)
    assert right.correlation == pytest.approx(1.0)
    assert (right.phase + 0.5) % 1 == pytest.approx((phase + 0.5) % 1)
    assert right.in_phase == pytest.approx(np.cos(2 * pi * phase), abs=0.1)
    assert wrong.correlation < 0.4


def test_the_strongest_frequency_of_a_swing_that_dies_out():
    time = np.arange(0.0, 6.99, passes.INTERVAL)
    height = (
        0.05 + 0.02 * np.exp(-time / 4) * np.cos(2 * pi * 1.17 * time) + 0.004 * np.sin(2 * pi * 2.6 * time)
    )
    after = passes.Wake(time, height, np.gradient(height, passes.INTERVAL))
    assert passes.strongest(after) == pytest.approx(1.17, abs=0.02)


def test_frequencies_by_hand():
    time = np.arange(0.0, 6.99, passes.INTERVAL)
    after = passes.Wake(time, np.cos(2 * pi * time), time)
    found = passes.frequencies(passes.CASES[0], SPEED, after)
    assert list(found) == list(passes.THEORIES)
    assert found["span"] == pytest.approx(SPEED / 3.6 / 60)
    assert found["half_span"] == pytest.approx(SPEED / 3.6 / 30)
    assert found["contact_wire"] == pytest.approx((20e3 / 1.35) ** 0.5 / 120)
    assert found["both_wires"] == pytest.approx((36e3 / 2.42) ** 0.5 / 120)
    assert found["measured"] == pytest.approx(1.0, abs=0.02)


def test_the_wire_is_looked_at_when_the_second_arrives():
    time = np.arange(0.0, 6.99, passes.INTERVAL)
    after = passes.Wake(time, np.cos(2 * pi * time), -np.sin(2 * pi * time))
    found = passes.at_arrival(made_up(1.0, 0.0), after)
    assert found["height"] == pytest.approx(1.0, abs=0.01)
    assert abs(found["velocity"]) < 0.2


def test_the_verdict_is_the_theory_that_fits_best():
    bad, good = passes.Fit(1.0, 0.2, 0.0, 0.0), passes.Fit(1.0, 0.9, 0.25, 0.0)
    fits = dict.fromkeys([*passes.THEORIES, "best"], bad) | {"half_span": good}
    assert "period v / f of: half spans, f = 2 v / l (mean R 0.90" in verdict([(made_up(1, 0), fits)])


def test_the_wake_begins_with_the_wire_under_the_pantograph(monkeypatch):
    assert passes.DISTANCES[-1] / (passes.SPEEDS_KMH[0] / 3.6) - 0.3 < passes.AFTERWARDS - passes.INTERVAL
    monkeypatch.setattr(passes, "WATCHED", range(3, 5))
    monkeypatch.setattr(passes, "AFTERWARDS", 2.5)
    after = passes.wake(passes.CASES[0], SPEED)
    run = simulate(passes.CASES[0].line, passes.CASES[0].pantograph, SPEED, distance=330.0)
    middles = [60.0 * (span - 0.5) for span in passes.WATCHED]
    under = np.interp(middles, run.position, run.wire).mean()
    assert after.height[0] == pytest.approx(under, abs=1e-3)
    moved = np.cumsum(after.velocity)[100:200] * passes.INTERVAL
    begun = after.height[0] - 0.5 * passes.INTERVAL * after.velocity[0]
    np.testing.assert_allclose(moved, after.height[100:200] - begun, atol=3e-3)


@pytest.mark.longer
def test_curves_are_figures_of_runs(monkeypatch):
    monkeypatch.setattr(passes, "SPEEDS_KMH", (SPEED,))
    (curve,), rows = passes.curves(passes.CASES[0], (50.0, 120.0))
    assert (curve.speed_kmh, len(rows)) == (SPEED, 2 * 2)
    line, pantograph = passes.CASES[0]
    run = simulate(line, pantographs=[pantograph] * 2, distances=[120.0], speed_kmh=SPEED)
    spans = run.train[-1].spans()
    for figures, own in zip((curve.first, curve.second), run.train, strict=True):
        assert figures["std"][1] == own.summary(spans).std
        assert figures["max_uplift"][1] == own.summary(spans).max_uplift
    table = distances_table([replace(curve, distances=np.array([35.0, 45.0]))])
    assert [row[0] for row in table.rows] == ["35", "45"]
    assert table.rows[1][1] == f"{run.followers[0].summary(spans).std:.1f}"


def test_rows_are_written_as_csv_beside_the_numbers(tmp_path):
    outcome = Outcome("a title", (), rows={"some": [{"std": 1.5}]}, verdict="It is so.")
    assert [path.name for path in write(outcome, tmp_path)] == ["numbers.json", "some.csv"]
    with (tmp_path / "some.csv").open(encoding="utf-8-sig") as file:
        assert list(csv.DictReader(file)) == [{"std (N)": "1.5"}]
    assert outcome.as_dict()["verdict"] == "It is so."


def test_extremes_by_hand():
    curve = made_up(1.0, 0.0)
    level = replace(curve, first={"std": 40.0 + 0 * DISTANCES})
    table = extremes_table([(level, {"height": 0.5, "velocity": 0.0})])
    (row,) = table.rows
    worst = DISTANCES[curve.second["std"].argmax()]
    assert worst % (SPEED / 3.6) == pytest.approx(0.0, abs=1.5) or worst % (SPEED / 3.6) > SPEED / 3.6 - 1.5
    assert row[2] == "40.0"
    assert row[4] == f"{curve.second['std'].max():.1f} at {worst:g}"
    assert 45 < float(row[5]) < 55
    assert row[6] == "100"


DIFFER = {"correlation of the second's σ with the wire's upward velocity when it arrives, mean"}
"""What does not agree with others; docs/train-spacing.md says why."""


@pytest.mark.study
def test_the_wire_s_own_swing_says_which_distances_are_bad():
    outcome = made("spacing")
    check_page("train-spacing.md", {table.title: table for table in outcome.tables})
    mean = outcome.numbers["mean_correlation"]
    assert mean["measured"] > 0.75
    assert max(mean[key] for key in ("span", "half_span", "contact_wire", "both_wires")) < 0.35
    assert mean["best"] - mean["measured"] < 0.05
    assert {each.quantity for each in outcome.comparisons if not each.agrees} == DIFFER
    assert outcome.verdict.startswith(
        "The second pantograph's σ follows the distance with the period v / f of: wire after one pantograph"
    )
