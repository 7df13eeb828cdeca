"""What motors on frame and head buy (paper 2, section 4.3), and one collector on a bench (Figs 14, 15)."""

from functools import partial

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.plant.actuators import actuator_settings
from panto_env.studies.paper2 import motors

from ..motor_reference import motor_power

SPEED = 250.0


@pytest.fixture(scope="module", autouse=True)
def short():
    """Passes of twelve spans, of which four count."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(motors, "SPANS", (8, 11))
        patch.setattr(motors, "simulate", partial(simulate, distance=720.0))
        motors.without_motors.cache_clear()
        yield
    motors.without_motors.cache_clear()


@pytest.fixture(scope="module")
def passive():
    return motors.without_motors(SPEED)


@pytest.fixture(scope="module")
def by_place(passive):
    return {place: motors.motor_pass(SPEED, place, 2.0, passive.figures.mean) for place in motors.PLACES}


def recorded_power(one, place):
    """Current, voltage and watts over a whole pass, from its record; the pantograph has two masses."""
    record = one.record
    force, velocity = record.frame_force, record.frame_velocity
    if place == "head":
        force, velocity = record.head_force, record.head_velocity - record.frame_velocity
    return motor_power(actuator_settings(motors.MOTOR), force, velocity, record.time_step)


def changes(one, passive):
    return np.array(one.bands) / np.array(passive.bands) - 1


@pytest.mark.slow
def test_at_equal_power_the_head_lowers_sigma_more_than_the_frame_and_both_most(passive):
    """In medium frequencies; by how much, the study's statements say."""
    at_15_watts = {place: motors.at_power(SPEED, place, 15.0) for place in motors.PLACES}
    assert [one.power for one in at_15_watts.values()] == pytest.approx([15.0] * 3, rel=0.01)
    frame, head, both = at_15_watts["frame"], at_15_watts["head"], at_15_watts["both"]
    assert both.figures.std < head.figures.std < frame.figures.std < passive.figures.std
    assert (changes(head, passive)[1:] < changes(frame, passive)[1:] - 0.15).all()


@pytest.mark.longer
def test_at_a_limit_of_force_the_gain_of_the_least_sigma_is_taken(passive):
    best = motors.at_force_limit(SPEED, "head", 50.0, (0.25, 2.0))
    assert best.gain == 2.0
    assert best.figures.std < passive.figures.std
    assert 10.0 < best.largest_force < 50.0 * 1.25  # a driven gearbox adds friction


@pytest.mark.longer
def test_motors_that_are_off_hardly_change_the_force(passive):
    """Rotors, half a kilogram, and friction of a newton."""
    off = motors.motor_pass(SPEED, "head", 0.0, passive.figures.mean)
    assert off.figures.std == pytest.approx(passive.figures.std, rel=0.03)
    assert 0.3 < off.figures.effort < 3.0
    assert off.copper == 0.0
    assert abs(off.power) < 1e-9


@pytest.mark.longer
def test_power_is_what_the_record_tells_the_mechanical_a_fraction_of_the_electrical(by_place):
    for place in ("frame", "head"):
        one = by_place[place]
        inside, told = one.record.inside(motors.SPANS), recorded_power(one, place)
        assert told.electrical[inside].mean() == pytest.approx(one.power, rel=0.05)
        assert told.copper[inside].mean() == pytest.approx(one.copper, rel=0.05)
        mechanical, arms = one.record.mechanical_power(motors.SPANS), np.abs(told.mechanical[inside]).mean()
        assert mechanical == pytest.approx(arms, rel=0.1)  # but for the rotors
        assert 0.1 < mechanical / one.power < 0.3
    both = by_place["both"].record
    frame = np.abs(both.frame_force * both.frame_velocity)
    head = np.abs(both.head_force * (both.head_velocity - both.frame_velocity))
    mean = (frame + head)[both.inside(motors.SPANS)].mean()
    assert both.mechanical_power(motors.SPANS) == pytest.approx(mean)


@pytest.mark.longer
def test_heat_is_that_of_the_current_over_the_nominal_one(by_place):
    """Of two motors at 6 A: 21.5 W."""
    head = by_place["head"]
    assert head.heat == pytest.approx(head.copper / (2 * 0.299 * (0.181 / 30.2e-3) ** 2))
    both = by_place["both"]
    assert both.heat < 0.7 * head.heat


@pytest.mark.longer
def test_what_no_gain_reaches_is_refused():
    with pytest.raises(InputError, match=r"move the mean force by more than 1.5 %"):
        motors.at_force_limit(SPEED, "both", 100.0, (8.0,))
    with pytest.raises(InputError, match=r"Motors on the head take .* W with gains from .* never 5000 W"):
        motors.at_power(SPEED, "head", 5000.0)


@pytest.fixture(scope="module")
def bench_runs(passive):
    return {gain: motors.bench_run(passive.record, gain) for gain in (None, 0.0, 1.0, 2.0)}


@pytest.mark.longer
def test_the_bench_moves_as_the_line_does(passive, bench_runs):
    """The motion's harmonics carry most of what the contact wire does, and the collector feels them alone."""
    record, waves = passive.record, motors.motion_of_line(passive.record)
    height = record.wire[record.inside(motors.SPANS)]
    assert (waves[:, 0] ** 2).sum() / 2 == pytest.approx(height.var(), rel=0.1)
    frequency, amplitude = bench_runs[None].spectrum
    carried = waves[:, 1] * SPEED / 3.6
    near = np.abs(frequency[:, None] - carried).min(axis=1) < 0.2
    assert (amplitude[near] ** 2).sum() > 0.97 * (amplitude**2).sum()


@pytest.mark.longer
def test_without_control_the_bench_is_linear(passive, bench_runs):
    """Mass, suspension and pad: each harmonic of the force follows from that of the motion."""
    run, waves = bench_runs[None], motors.motion_of_line(passive.record)
    mass, spring, damper = 4.25, 3750.0, 10.0
    for amplitude, turns in zip(waves[:, 0], waves[:, 1] * SPEED / 3.6, strict=True):
        s = 2j * np.pi * turns
        pad, collector = motors.PAD_STIFFNESS + motors.PAD_DAMPING * s, mass * s * s + damper * s + spring
        expected = abs(pad * collector / (pad + collector)) * amplitude
        wave = np.exp(-1j * 2 * np.pi * turns * run.time)
        found = 2 * abs(np.mean((run.force - run.force.mean()) * wave))
        assert found == pytest.approx(expected, rel=0.03, abs=0.1)


@pytest.mark.longer
def test_proportional_control_reduces_the_force_of_the_collector_at_each_frequency(bench_runs):
    """Figs 14 and 15."""
    off, on = bench_runs[0.0], bench_runs[2.0]
    assert on.std < 0.45 * off.std
    assert bench_runs[1.0].std < 0.6 * off.std
    for k in (0, 3):  # Hz: 0-2 and 10-20, where the motion has most
        assert on.bands[k] < 0.5 * off.bands[k]
    assert on.force.mean() == pytest.approx(off.force.mean(), rel=0.01)
    assert np.abs(on.motor_force).max() < 50.0
    assert 2.0 < on.power < 30.0
    assert bench_runs[None].power == 0.0
