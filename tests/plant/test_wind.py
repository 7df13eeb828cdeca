"""Wind along the track: its gusts have Davenport's spectrum, and act on a pantograph as moving air does."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import lsim

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.diagnosis.passes import estimated_force
from panto_env.plant.state import Row
from panto_env.plant.wind import BANDS, LONGEST_GUST, SHORTEST_GUST, Wind, draw_wind, resolved, winds_at

from ..lanes import check_lanes_are_singles

COEFFICIENT = 0.00097 * 3.6**2  # of every pantograph with one here (N s^2/m^2)
SIMPLE = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}
WINDY = {"wind": 15.0, "turbulence": 0.2}


def davenport(frequency, wind, deviation):
    """Power spectral density (m^2/s) of the wind at a mast, whose whole variance is deviation^2 (m/s)^2."""
    x = 1200 * frequency / wind
    return deviation**2 / 6 * 4 * x**2 / (1 + x**2) ** (4 / 3) / frequency


def test_each_gust_has_the_share_of_its_band_in_davenport_s_spectrum():
    whole, _ = quad(lambda n: davenport(n, 12.0, 2.0), 0, np.inf, limit=200)
    assert whole == pytest.approx(2.0**2, rel=1e-6)
    limits, shares = np.geomspace(LONGEST_GUST, SHORTEST_GUST, BANDS + 1), []
    for long, short in pairwise(limits):
        shares.append(quad(lambda n: davenport(n, 12.0, 1.0), 12 / long, 12 / short)[0])
    assert resolved() == pytest.approx(sum(shares), rel=1e-6)
    assert 0.95 < resolved() < 0.96
    for mean in (12.0, -12.0):
        rows = draw_wind(Wind(mean, 0.25), 1.0, np.random.default_rng(3))
        lengths, phases = 1 / rows[2::3], rows[3::3]
        assert rows[0] == mean
        assert rows[1::3] ** 2 / 2 == pytest.approx(3.0**2 * np.array(shares), rel=1e-6)
        assert ((lengths < limits[:-1]) & (lengths > limits[1:])).all()
        assert (phases.min() < 0.1) & (phases.max() > 0.9)


def test_the_wind_carries_its_gusts_along():
    rows, step = draw_wind(Wind(-9.0, 0.3), 2e-3, np.random.default_rng(1)), 2e-3
    steps = np.arange(0, 40000, 997.0)
    np.testing.assert_allclose(winds_at(rows, 300.0, steps), winds_at(rows, 300.0 - 9.0 * step * steps, 0.0))
    assert np.ptp(winds_at(rows, 300.0, steps)) > 2 * 0.3 * 9.0 * step


def test_the_lift_is_that_of_the_air_s_speed_in_its_mean_and_its_variance():
    """lambda (v + U + u)^2: for Gaussian gusts u, small or not, of the standard deviation s."""
    speed, wind, added = 200 / 3.6, 15.0, []
    for seed in range(200):
        rows = draw_wind(Wind(wind, 0.2), 1e-3, np.random.default_rng(seed))
        gusts = winds_at(rows, speed * 1e-3 * np.arange(0, 20000, 100), np.arange(0, 20000, 100)) / 1e-3
        added.append(COEFFICIENT * ((speed + gusts) ** 2 - speed**2))
    variance = resolved() * 3.0**2
    mean = COEFFICIENT * (2 * speed * wind + wind**2 + variance)
    spread = COEFFICIENT * np.sqrt(4 * (speed + wind) ** 2 * variance + 2 * variance**2)
    assert np.mean(added) == pytest.approx(mean, rel=0.02)
    assert np.std(added) == pytest.approx(spread, rel=0.05)
    # The kernel adds just that, where the train is.
    task = Task(run_settings(SIMPLE | {"line_condition": WINDY, "distance": 550.0}))
    task.reset(0, np.random.default_rng(2))
    plant, step = task.plant, task.plant.time_step
    for _ in range(5):
        task.coast(np.array([20]), task.results)
        steps = plant.of(0, Row.STEP) - 0.5
        air = speed + winds_at(plant.run.wind[0], speed * step * steps, steps) / step
        assert plant.of(0, Row.WIND) == pytest.approx(COEFFICIENT * (air**2 - speed**2), rel=1e-9)
        assert plant.of(0, Row.LIFT) == pytest.approx(plant.of(0, Row.NOMINAL_FORCE), rel=1e-12)


def test_all_else_is_drawn_as_in_still_air():
    given = SIMPLE | {"distance": 300.0, "pantograph_scatter": 0.1, "speed_drift": 3.0, "run_in": 1.0}
    uneven = {"irregularity": 5.0}
    tasks = [Task(run_settings(given | {"line_condition": uneven | more})) for more in ({}, WINDY)]
    for task in tasks:
        task.reset(0, np.random.default_rng(3))
    still, windy = (task.plant for task in tasks)
    np.testing.assert_array_equal(still.run.waves, windy.run.waves)
    np.testing.assert_array_equal(still.run.drift, windy.run.drift)
    np.testing.assert_array_equal(still.pantographs.table, windy.pantographs.table)
    assert still.run.wind.shape == (1, 0)
    assert windy.run.wind[0, 0] == 15.0 * windy.time_step


def test_every_seed_has_its_gusts_and_without_turbulence_there_are_none():
    def force(seed, **condition):
        return simulate(**SIMPLE, distance=200.0, seed=seed, line_condition=condition).contact_force

    np.testing.assert_array_equal(force(1, **WINDY), force(1, **WINDY))
    assert np.abs(force(1, **WINDY) - force(2, **WINDY)).max() > 1
    np.testing.assert_array_equal(force(1, wind=15.0, turbulence=0.0), force(2, wind=15.0, turbulence=0.0))
    np.testing.assert_array_equal(force(1, wind=0.0, turbulence=0.5), force(1))


def test_a_train_does_not_know_the_wind():
    """What it observes, and what it is rewarded for, counts from the lift in still air; so does the trim."""
    given = SIMPLE | {"distance": 300.0, "observation": "centred", "mean_force": 120.0}
    tasks = [Task(run_settings(given | {"line_condition": each})) for each in ("new", WINDY)]
    for task in tasks:
        task.reset(0, np.random.default_rng(0))
    seen = [task.layout.read(task.results.observation[0], "nominal force") for task in tasks]
    assert seen[0] == seen[1]
    given = SIMPLE | {"distance": 550.0, "seed": 2, "mean_force": 100.0}
    runs = [simulate(**given, line_condition=each) for each in ("new", WINDY)]
    assert runs[0].nominal_force == runs[1].nominal_force
    np.testing.assert_array_equal(runs[0].lift, runs[1].lift)
    assert runs[1].summary("all").mean > runs[0].summary("all").mean + 15


def test_lanes_have_gusts_each_of_its_own_as_single_environments_do():
    settings = {"line_condition": ["new", WINDY], "distance": 25.0, "settle": 0.0}
    assert check_lanes_are_singles("panto_env:PantographStiffness-v0", settings, steps=60).ends >= 3


def test_a_wind_that_would_change_nothing_or_has_no_meaning_is_refused():
    refused = {
        "aerodynamic_coefficient": {"pantograph": "en50318-2002"},
        "overtakes a train at 50 km/h": {"speed_kmh": 50.0, "line_condition": {"wind": -15.0}},
        "No wind blows on a rig": {"catenary": "rig", "pantograph": "dsa380"},
        "key 'wind' must be a number from -40 to 40 m/s": {"line_condition": {"wind": 50.0}},
        "cannot resolve gusts of 5 m": {"time_step": 0.05, "control_interval": 0.05},
    }
    for said, changes in refused.items():
        with pytest.raises(InputError, match=said):
            Task(run_settings(SIMPLE | {"line_condition": WINDY} | changes))


def test_an_estimate_from_motion_is_said_to_lack_the_wind_s_lift():
    given = {"distance": 500.0, "record_droppers": False}
    still, windy = (
        simulate("re330", "dsa380", 250.0, **given, line_condition=each)
        for each in ("new", {"wind": 10.0, "turbulence": 0.0})
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        estimated_force(still, 0)
    more = 0.00097 * ((250 + 36) ** 2 - 250**2)
    with pytest.warns(AccuracyWarning, match=rf"wind of 10 m/s, .* its lift, \+{more:.0f} N in the mean"):
        force = estimated_force(windy, 0)
    inside = windy.inside("all")
    missing = np.mean(windy.contact_force[inside] - force[inside])
    assert missing == pytest.approx(more, abs=1.0)


def test_the_contact_force_is_the_linear_pantograph_s_under_that_lift():
    """On an even spring, against SciPy's integration of the equations, and its variance's closed form."""
    line = load_catenary("periodic-stiffness").model_copy(update={"stiffness_variation": 0.0})
    pantograph, speed = load_pantograph("three-mass"), 200 / 3.6
    settings = {"catenary": line, "distance": 550.0, "line_condition": {"wind": 12.0, "turbulence": 0.1}}
    task = Task(run_settings(SIMPLE | settings))
    task.reset(0, np.random.default_rng(5))
    rows, step = task.plant.run.wind[0].copy(), task.plant.time_step
    task.run_passively()
    run = task.trajectory(0)

    def chain(values):
        """Matrix of springs or dampers, each below its mass, the last to the ground."""
        below, above = np.array(values), np.array([0.0, *values[:-1]])
        return np.diag(below + above) - np.diag(values[:-1], 1) - np.diag(values[:-1], -1)

    mass = np.diag(pantograph.masses)
    stiffness, damping = chain(pantograph.stiffnesses), chain(pantograph.dampings)
    contact = line.mean_stiffness  # its strip is rigid there
    stiffness[0, 0] += contact
    nothing, one = np.zeros((3, 3)), np.eye(3)
    a = np.block([[nothing, one], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    b = np.append(np.zeros(3), np.linalg.solve(mass, np.array([0, 0, 1.0])))[:, None]
    times = step * np.arange(len(run.time))
    middle = np.arange(len(run.time)) + 0.5
    air = speed + winds_at(rows, speed * step * middle, middle) / step
    lift = pantograph.static_force + COEFFICIENT * air**2
    gust = np.sum(rows[1::3] * np.cos(2 * np.pi * rows[3::3])) / step
    still = pantograph.static_force + COEFFICIENT * (speed + 12.0 + gust) ** 2
    rest = np.append(np.linalg.solve(stiffness, [0, 0, still]), np.zeros(3))
    _, force, _ = lsim((a, b, contact * np.eye(1, 6), [[0.0]]), lift, times, X0=rest, interp=False)
    between = 0.5 * (force[1:] + force[:-1])  # ours are means over a step
    np.testing.assert_allclose(run.contact_force[:-1], between, atol=0.15)
    assert np.ptp(between) > 5
    # Small gusts: each cosine passes the pantograph's transfer function, and variances add up.
    omega = 2 * np.pi * rows[2::3] * (speed + 12.0)
    passed = [np.linalg.solve(stiffness + 1j * w * damping - w**2 * mass, [0, 0, 1.0])[0] for w in omega]
    gusts = 2 * COEFFICIENT * (speed + 12.0) * rows[1::3] / step
    long = simulate(**SIMPLE | settings | {"distance": 8000.0, "spans": 165, "seed": 5})
    share = np.abs(contact * np.array(passed) * gusts) ** 2 / 2
    assert np.std(long.contact_force) == pytest.approx(np.sqrt(share.sum()), rel=0.05)
    steady = np.linalg.solve(stiffness, [0, 0, 1.0])[0] * contact
    still = long.nominal_force + COEFFICIENT * (24.0 * speed + 12.0**2 + resolved() * 1.2**2)
    assert np.mean(long.contact_force) == pytest.approx(steady * still, rel=0.01)
