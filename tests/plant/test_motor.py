"""Motors against their continuous equations, closed forms, and what energy allows."""

import math

import numpy as np
import pytest

from panto_env import InputError
from panto_env.backend import python_function
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.actuators import ACTUATOR_PRESETS, actuator_settings
from panto_env.plant.actuators.motor import MotorActuator
from panto_env.plant.actuators.motor.step import MotorRow, age, decay
from panto_env.plant.line_condition import DrawnLine, LineCondition
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.pantograph.schema import matrices
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

from ..lanes import check_lanes_are_singles
from ..motor_reference import Rig

pytestmark = pytest.mark.plain

SPEED = 50.0  # m/s
SMOOTH = {"gear_efficiency": 1.0, "friction_torque": 0.0}
HOLDING = 4000.0  # N/m, between the mass and the wire


class Bench:
    """The plant with one mass under a wire that is a spring, whose height is a cosine."""

    def __init__(
        self, motor, mass=4.0, stiffness=3500.0, damping=30.0, amplitude=0.0, frequency=1.0, step=5e-4
    ):
        spring = {"mean_stiffness": HOLDING, "stiffness_variation": 0.0}
        line = load_catenary("periodic-stiffness").model_copy(update=spring)
        chain = {"masses": (mass,), "stiffnesses": (stiffness,), "dampings": (damping,)}
        unlifted = {"static_force": 0.0, "aerodynamic_coefficient": 0.0}
        train = Train.of(load_pantograph("three-mass").model_copy(update=chain | unlifted), actuator=motor)
        condition = LineCondition(wear_depth=1e-3, wear_wavelength=100.0)  # room for one wave
        numerics, runs = Numerics(time_step=step), Runs(conditions=(condition,))
        self.plant = Plant(line, train, numerics=numerics, runs=runs, bilateral=True)
        self.motor, self.step, self.per_ampere = motor, step, motor.force_of(motor.torque_constant)
        wave = np.array([[amplitude, frequency / SPEED, 0.0]])
        self.plant.start(0, SPEED, [DrawnLine(condition, wave)])

        def wire(t):
            return amplitude * math.cos(2 * math.pi * frequency * t)

        self.rig = Rig(motor, mass, stiffness, damping, HOLDING, wire)

    def state(self):
        return self.plant.run.table[0, 0, Row.STATE : Row.STATE + 2].copy()

    def run(self, forces, interval):
        """Height, speed, current of each motor, and force, after each time step."""
        rows, place = [], len(MotorRow)  # where those of the motors on the head begin
        samples = self.plant.samples(1)
        for force in forces:
            for _ in range(round(interval / self.step)):
                self.plant.advance(np.array([[[0.0, force]]]), 1, samples)
                current = self.plant.actuators.table[0, 0, place] / self.per_ampere
                rows.append([*self.state(), current, self.plant.of(0, Row.HEAD_FORCE)])
        return np.array(rows)

    def reference(self, forces, interval, integrator=False):
        self.rig.integrator = integrator
        return self.rig.run(forces, interval, self.step, [self.state()[0], 0.0, 0.0, 0.0])


def both(bench, forces, interval, integrator=False):
    reference = bench.reference(forces, interval, integrator)
    return bench.run(forces, interval), reference


TAPE = np.random.default_rng(0).uniform(-90, 90, 20)  # N, each for 10 ms
LOCKED = {"mass": 200.0, "stiffness": 1e7, "damping": 1e5}
MOVING = {"amplitude": 0.02, "frequency": 3.0}


# --- against the continuous equations, integrated by SciPy -------------------------------------------


@pytest.mark.longer
def test_a_step_of_the_command_with_the_arm_locked_is_the_pi_loop_s():
    """And that is a first-order lag of the loop's bandwidth."""
    bench = Bench(MotorActuator(**SMOOTH), **LOCKED, step=1e-4)
    ours, reference = both(bench, [60.0, -80.0], 2e-3, integrator=True)
    np.testing.assert_allclose(ours[:, 2], reference[:, 2], atol=2e-4)  # A, of 10 A
    expected = 60.0 * (1 - np.exp(-2e3 * math.pi * 1e-4 * np.arange(1, 21)))
    np.testing.assert_allclose(bench.per_ampere * ours[:20, 2], expected, rtol=1e-5)


@pytest.mark.longer
def test_the_force_is_the_mean_over_the_step_of_the_continuous_one():
    """In a step of eight time constants of the loop, and where the voltage is at its limit."""
    for changes in ({}, {"voltage": 3.0, "inductance": 2e-3, "bandwidth": 60.0}):
        motor = MotorActuator(**SMOOTH, **changes)
        bench = Bench(motor, **LOCKED, step=1.25e-3)
        coarse = bench.run([90.0, -60.0], 10e-3)[:, 3]
        fine = Bench(motor, **LOCKED, step=1.25e-5)
        current = np.concatenate([[0.0], fine.reference([90.0, -60.0], 10e-3)[:, 2]])
        means = (0.5 * (current[1:] + current[:-1])).reshape(16, 100).mean(axis=1)
        np.testing.assert_allclose(coarse, bench.per_ampere * means, atol=0.02)  # N
        heat = motor.motors * motor.resistance * 1.25e-5 * np.sum(current**2)  # J
        assert bench.plant.actuators.energy(0)[1, 1] == pytest.approx(heat, rel=2e-3)


@pytest.mark.longer
@pytest.mark.parametrize(
    ("name", "changes", "tolerance"),
    [
        ("moving", SMOOTH, 1e-3),
        ("moving and turning heavy rotors", SMOOTH | {"gear_ratio": 120.0, "force_limit": 90.0}, 1e-3),
        ("short of voltage", SMOOTH | {"voltage": 5.0}, 1e-3),
        ("at the largest speed", SMOOTH | {"largest_speed": 20.0}, 0.015),
        ("at the largest torque", SMOOTH | {"peak_torque": 0.2, "force_limit": 50.0}, 1e-3),
        ("with friction", {}, 0.012),
        ("with backlash", {"backlash": 0.014}, 0.15),
    ],
)
def test_motion_and_current_are_those_of_the_continuous_equations(name, changes, tolerance):
    """With an arm that the wire moves as a sine and the motors by a random tape."""
    errors = []
    for step in (1e-3, 5e-4):
        bench = Bench(MotorActuator(**changes), **MOVING, step=step)
        ours, reference = both(bench, TAPE, 0.01)
        errors.append(np.abs(ours[:, 1] - reference[:, 1]).max() / np.abs(reference[:, 1]).max())
        if name != "at the largest speed":  # there the current falls steeply with the speed
            # The voltage limit sees the speed that the step is expected to have.
            np.testing.assert_allclose(ours[:, 2], reference[:, 2], atol=0.2)  # A, of 11 A
    assert errors[0] < tolerance
    smooth = tolerance == 1e-3
    assert errors[1] < (0.35 if smooth else 0.75 if name != "at the largest speed" else 1.1) * errors[0]


def longest(true):
    """Most samples in a row that are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(int)))
    return int((edges[1::2] - edges[::2]).max())


@pytest.mark.longer
def test_a_motor_that_turns_back_crosses_its_play_as_long_as_the_continuous_one():
    """No force reaches the head meanwhile; the teeth on the other side then take it over."""
    motor = MotorActuator(**SMOOTH, backlash=0.014)
    bench = Bench(motor, **LOCKED, step=1e-4)
    ours, reference = both(bench, [50.0, -50.0], 0.2)
    ahead = reference[:, 4] / motor.shaft_per_metre - reference[:, 0]  # m
    play = 0.5 * motor.backlash * motor.arm_length
    for half in (slice(0, 2000), slice(2000, 4000)):
        crossing = longest(ours[half, 3] == 0.0)
        assert crossing > 40
        assert crossing == pytest.approx(longest(np.abs(ahead[half]) < play), abs=2.5)  # steps
    teeth = motor.motors * motor.gear_stiffness / motor.arm_length**2
    assert ours[-1, 3] == pytest.approx(-50.0, abs=0.2)
    assert ahead[-1] == pytest.approx(-play - 50 / teeth, abs=1e-5)
    gap = bench.plant.actuators.table[0, 0, len(MotorRow) + MotorRow.GAP]
    assert gap == pytest.approx(ahead[-1], abs=1e-5)


# --- closed forms ---------------------------------------------------------------------------------


def test_rotors_are_a_mass_between_the_ends():
    motor, data = MotorActuator(place="both", **SMOOTH), load_pantograph("own-motor-head")
    mass = motor.motors * (26 / 0.2) ** 2 * (142e-7 + 9.1e-7)
    assert motor.reflected_masses == pytest.approx((mass, mass))
    assert MotorActuator(backlash=0.01).reflected_masses == (0.0, 0.0)
    a, b = matrices(data, motor.reflected_masses)
    (m1, m2), x = data.masses, np.array([0.01, -0.02, 0.3, 0.1])
    force = np.array([7.0, 5.0, 3.0])
    # d'Alembert: each mass under springs, dampers, forces, and rotors that resist.
    apart, base = np.diff((a @ x + b @ force)[2:])[0], (a @ x + b @ force)[3]
    (k1, k2), (c1, c2) = data.stiffnesses, data.dampings
    inner = k1 * (x[0] - x[1]) + c1 * (x[2] - x[3])
    head = -force[0] + force[2] - inner + mass * apart
    frame = force[1] - force[2] + inner - k2 * x[1] - c2 * x[3] - mass * apart - mass * base
    np.testing.assert_allclose((a @ x + b @ force)[2:], [head / m1, frame / m2])


@pytest.mark.longer
@pytest.mark.parametrize("ratio", [26.0, 400.0])
def test_rotors_slow_a_mass_and_take_no_energy(ratio):
    """Also where they are thirty times the mass: an explicit inertia force would grow at once."""
    motor = MotorActuator(**SMOOTH, gear_ratio=ratio)
    bench = Bench(motor, damping=0.0, amplitude=0.02, frequency=1e-6, step=1e-3)
    bench.plant.run.waves[:] = 0.0  # the wire drops back: the mass swings from here
    height = bench.run([0.0] * 400, 1e-3)[:, :2]
    stiffness, mass = 3500.0 + HOLDING, 4.0 + motor.reflected_mass
    energy = 0.5 * stiffness * height[:, 0] ** 2 + 0.5 * mass * height[:, 1] ** 2
    assert np.ptp(energy) < 0.01 * energy[0]
    start = 0.02 * HOLDING / stiffness
    expected = start * np.cos(math.sqrt(stiffness / mass) * 1e-3 * np.arange(1, 401))
    np.testing.assert_allclose(height[:, 0], expected, atol=0.02 * start)


@pytest.mark.longer
@pytest.mark.parametrize("backlash", [0.0, 0.03])
@pytest.mark.parametrize("inductance", [1e-5, 1e-2])
def test_light_rotors_with_a_strong_back_emf_are_stable(backlash, inductance):
    """Their mechanical time constant, R J / k_t^2, is a ten-thousandth of the time step."""
    light = {"torque_constant": 6.0, "resistance": 0.02, "rotor_inertia": 6e-4, "gear_inertia": 0.0}
    drive = {"bandwidth": 2000.0, "voltage": 6.0, "peak_torque": 0.5, "force_limit": 30.0, "gear_ratio": 12.0}
    motor = MotorActuator(**light, **drive, inductance=inductance, backlash=backlash)
    bench = Bench(motor, amplitude=0.02, frequency=3.0, step=5e-3)
    rows = bench.run(np.random.default_rng(2).uniform(-30, 30, 200), 0.01)
    assert np.abs(rows[:, 0]).max() < 0.03  # m; the wire moves by 0.02
    assert motor.motors * 0.5 * inductance * rows[-1, 2] ** 2 < 10.0  # J


@pytest.mark.longer
def test_efficiency_is_what_a_motor_passes_on_and_a_load_has_to_overcome_more():
    """Lifted and lowered at a steady speed by a slow wave of the wire, the motors press 60 N."""
    motor = MotorActuator(gear_efficiency=0.8)
    lost = motor.force_of(motor.friction_torque) + 0.2 * 60
    for sense in (1, -1):
        bench = Bench(motor, amplitude=-0.5 * sense, frequency=0.5, step=1e-3)
        rows = bench.run([60.0] * 60, 0.01)[400:, :]
        assert (sense * rows[:, 1] > 0.05).all()
        assert rows[:, 3] == pytest.approx(60 - sense * lost, abs=0.8)


@pytest.mark.longer
def test_friction_holds_what_it_can():
    bench = Bench(MotorActuator(), damping=0.0)
    at_rest = bench.run([0.8] * 20, 0.01)  # dry friction is 1.07 N
    assert np.abs(at_rest[:, 0]).max() < 1e-15  # m
    assert np.abs(at_rest[:, 3]).max() < 1e-6  # N
    assert np.abs(bench.run([3.0] * 20, 0.01)[:, 0]).max() > 1e-4


@pytest.mark.longer
def test_a_winding_that_gets_hot_is_held_to_its_continuous_force():
    motor = MotorActuator(thermal_time=0.5)
    bench = Bench(motor, **LOCKED, step=1e-3)
    force = bench.per_ampere * bench.run([100.0] * 400, 0.01)[:, 2]
    assert force[100] == pytest.approx(100.0)
    assert force[-1] == pytest.approx(motor.continuous_force, rel=1e-3)
    heat = np.convolve(force**2, 1e-3 / 0.5 * np.exp(-1e-3 / 0.5 * np.arange(4000)))[: len(force)]
    assert math.sqrt(heat.max()) < 1.001 * motor.continuous_force
    assert (np.diff(force[150:]) < 1e-9).all()  # it goes back without switching


# --- energy -----------------------------------------------------------------------------------


@pytest.mark.longer
@pytest.mark.parametrize("changes", [SMOOTH, {}], ids=["smooth", "with friction"])
def test_what_the_supply_gives_is_heat_work_and_what_rotors_and_armatures_hold(changes):
    """Over a second of sine and tape. Friction takes energy out: what is left is positive."""
    motor, forces = MotorActuator(**changes), np.random.default_rng(1).uniform(-80, 80, 100)
    bench = Bench(motor, **MOVING)
    true = bench.reference(forces, 0.01)[:, 2]
    speed = np.append(bench.state()[1], (rows := bench.run(forces, 0.01))[:, 1])
    work = 5e-4 * rows[:, 3] @ (0.5 * (speed[1:] + speed[:-1]))
    held = 0.5 * motor.motors * motor.inductance * rows[-1, 2] ** 2
    supplied, copper = bench.plant.actuators.energy(0)[1]
    if changes:
        assert supplied == pytest.approx(copper + work + held, rel=1e-3)
        heat = motor.motors * motor.resistance * np.sum(true**2) * 5e-4
        assert copper == pytest.approx(heat, rel=0.02)
    else:
        assert supplied - copper - work > 0.5  # J


# --- lanes ------------------------------------------------------------------------------------


@pytest.mark.longer
def test_lanes_of_a_batch_are_single_environments():
    """With motors at both places, and pantographs that differ."""
    actuator = {"kind": "motor", "place": "both", "backlash": 0.014}
    settings = {"actuator": actuator, "pantograph_scatter": 0.1, "distance": 30.0}
    check_lanes_are_singles("PantographStiffness-v0", settings, steps=20, actions=2)


# --- settings ---------------------------------------------------------------------------------


def test_the_preset_s_force_at_the_head():
    motor = ACTUATOR_PRESETS["head-motor"]
    assert motor.places == actuator_settings("head-motor:backlash=0.014").places
    assert motor.force_of(motor.torque_constant) == pytest.approx(2 * 26 / 0.2 * 30.2e-3)
    assert motor.peak_force == pytest.approx(137.8)
    assert motor.continuous_force == pytest.approx(47.06)
    assert motor.arrays(1e-3, 1, 1).stall_force == pytest.approx(630.3, rel=1e-3)
    assert motor.shorted_damping == pytest.approx(103.1, rel=1e-3)
    assert motor.reflected_mass == pytest.approx(0.511, rel=1e-3)
    # K_t^2 / (R J): the mechanical time constant that the data sheet has, 4.7 ms.
    alone = motor.model_copy(update={"gear_inertia": 0.0})
    assert alone.reflected_mass / alone.shorted_damping == pytest.approx(4.66e-3, rel=0.01)


REFUSED = {
    "force_limit=200": "force_limit must not exceed 137.8 N, which the motors have at their peak_torque",
    "continuous_torque=0.6": "continuous_torque must not exceed peak_torque, 0.53 N m: it is 0.6 N m",
    "bandwidth=500": "bandwidth must be at least 607.1 Hz, slightly above the armature's own",
}


@pytest.mark.parametrize("changes", REFUSED)
def test_motors_that_cannot_be_so_are_refused(changes):
    with pytest.raises(InputError, match=f"actuator is not valid: .*{REFUSED[changes]}"):
        actuator_settings(f"head-motor:{changes}")


@pytest.mark.parametrize("halvings", [2, 6])
def test_decay_is_the_exponential_and_age_its_inverse(halvings):
    """To the order of their series, up to the argument that so many halvings are for."""
    for x in np.linspace(1e-3, 0.25 * 2**halvings, 50).tolist():
        assert python_function(decay)(x, halvings) == pytest.approx(math.exp(-x), rel=2e-6 * 2**halvings)
        assert python_function(age)(math.exp(-x), halvings) == pytest.approx(x, rel=1e-10)
