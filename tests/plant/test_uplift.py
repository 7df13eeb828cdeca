"""Aerodynamic force: by a law or a measured table, in wind and tunnels; on an even spring in closed form."""

import warnings

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import line, load_catenary, load_pantograph, pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.diagnosis.passes import estimated_force
from panto_env.plant.state import Row
from panto_env.plant.wind import Wind, draw_wind, winds_at

LAW = load_pantograph("three-mass")  # 0.00097 N/(km/h)^2, and a rigid strip
EVEN = load_catenary("periodic-stiffness").model_copy(update={"stiffness_variation": 0.0})
SIMPLE = {"catenary": EVEN, "speed_kmh": 200.0, "distance": 550.0}
COARSE = ((100.0, 6.0), (150.0, 30.0), (260.0, 55.0), (500.0, 90.0))
WINDY = {"wind": 12.0, "turbulence": 0.1}
SHORT = {"tunnels": [{"begin": 0.0, "end": 50.0, "factor": 1.2}]}
ACROSS = {"pantograph": "dsa250", "line_condition": {"side_wind": 9.0}}


def own(**values):
    return pantograph(values, like="three-mass")


def tabled(speeds):
    return own(uplift_over_speed=[[float(v), LAW.aerodynamic_coefficient * v**2] for v in speeds])


def share():
    """Share of a steady lift that reaches the wire: springs in a row, the last one to the ground."""
    above = sum(1 / each for each in LAW.stiffnesses[:-1]) + 1 / EVEN.mean_stiffness
    return 1 / (1 + LAW.stiffnesses[-1] * above)


def test_a_table_is_the_law_at_its_points_straight_between_and_nothing_at_rest():
    table = tabled((80, 160, 320))
    for kmh in (80.0, 160.0, 320.0):
        assert table.aerodynamic_uplift(kmh / 3.6) == pytest.approx(LAW.aerodynamic_uplift(kmh / 3.6))
    middle = LAW.aerodynamic_uplift(np.array([80.0, 160.0]) / 3.6).mean()
    assert table.aerodynamic_uplift(120 / 3.6) == pytest.approx(middle)
    assert table.aerodynamic_uplift(20 / 3.6) == pytest.approx(LAW.aerodynamic_uplift(80 / 3.6) / 4)
    assert table.nominal_force(0.0) == LAW.static_force
    assert own(aerodynamic_linear=0.1).aerodynamic_uplift(100 / 3.6) == pytest.approx(10.0 + 9.7)
    from_rest = own(uplift_over_speed=[[0.0, 3.0], [100.0, 13.0]])
    assert from_rest.aerodynamic_uplift(np.array([0.0, 50 / 3.6])) == pytest.approx([3.0, 8.0])


@pytest.mark.parametrize(
    "given", [{"uplift_over_speed": COARSE}, {"aerodynamic_linear": 0.4, "aerodynamic_coefficient": -5e-4}]
)
def test_the_plant_s_lift_is_the_pantograph_s_at_each_speed_of_train_and_air(given):
    panto = own(**given)
    task = Task(run_settings(SIMPLE | {"pantograph": panto, "speed_drift": 8.0, "line_condition": WINDY}))
    task.reset(0, np.random.default_rng(2))
    plant, step, seen = task.plant, task.plant.time_step, []
    for _ in range(6):
        task.coast(np.array([150]), task.results)
        steps = plant.of(0, Row.STEP) - 0.5
        at = plant.position(0, steps + np.array([-0.01, 0.01]))
        speed = float(np.diff(at)[0]) / (0.02 * step)
        air = speed + winds_at(plant.run.wind[0], at.mean(), steps) / step
        still, moved = (float(panto.aerodynamic_uplift(each)) for each in (speed, air))
        assert plant.of(0, Row.LIFT) == pytest.approx(panto.static_force + still, abs=1e-5)
        assert plant.of(0, Row.WIND) == pytest.approx(moved - still, abs=1e-5)
        seen.append(still)
    assert np.ptp(seen) > 1


def test_air_that_presses_down_leaves_less_to_the_wire():
    """At rest from the start, so the force is even: the lift less what the spring to the ground takes."""
    knuckle = own(aerodynamic_coefficient=-0.0006, aerodynamic_linear=0.03)
    run = simulate(**SIMPLE, pantograph=knuckle)
    expected = LAW.static_force - 0.0006 * 200**2 + 0.03 * 200
    assert run.nominal_force == pytest.approx(expected)
    np.testing.assert_allclose(run.contact_force, share() * expected, rtol=1e-6)
    with pytest.raises(InputError, match="nothing presses"):
        simulate(**SIMPLE, pantograph=own(aerodynamic_coefficient=-0.01))


@pytest.mark.parametrize("given", [{"uplift_over_speed": COARSE}, {"aerodynamic_coefficient": -0.0006}])
def test_the_static_force_is_trimmed_for_the_mean_whatever_air_does(given):
    panto = own(**given)
    run = simulate(**SIMPLE, pantograph=panto, mean_force=95.0)
    assert run.summary("all").mean == pytest.approx(95.0, abs=0.1)
    assert run.static_force == pytest.approx(run.nominal_force - panto.aerodynamic_uplift(200 / 3.6))
    assert run.nominal_force == pytest.approx(95.0 / share(), abs=0.1)


def tunnels(*each, **settings):
    through = [dict(zip(("begin", "end", "factor"), tunnel, strict=True)) for tunnel in each]
    return SIMPLE | {"catenary": line({"tunnels": through}, like=EVEN), "pantograph": LAW} | settings


def test_in_a_tunnel_no_wind_blows_and_at_a_portal_it_sets_in():
    still = simulate(**SIMPLE, pantograph=LAW)
    within = simulate(**tunnels((-100.0, 1e5, 1.0)), line_condition=WINDY)
    np.testing.assert_array_equal(within.contact_force, still.contact_force)
    task = Task(run_settings(tunnels((100.0, 300.0, 1.4), line_condition=WINDY)))
    task.reset(0, np.random.default_rng(7))
    rows, step, speed = task.plant.run.wind[0].copy(), task.plant.time_step, 200 / 3.6
    while task.plant.position(0, task.plant.of(0, Row.STEP))[0] < 340:
        task.coast(np.array([10]), task.results)
        steps = task.plant.of(0, Row.STEP) - 0.5
        x = float(task.plant.position(0, steps)[0])
        inside = np.interp(x, [90, 110, 290, 310], [0, 1, 1, 0])
        air = speed + winds_at(rows, x, steps) / step
        of_wind = LAW.aerodynamic_uplift(air) - LAW.aerodynamic_uplift(speed)
        expected = (1 - inside) * of_wind + 0.4 * inside * LAW.aerodynamic_uplift(speed)
        assert task.plant.of(0, Row.WIND) == pytest.approx(expected, abs=1e-6)


def test_a_run_that_begins_in_a_tunnel_is_at_rest_there():
    run = simulate(**tunnels((-500.0, 1e5, 1.5)))
    expected = share() * (run.nominal_force + 0.5 * LAW.aerodynamic_uplift(200 / 3.6))
    np.testing.assert_allclose(run.contact_force, expected, rtol=1e-6)


def test_a_short_tunnel_and_two_close_to_each_other_have_a_factor_everywhere():
    """Portals 20 m apart share the place half-way between them."""
    settings = tunnels((50.0, 70.0, 1.5), (90.0, 150.0, 1.5))
    places, _, excess = settings["catenary"].tunnel_rows
    assert places.tolist() == [40.0, 60.0, 80.0, 100.0, 140.0, 160.0]
    assert excess.tolist() == [0.0, 0.5, 0.0, 0.5, 0.5, 0.0]
    run = simulate(**settings | {"distance": 200.0})
    assert np.isfinite(run.contact_force).all()
    assert not run.terminated


def test_a_mean_force_is_set_in_the_open_and_an_estimator_knows_no_tunnel():
    through = line({"tunnels": [{"begin": 200.0, "end": 400.0, "factor": 1.6}]}, like="periodic-stiffness")
    settings = SIMPLE | {"pantograph": LAW, "mean_force": 95.0}
    runs = [simulate(**settings | {"catenary": each}) for each in (through, "periodic-stiffness")]
    assert runs[0].nominal_force == runs[1].nominal_force
    assert runs[0].summary("all").mean > 98
    with pytest.warns(AccuracyWarning, match="tunnels, of which no sensor knows"):
        estimated_force(runs[0], 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        estimated_force(runs[1], 0)


def test_no_gust_exceeds_the_strongest_wind():
    wind, step = Wind(12.0, 0.3), 1e-3
    for seed in range(20):
        rows = draw_wind(wind, step, np.random.default_rng(seed))
        assert np.sum(np.abs(rows[[0, *range(1, rows.size, 3)]])) / step <= wind.strongest * (1 + 1e-12)
    all_long = 12.0 + 0.3 * 12.0 * np.sqrt(2 * 0.955 * 30)  # thirty equal bands would have the largest sum
    assert 2 * 12.0 < wind.strongest < all_long


@pytest.mark.parametrize(
    ("message", "given"),
    [
        ("ends at 150 km/h, and the air comes with up to 200 km/h", {"pantograph": tabled((150,))}),
        ("ends at 220 km/h, and", {"pantograph": tabled((220,)), "line_condition": {"wind": 5.0}}),
        ("ends at 210 km/h", {"pantograph": tabled((210,)), "speed_drift": 6.0}),
        ("nor is it in a tunnel", {"catenary": line(SHORT, like="rig"), "pantograph": "dsa380"}),
        ("in which no wind blows across", {"catenary": line(SHORT, like="re250"), **ACROSS}),
    ],
)
def test_what_is_not_known_is_refused(message, given):
    with pytest.raises(InputError, match=message):
        simulate(**SIMPLE | given)


@pytest.mark.parametrize(
    ("message", "given"),
    [
        ("give either uplift_over_speed, or", {"uplift_over_speed": COARSE, "aerodynamic_linear": 0.1}),
        ("must rise from pair to pair", {"uplift_over_speed": COARSE[::-1]}),
        ("must rise from pair to pair", {"uplift_over_speed": [[0.0, 1.0]]}),
        ("aerodynamic_coefficient' must be a number from -0.01", {"aerodynamic_coefficient": -0.1}),
    ],
)
def test_a_bad_law_or_table_is_refused(message, given):
    with pytest.raises(InputError, match=message):
        own(**given)
    with pytest.raises(InputError, match="20 m or more each"):
        tunnels((0.0, 100.0, 1.5), (110.0, 200.0, 1.5))
