"""The rig's computer as a program, its stability from two sides, and the command ``panto rig``."""

import json
import math

import numpy as np
import pytest

from panto_env import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.cli import make_app
from panto_env.plant.catenary.rig.step import RigRow
from panto_env.plant.numerics import Runs
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train
from panto_env.rig import RigComputer
from panto_env.rig import margins as growth
from panto_env.rig.computer import Timing, against_the_clock, compare
from panto_env.rig.margins import Loop, analog_response, dynamic_stiffness, is_stable, margins_of, threshold

PANTOGRAPH, SPEED = load_pantograph("own-two-mass"), 250.0


def force(k):
    return 120 + 30 * math.sin(0.02 * k)


def step_often(computer, force, count):
    for k in range(count):
        computer.step(force(k))


# --- the computer --------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_computer_computes_what_the_simulated_rig_does():
    """A simulated rig's readings, given to the program by itself: the same heights of the contact point."""
    data = load_catenary("rig-flexible")
    plant = Plant(data, Train.of(PANTOGRAPH), runs=Runs((SPEED / 3.6, SPEED / 3.6), data.computer.interval))
    plant.start(0, SPEED / 3.6)
    simulated, steps = plant.model.wire.table[0], plant.model.line.interval_steps
    computer = RigComputer(data, SPEED, force=PANTOGRAPH.nominal_force(SPEED / 3.6))
    own = computer._own
    own[RigRow.STEPS] = steps  # the simulated one takes its first sample at the end of an interval
    samples = plant.samples(1)
    for _ in range(300):
        plant.advance_passively(steps, samples)
        computer.step(simulated[RigRow.READING])
        assert own[RigRow.TARGET] == pytest.approx(simulated[RigRow.TARGET], rel=1e-12, abs=1e-15)
    assert own[RigRow.TARGET] != 0


@pytest.mark.longer
@pytest.mark.parametrize("name", ["rig", "rig-flexible"])
def test_a_run_can_be_repeated_and_ends_with_a_sentence(name):
    computer = RigComputer(name, SPEED, force=120.0, spans=3)
    first = [computer.step(force(k)) for k in range(500)]
    assert np.ptp(first) > 0.01
    computer.reset()
    assert computer.position == 0
    assert [computer.step(force(k)) for k in range(500)] == first
    computer.reset()
    with pytest.raises(InputError, match="at the end of the line"):
        step_often(computer, force, 4000)
    assert computer.ended


@pytest.mark.longer
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((math.nan,), "the load cell's range"),
        ((1200.0,), "range of ±1000 N, not at 1200 N"),
        ((120.0, math.nan), "displacement must be a number"),
    ],
)
def test_what_no_sensor_says_is_refused_and_changes_nothing(arguments, said):
    computer, other = (RigComputer("rig", SPEED, force=120.0) for _ in range(2))
    for k in range(50):
        assert computer.step(force(k)) == other.step(force(k))
    with pytest.raises(InputError, match=said) as caught:
        computer.step(*arguments)
    assert str(caught.value).count(". ") == 0
    assert computer.step(100.0) == other.step(100.0)


@pytest.mark.longer
def test_a_computed_line_that_leaves_its_range_is_said():
    computer = RigComputer("rig-flexible", SPEED, force=120.0)
    with pytest.raises(InputError, match="computed line left its valid range"):
        step_often(computer, lambda _: 950.0, 5000)


def test_a_line_is_no_rig():
    with pytest.raises(InputError, match="'en50318-2002' is a line"):
        RigComputer("en50318-2002", SPEED, force=120.0)
    with pytest.raises(InputError, match="below the wave speed"):
        RigComputer("rig-flexible", 500.0, force=120.0)


@pytest.mark.longer
def test_every_step_is_timed_and_the_late_ones_are_missed():
    computer = RigComputer("rig", SPEED, force=120.0)
    words = r"must run for \S+ s or longer, a step of its own, not for 1e-308 s\.$"
    with pytest.raises(InputError, match=words):
        against_the_clock(computer, 1e-308)
    timing = against_the_clock(computer, 0.05)
    assert len(timing.steps) == len(timing.late) == 50
    assert (timing.steps > 0).all()
    assert (timing.late >= 0).all()
    made = Timing(1e-3, np.array([1e-5, 9e-4, 1.1e-3, 1e-5]), np.array([0, 2e-4, 0, 0.0]))
    assert (made.missed, made.of_step(1.0)) == (2, 1.1e-3)
    assert made.headroom == pytest.approx(1e-3 / 4.55e-4)


# --- stability -----------------------------------------------------------------------------------


def test_margins_are_those_of_a_loop_known_in_closed_form():
    """An integrator with a delay: k exp(-s tau) / s."""
    frequency = np.linspace(0.2, 200, 40000)
    s = 2j * np.pi * frequency
    gain, delay = 60.0, 8e-3
    loop = gain * np.exp(-s * delay) / s
    found = margins_of(frequency, loop)
    assert found.phase == pytest.approx(90 - np.degrees(gain * delay), abs=0.1)
    assert found.delay == pytest.approx((np.pi / 2) / gain - delay, rel=1e-3)
    assert found.frequency == pytest.approx(gain / (2 * np.pi), rel=1e-3)
    assert found.gain == pytest.approx(np.pi / (2 * delay) / gain, rel=1e-2)
    largest = np.pi / 2 / delay
    assert [is_stable(k * largest * np.exp(-s * delay) / s) for k in (0.95, 1.05)] == [True, False]
    found = threshold(lambda k: is_stable(k * np.exp(-s * delay) / s), 1000, 10)
    assert found == pytest.approx(largest, rel=0.02)


def test_the_pantograph_pushes_back_as_its_chain_of_masses_does():
    masses, springs, dampers = PANTOGRAPH.masses, PANTOGRAPH.stiffnesses, PANTOGRAPH.dampings
    for frequency in (0.01, 1.0, 7.0, 30.0):
        s = 2j * math.pi * frequency
        frame = masses[1] * s**2 + dampers[1] * s + springs[1]
        link = dampers[0] * s + springs[0]
        head = masses[0] * s**2 + 1 / (1 / link + 1 / frame)
        whole = 1 / (1 / PANTOGRAPH.contact_stiffness + 1 / head)
        assert dynamic_stiffness(PANTOGRAPH, np.array([frequency]))[0] == pytest.approx(whole, rel=1e-9)


def test_an_uncompensated_mass_is_in_the_loop():
    rig = load_catenary("rig")
    heavier = growth.with_values(rig, {"load_cell": {"compensated_mass": 0.0}})
    f = np.array([30.0])
    change = analog_response(heavier, PANTOGRAPH, f) / analog_response(rig, PANTOGRAPH, f)
    force = dynamic_stiffness(PANTOGRAPH, f, 1 / rig.cylinder.stiffness)
    assert change[0] == pytest.approx(1 + 1.5 * (2j * np.pi * 30) ** 2 / force[0])


@pytest.mark.longer
@pytest.mark.parametrize("name", ["rig", pytest.param("rig-flexible", marks=pytest.mark.slow)])
def test_frequency_response_and_simulation_agree_on_the_delay_that_is_borne(name, monkeypatch):
    if name == "rig":  # it has no droppers, between which a loop would be worst
        monkeypatch.setattr(growth, "PLACES", 12)
    rig = load_catenary(name)
    delay = Loop(rig, PANTOGRAPH, SPEED).margins().delay
    assert 0.005 < delay < 0.01

    def with_more(extra):
        later = {"delay": rig.computer.delay + extra, "assumed_delay": rig.computer.delay}
        return growth.with_values(rig, {"computer": later})

    assert growth.grows_not(with_more(0.9 * delay), PANTOGRAPH, SPEED)
    assert not growth.grows_not(with_more(1.1 * delay), PANTOGRAPH, SPEED)


@pytest.mark.slow
def test_frequency_response_and_simulation_agree_on_the_slowest_cylinder():
    rig = load_catenary("rig-flexible")
    linear = growth.slowest_cylinder(rig, Loop(rig, PANTOGRAPH, SPEED).stable)
    simulated = growth.slowest_cylinder(rig, lambda slower: growth.grows_not(slower, PANTOGRAPH, SPEED), 0.02)
    assert simulated == pytest.approx(linear, rel=0.2)


# --- beside the line -----------------------------------------------------------------------------


@pytest.mark.longer
def test_the_flexible_line_on_a_rig_is_followed_and_three_spans_without_droppers_are_not():
    line = "en50318-2002"
    rigs = {name: load_catenary(name) for name in ("rig", "rig-flexible")}
    pairs = {name: compare(data, line, PANTOGRAPH, SPEED) for name, data in rigs.items()}
    errors = {name: [band.error for band in pair.bands()] for name, pair in pairs.items()}
    assert max(errors["rig-flexible"][:4]) < 0.05  # to 20 Hz
    assert pairs["rig-flexible"].followed() >= 15
    assert min(errors["rig"]) > 0.2
    bands = pairs["rig"].bands(edges=[(10.0, 12.5)])
    assert bands[0].rig < 0.5 * bands[0].reference  # the passing of the droppers is lost
    short = growth.with_values(rigs["rig"], {"cylinder": {"stroke": 0.02}})
    with pytest.raises(InputError, match="has nothing to compare"):
        compare(short, line, PANTOGRAPH, SPEED)


@pytest.mark.slow
def test_the_command_prints_tables_draws_a_picture_and_gives_json(capsys, tmp_path):
    picture = tmp_path / "rig.png"
    make_app()(["rig", "rig-flexible", "--clock", "0.1", "--plot", str(picture)], standalone_mode=False)
    printed = capsys.readouterr().out
    assert "rig-flexible follows the force on en50318-2002 within 10 % to" in printed
    assert "missed deadlines" in printed
    assert picture.stat().st_size > 10_000
    make_app()(["rig", "rig", "--json"], standalone_mode=False)
    (found,) = json.loads(capsys.readouterr().out)
    assert found["rig"] == "rig"
    assert found["bands"]["contact_force"][0]["error"] > 0.1
    with pytest.raises(InputError, match="is a line and not a rig"):
        make_app()(["rig", "en50318-2002"], standalone_mode=False)
