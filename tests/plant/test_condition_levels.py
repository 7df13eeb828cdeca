"""Named conditions of a line: how uneven each is, and what that does to the figures of a run."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.plant.line_condition import LINE_CONDITIONS, draw
from panto_env.studies.en50318 import conditions

LEVELS = ("smooth", "fair", "worn")
TOLERANCE = 10e-3  # by which heights at neighbouring droppers may differ (m): EN 50119, recalled


def heights(level, seed, x):
    """Height of the running surface (m) at x (m), (n,)."""
    waves = draw([LINE_CONDITIONS[level]], np.random.default_rng(seed)).waves
    return (waves[:, :1] * np.cos(2 * np.pi * (np.outer(waves[:, 1], x) + waves[:, 2:]))).sum(axis=0)


@pytest.mark.parametrize(("level", "twice_rms"), [("smooth", 0.44e-3), ("fair", 2.2e-3), ("worn", 4.4e-3)])
def test_heights_at_droppers_differ_by_as_much_as_is_said(level, twice_rms):
    x = np.arange(0, 600, 0.05)
    differences = [heights(level, seed, x + 6) - heights(level, seed, x) for seed in range(20)]
    assert 2 * np.sqrt(np.mean(np.square(differences))) == pytest.approx(twice_rms, rel=0.1)
    assert np.abs(differences).max() < TOLERANCE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "pantograph", "speed"),
    [("en50318-2002", "en50318-2002", 250.0), ("sweden-st15", "dsa250", 160.0), ("re330", "dsa380", 330.0)],
)
def test_a_fair_line_is_worse_than_a_smooth_one_and_a_worn_one_than_both(line, pantograph, speed):
    """By percents of sigma, not by tenths of one."""

    def sigma(level, seed=0):
        run = simulate(line, pantograph, speed, seed=seed, line_condition=level, record_droppers=False)
        return run.summary().std

    new = sigma("new")
    smooth, fair, worn = (np.mean([sigma(level, seed) for seed in range(4)]) / new - 1 for level in LEVELS)
    assert abs(smooth) < 0.01
    assert 0.015 < fair < 0.12
    assert 0.08 < worn < 0.4
    assert worn > 2 * fair


def test_waves_shorter_than_the_train_covers_at_20_hz_reach_losses_and_peaks_but_not_sigma():
    """At 300 km/h these are waves below 4.2 m; waves of the same depth and 5 m do reach sigma."""

    def figures(**waves):
        run = simulate(line_condition=waves, record_droppers=False)
        return run.summary(), run.contact_force[run.inside()].max()

    new, peak = figures()
    short, short_peak = figures(wear_depth=2e-3, wear_wavelength=0.8)
    long, _ = figures(wear_depth=2e-3, wear_wavelength=5.0)
    assert short.std == pytest.approx(new.std, rel=0.01)
    assert short.max == pytest.approx(new.max, rel=0.01)
    assert short.contact_loss > new.contact_loss + 0.5
    assert short_peak > peak + 25.0
    assert abs(long.std / new.std - 1) > 0.03
    assert long.contact_loss < 0.1


def test_at_low_speed_the_same_short_waves_reach_sigma():
    """At 50 km/h waves of 0.8 m come at 17 Hz."""
    given = {"speed_kmh": 50.0, "spans": 12, "distance": 360.0, "record_droppers": False, "accuracy": "fast"}
    new, worn = (
        simulate(**given, line_condition=waves).summary((3, 5)).std
        for waves in ({}, {"wear_depth": 0.5e-3, "wear_wavelength": 0.8})
    )
    assert worn > 1.03 * new


def test_the_table_of_conditions_has_every_preset_and_is_of_simulated_passes(monkeypatch):
    monkeypatch.setattr(conditions, "LEVEL_SEEDS", 2)
    checks = conditions.check_conditions("en50318-2002", "en50318-2002", 250.0)
    assert [check.condition for check in checks] == list(LINE_CONDITIONS)
    assert [check.seeds for check in checks] == [1, 2, 2, 2, 2]
    worn = checks[-1]
    runs = [
        simulate(speed_kmh=250.0, line_condition="worn", seed=seed, record_droppers=False).summary()
        for seed in range(2)
    ]
    assert worn.std[0] == pytest.approx(np.mean([run.std for run in runs]))
    assert worn.std[1] == pytest.approx(np.std([run.std for run in runs]))
    assert worn.change == pytest.approx(100 * (worn.std[0] / checks[0].std[0] - 1))
