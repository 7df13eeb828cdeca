"""A sample is the mean over its time step: compared with the pantograph's motion alone and the contact."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train

from ..pantograph_alone import means, replay, rest

LINE, PANTOGRAPH = load_catenary("periodic-stiffness"), load_pantograph("three-mass")
SPEED_KMH = 300.0


class Shaking:
    """Pushes frame and head independently of each other and of what it sees."""

    def reset(self, context):
        self.random = np.random.default_rng(0)
        self.limit, self.forces = context.force_limit, []

    def act(self, observation):
        action = self.random.uniform(-1, 1, 2)
        self.forces.append(self.limit * action)
        return action


def stiffness(position):
    """k(x), Eq. 5 of paper 3 (N/m)."""
    turns = position / LINE.span_length
    return LINE.mean_stiffness * (1 + LINE.stiffness_variation * np.cos(2 * np.pi * turns))


POLICY = Shaking()


@pytest.fixture(scope="module")
def run():
    actuator = {"place": "both", "force_limit": 100.0}
    return simulate(LINE, PANTOGRAPH, SPEED_KMH, POLICY, actuator=actuator, distance=200.0)


def test_heights_and_velocities_are_means_over_the_step(run):
    n = len(PANTOGRAPH.masses)
    states = replay(run, PANTOGRAPH, rest(PANTOGRAPH, run.nominal_force, stiffness(0.0)))
    for series, place in (("head", 0), ("frame", n - 1), ("head_velocity", n), ("frame_velocity", 2 * n - 1)):
        values, ends = getattr(run, series), states[:, place]
        assert values == pytest.approx(means(ends), rel=1e-6, abs=1e-8), series
        # The tolerance tells a mean from a value at either end.
        assert np.abs(np.diff(ends)).max() > 1e-4, series


def test_actuator_forces_are_those_that_the_policy_asked_for_and_time_that_of_the_middle_of_the_step(run):
    asked = np.repeat(POLICY.forces, round(0.01 / run.time_step), axis=0)
    assert run.frame_force == pytest.approx(asked[:, 0])
    assert run.head_force == pytest.approx(asked[:, 1])
    middle = (np.arange(len(run.time)) + 0.5) * run.time_step
    assert run.time == pytest.approx(middle)
    assert run.position == pytest.approx(middle * SPEED_KMH / 3.6)


@pytest.mark.parametrize("condition", ["new", "worn"])
def test_contact_is_its_spring_at_the_mean_gap_and_its_damper(condition):
    """The line's stiffness and the strip's are in series; the gap is counted from an uneven wire.

    The spring counts the head's mean height from the wire's at mid-step, the damper what either rises.
    """
    strip, damping = 20e3, 80.0
    data = PANTOGRAPH.model_copy(update={"contact_stiffness": strip, "contact_damping": damping})
    settings = {"catenary": LINE, "pantograph": data, "line_condition": condition, "distance": 100.0}
    task = Task(run_settings(settings | {"speed_kmh": SPEED_KMH, "time_step": 2e-3}))
    task.reset(0, np.random.default_rng(3))
    task.run_passively()
    run = task.trajectory(0)
    position = SPEED_KMH / 3.6 * run.time_step * np.arange(0, len(run.time) + 0.5, 0.5)  # ends, middles
    height = np.zeros(len(position))
    if condition == "worn":  # cosines of random phase, and waves of wear from their deepest on
        turns = np.random.default_rng(3).uniform(0, 1, 3)
        waves = ((12, 1.5e-3), (5, 0.8e-3), (1.5, 0.3e-3))  # m
        for (length, amplitude), phase in zip(waves, turns, strict=True):
            height += amplitude * np.cos(2 * np.pi * (position / length + phase))
        height -= 0.25e-3 * np.cos(2 * np.pi * position / 0.8)
    springs = 1 / (1 / strip + 1 / stiffness(position))
    states = replay(run, data, rest(data, run.nominal_force, springs[0], height[0]))
    gap = means(states[:, 0]) - height[1::2]
    closing = np.diff(states[:, 0] - height[::2]) / run.time_step
    expected = springs[1::2] * gap + damping * closing
    assert run.contact_force == pytest.approx(np.maximum(expected, 0.0), rel=1e-6, abs=1e-3)
    assert run.wire == pytest.approx(height[1::2] + run.contact_force / stiffness(position[1::2]), abs=1e-9)


def test_massless_wire_goes_with_a_rigid_strip_while_it_is_pressed(run):
    """Paper 3: the head is joined to the spring k(t), which has no mass, so F = k(x) w, of mid-step."""
    assert run.wire == pytest.approx(run.contact_force / stiffness(run.position), abs=1e-12)
    pressed = run.contact_force > 0.0
    assert 0.5 < pressed.mean() < 1.0
    assert run.wire[pressed] == pytest.approx(run.head[pressed], abs=1e-12)


@pytest.mark.parametrize(
    ("catenary", "pantograph"), [("en50318-2002", "en50318-2002"), ("ohl-three-span", "three-mass")]
)
def test_head_stands_a_compressed_strip_above_a_wire_with_mass(catenary, pantograph):
    data = load_pantograph(pantograph)
    run = simulate(catenary, pantograph, 200.0, distance=100.0)
    pressed = run.contact_force > 0.0
    assert pressed.mean() > 0.99
    stiffness = 50e3 if data.contact_stiffness == "rigid" else data.contact_stiffness
    strip = run.contact_force / stiffness
    assert (run.head - run.wire)[pressed] == pytest.approx(strip[pressed], rel=1e-6, abs=1e-9)


@pytest.mark.longer
def test_a_slower_run_keeps_no_uplift_of_a_faster_one():
    """At the same time step the slower train is a span behind: the support ahead has not moved yet."""

    def uplift(plant, samples, speed, steps):
        plant.start(0, speed)
        plant.clear(samples, np.array([0]))
        plant.advance_passively(steps, samples)
        return samples.uplift[0, :, 1 : steps + 1].T.copy()

    steps, line, train = 400, load_catenary("ohl-three-span"), Train.of(load_pantograph("own-two-mass"))
    used, fresh = Plant(line, train), Plant(line, train)
    samples = used.samples(steps + 1)
    assert uplift(used, samples, 330.0 / 3.6, steps)[:, 1].max() > 0
    slower = uplift(fresh, fresh.samples(steps + 1), 100.0 / 3.6, steps)
    assert (uplift(used, samples, 100.0 / 3.6, steps) == slower).all()
