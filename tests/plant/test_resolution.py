"""Grid and time step: fine enough by default, and said where they are not."""

import warnings

import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.resolution import GRIDS, Resolution, fine_enough, resolution
from panto_env.plant.line_condition import LINE_CONDITIONS, LineCondition
from panto_env.plant.numerics import WINDOW, Numerics, Runs
from panto_env.studies.en50318 import lines

from ..command import panto

LINE = load_catenary("en50318-2002")


def runs(slow, quick=None, **others):
    return Runs((slow / 3.6, (quick or slow) / 3.6), **others)


def chosen(runs, **numerics):
    return resolution(LINE, Numerics(**numerics), runs)


def test_grid_and_step_go_by_the_slowest_and_the_fastest_train():
    ordinary, near_the_waves, slow = (chosen(runs(speed)) for speed in (300, 400, 60))
    assert ordinary == Resolution(0.3, 1.25e-3, WINDOW["full"])
    assert near_the_waves.spacing == GRIDS[-1][1]
    assert slow.time_step < ordinary.time_step
    both = chosen(runs(60, 400))
    assert both.spacing == min(slow.spacing, near_the_waves.spacing)
    assert both.time_step <= min(slow.time_step, near_the_waves.time_step)


def test_the_control_interval_is_a_whole_number_of_steps():
    for interval in (0.01, 0.004, 0.0017):
        step = chosen(runs(300, control_interval=interval)).time_step
        assert interval / step == pytest.approx(round(interval / step))
        assert step <= 1.25e-3


def test_short_waves_are_passed_in_eight_steps_and_deep_ones_want_a_finer_grid():
    worn = LINE_CONDITIONS["worn"]
    deep = LineCondition(wear_depth=2e-3, wear_wavelength=0.8)
    assert chosen(runs(300, conditions=[worn])).time_step <= 0.8 / (300 / 3.6) / 8
    assert chosen(runs(300, conditions=[worn])).spacing == 0.3
    assert fine_enough(LINE, runs(300, conditions=[deep])).spacing < 0.2


def test_a_step_that_cannot_carry_the_waves_is_refused():
    condition = {"wear_depth": 1e-3, "wear_wavelength": 0.4}
    with pytest.raises(
        InputError, match=r"cannot resolve waves of 0\.4 m at 300 km/h.*Take a time step below 2\.4 ms"
    ):
        simulate(line_condition=condition, time_step=2.5e-3)
    for line in ("ohl-three-span", "periodic-stiffness"):
        with pytest.raises(InputError, match="cannot resolve waves"):
            simulate(line, "three-mass", line_condition=condition, time_step=5e-3)
        assert simulate(line, "three-mass", line_condition=condition, distance=100.0).time_step <= 0.0006


@pytest.mark.parametrize(
    ("settings", "error"),
    [({"spacing": 0.5}, 5), ({"time_step": 2.5e-3}, 5), ({"speed_kmh": 400, "spacing": 0.25}, 8)],
    ids=str,
)
def test_what_is_coarser_than_needed_is_used_with_a_warning_of_the_error(settings, error):
    with pytest.warns(AccuracyWarning, match=f"may be wrong by up to about {error} %"):
        run = simulate(distance=60.0, **settings)
    assert len(run.time) > 0


def test_the_default_the_fast_grid_and_finer_ones_warn_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for settings in ({}, {"accuracy": "fast"}, {"spacing": 0.2, "time_step": 5e-4}, {"speed_kmh": 30}):
            simulate(distance=60.0, record_droppers=False, **settings)


def test_a_train_so_slow_that_it_feels_the_nodes_is_told_so():
    with pytest.warns(
        AccuracyWarning, match="At 5 km/h a train passes 14 nodes per second of a grid of 0.1 m"
    ):
        simulate(speed_kmh=5.0, distance=1.0)


def test_the_command_line_says_it_in_one_line():
    told = panto("simulate", "--spacing", "0.5")
    assert told.returncode == 0
    (line,) = (each for each in told.stderr.splitlines() if each.startswith("panto: warning"))
    assert "may be wrong by up to about 5 %" in line
    assert "resolution.py" not in told.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("name", "speed"), list(lines.cases()))
def test_figures_are_within_one_per_cent_of_converged(name, speed):
    """Of the maximum and the minimum in per cent of the mean force, of contact loss in points."""
    full, fast = lines.check_line(name, speed)
    assert abs(full.std) < 1.0
    assert max(abs(full.max), abs(full.min)) < 0.01 * full.mean
    assert abs(full.contact_loss) < 0.1
    assert full.spacing <= fast.spacing
