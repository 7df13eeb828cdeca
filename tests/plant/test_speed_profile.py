"""A speed that follows a profile: its way, what follows it, and finite elements at a changing speed."""

import gymnasium
import numpy as np
import openpyxl
import pytest
from scipy.integrate import quad

import tests.finite_element.simulation as finite_element
from panto_env import InputError, simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control.settings import run_settings
from panto_env.metrics.by_span import by_speed
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.speed import DRIFT_ROWS, SpeedProfile, ahead, gain

from ..command import panto as run_panto
from ..finite_element.contacts import Collector
from ..finite_element.energy import balance
from ..lanes import check_lanes_are_singles

SIMPLE = {"catenary": "periodic-stiffness", "pantograph": "three-mass"}
BRAKING = [(0, 250), (300, 250), (700, 180), (900, 200)]
EVEN = load_catenary("periodic-stiffness").model_copy(update={"stiffness_variation": 0.0})
"""A spring that is the same everywhere."""


def rows_of(profile, time_step):
    return np.append(np.zeros(DRIFT_ROWS), profile.rows(time_step))[None]


@pytest.mark.parametrize("over", ["place", "time"])
def test_its_way_is_the_integral_of_its_speed(over):
    points = BRAKING if over == "place" else [(0, 100), (7, 160), (20, 160), (31, 90)]
    profile, step = SpeedProfile(over=over, points=points), 2e-3
    rows, (times, speeds) = rows_of(profile, step), profile.knots
    for until in (0.0, 1.7, 6.5, 13.0, 29.0, 60.0):
        way, _ = quad(lambda t: np.interp(t, times, speeds), 0, until, points=times, limit=200)
        steps = np.array([[until / step]])
        assert profile.mean * until + ahead(rows, steps)[0, 0] == pytest.approx(way, abs=1e-6)
        now = profile.mean + gain(rows, until / step)[0] / step
        assert now == pytest.approx(np.interp(until, times, speeds), abs=1e-9)


@pytest.fixture(scope="module")
def braking():
    return simulate(**SIMPLE, speed_profile=BRAKING, distance=1000.0)


def test_over_place_the_square_of_the_speed_is_linear_and_over_time_the_speed(braking):
    squares = np.interp(braking.position, *np.array([(x, v**2) for x, v in BRAKING]).T)
    assert braking.speeds * 3.6 == pytest.approx(np.sqrt(squares), abs=0.02)
    over_time = simulate(**SIMPLE, speed_profile="time:0=250,10=180", distance=900.0)
    expected = np.interp(over_time.time, [0, 10], [250, 180])
    assert over_time.speeds * 3.6 == pytest.approx(expected, abs=0.02)
    assert over_time.position[-1] >= 900.0 - over_time.stride


def test_a_profile_of_one_speed_is_that_speed():
    one = simulate(speed_kmh=250.0, distance=150.0)
    other = simulate(speed_profile=[(0, 250), (100, 250)], distance=150.0)
    np.testing.assert_array_equal(one.contact_force, other.contact_force)
    assert one.summary("all").std == other.summary("all").std


def test_the_lift_is_that_of_the_speed_at_each_step():
    """On a wire that is the same everywhere, and slowly, the contact carries what lifts the pantograph."""
    run = simulate(EVEN, "three-mass", speed_profile="time:0=300,20=120", distance=1100.0)
    lift = 70.0 + 0.00097 * (3.6 * run.speeds) ** 2
    assert np.ptp(lift) > 50.0
    assert run.contact_force == pytest.approx(lift - 1.0 * run.frame, abs=0.6)
    assert run.lift == pytest.approx(lift, abs=1e-3)


@pytest.mark.slow
def test_it_agrees_with_finite_elements_while_the_train_brakes_and_speeds_up():
    """Sigma within 2 %, mean, maximum and minimum within 2 % of the mean."""
    points = [(0, 250), (100, 250), (340, 215), (450, 230)]
    line, pantograph = load_catenary("en50318-2002"), load_pantograph("en50318-2002")
    fine = {"spacing": 0.125, "time_step": 2.5e-4, "window": 0, "distance": 480.0}
    run = simulate("en50318-2002", "en50318-2002", speed_profile=points, **fine)
    motion = finite_element.Motion(*SpeedProfile(points=points).knots)
    other = finite_element.simulate(
        line, pantograph, 250.0, element=0.5, time_step=5e-4, distance=480.0, motion=motion
    )
    ours, theirs = (finite_element.figures(each, (3, 7)) for each in (run, other))
    assert ours.std == pytest.approx(theirs.std, rel=0.02)
    for name in ("mean", "maximum", "minimum"):
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), abs=0.02 * theirs.mean), name


def test_lanes_are_single_environments():
    settings = {"speed_profile": "time:0=200,5=150", "speed_drift": 2.0, "distance": 30.0}
    check_lanes_are_singles("panto_env:PantographStiffness-v0", settings, steps=60)


def test_an_episode_shows_its_speed_and_ends_with_the_distance():
    env = gymnasium.make("panto_env:PantographStiffness-v0", speed_profile=BRAKING, distance=950.0).unwrapped
    env.reset(seed=1)
    seen, ends = [], [False]
    while not any(ends):
        observation, _, *ends, info = env.step(np.zeros(1))
        seen.append((info["position"], env.context.layout.read(observation, "speed")))
    places, speeds = np.array(seen).T
    squares = np.interp(places, *np.array([(x, (v / 3.6) ** 2) for x, v in BRAKING]).T)
    assert speeds == pytest.approx(np.sqrt(squares), rel=1e-3)
    assert places[-2] < 950.0 <= places[-1]
    assert env.task.length.most_control_steps >= len(seen)


def test_a_run_with_a_profile_can_be_saved_and_repeated(braking, tmp_path):
    braking.save(tmp_path / "run.parquet")
    loaded = type(braking).load(tmp_path / "run.parquet")
    assert loaded.settings["speed_profile"]["points"] == [list(point) for point in BRAKING]
    np.testing.assert_array_equal(loaded.speeds, braking.speeds)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([(10, 200), (500, 250)], "begin at 0 and increase"),
        ([(0, 200), (0, 250)], "begin at 0 and increase"),
        ([(0, 200), (50, 300)], "an acceleration of"),
        ([(0, 200), (500, 0)], "from 5 to 1,000 km/h"),
        ([(0, 200)], "points"),
        ("somewhere:0=100,10=110", "'place' or 'time'"),
        ("place:a=100", "must read such as"),
        ([(0, 200), (5000, 600)], "wave speed"),
    ],
)
def test_a_profile_that_no_train_follows_is_refused(given, said):
    with pytest.raises(InputError, match=said):
        simulate(speed_profile=given)


def test_a_profile_takes_the_place_of_a_speed_and_a_speed_in_options_that_of_the_profile():
    profile = SpeedProfile(points=BRAKING)
    assert run_settings({"speed_kmh": 250.0, "speed_profile": BRAKING}).speeds == profile.range
    env = gymnasium.make("panto_env:Pantograph-v0", speed_profile=BRAKING, distance=300.0).unwrapped
    assert env.reset(seed=0)[1]["speed_kmh"] == pytest.approx(3.6 * profile.mean)
    assert env.reset(seed=0, options={"speed_kmh": 250.0})[1]["speed_kmh"] == pytest.approx(250.0)


@pytest.mark.longer
def test_figures_by_classes_of_the_speed_are_those_of_their_places(tmp_path):
    run = simulate(**SIMPLE, speed_profile=[(0, 210), (600, 210), (1000, 235)], distance=1100.0)
    found = by_speed(run, "all")
    assert [(each.low, each.high) for each in found] == [(200.0, 220.0), (220.0, 240.0)]
    kmh, force = 3.6 * run.speeds, low_pass(run.contact_force, run.time_step)
    slow = kmh < 220.0
    assert found[0].std == pytest.approx(force[slow].std())
    assert found[1].max == pytest.approx(force[~slow].max())
    assert sum(each.distance for each in found) == pytest.approx(run.position[-1], rel=1e-3)
    run.save(tmp_path / "run.xlsx", "all")
    assert "by speed" in openpyxl.load_workbook(tmp_path / "run.xlsx").sheetnames
    assert run.speed_in_words == "210 to 235 km/h"


def test_the_command_prints_them():
    line = ("--catenary", "periodic-stiffness", "--pantograph", "three-mass")
    profile = ("--speed-profile", "place:0=210,300=210,900=235", "--fault", "force-silent")
    done = run_panto("simulate", *line, *profile)
    assert done.returncode == 0
    assert "at 210 to 235 km/h" in done.stdout
    assert "by the train's speed" in done.stdout


@pytest.mark.slow
def test_the_judge_s_energy_is_balanced_while_the_train_brakes():
    """What lift and train give, F v y' with the speed of each step, is stored and lost."""
    line, pantograph = load_catenary("en50318-2002"), load_pantograph("en50318-2002")
    line = line.model_copy(update={"spans": 6})
    motion = finite_element.Motion(*SpeedProfile(points=[(0, 250), (60, 250), (290, 220)]).knots)
    found = balance(line, [Collector(pantograph)], 250.0, distance=290.0, motion=motion)
    assert found.steps_with_slack > 0
    assert found.error < 1e-3 * found.turnover
