import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.actuators import actuator_settings
from panto_env.plant.numerics import Numerics
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

pytestmark = pytest.mark.plain

STEP = 1e-3
RAMP = 2.5 * (np.arange(40) + 0.5)
"""Means over the steps of a force that grows by 2500 N/s (N)."""


def response(settings, command, steps=200, step=STEP):
    line, pantograph = load_catenary("periodic-stiffness"), load_pantograph("three-mass")
    train = Train.of(pantograph, actuator=actuator_settings(settings))
    plant = Plant(line, train, numerics=Numerics(time_step=step))
    samples = plant.samples(steps + 1)
    plant.start(0, 50.0)
    plant.advance(np.array([[[command, 0.0]]]), steps, samples)
    return samples.rows[0, 1:, 0, Row.FRAME_FORCE]


@pytest.mark.parametrize(
    ("settings", "command", "expected"),
    [
        ({}, 60.0, [60.0] * 3),
        ({}, 500.0, [100.0]),
        ({}, -500.0, [-100.0]),
        ({"delay": 0.00325}, 60.0, [0.0, 0.0, 0.0, 45.0, 60.0, 60.0]),
        ({"rate_limit": 2500.0}, 100.0, [*RAMP, 100.0, 100.0]),
        ({"rate_limit": 2500.0}, -100.0, [*-RAMP, -100.0]),
        ({"rate_limit": 2500.0}, 51.0, [*RAMP[:20], 50.0 + 1.0 * (1 - 0.2), 51.0]),  # 1 N in 0.4 of a step
        ({"rate_limit": 2500.0, "lag": 0.015}, 100.0, RAMP[:10]),
    ],
)
def test_limits_delay_and_rate_are_closed_forms_whose_mean_over_the_step_counts(settings, command, expected):
    assert response(settings, command, len(expected)) == pytest.approx(expected)


def rises(time):
    """Share of a step of command that a lag of 15 ms has followed."""
    return 1 - np.exp(-np.maximum(time, 0) / 0.015)


@pytest.mark.parametrize("delay", [0.0, 0.005, 0.0052, 0.0004, 0.00575])
def test_force_is_the_mean_over_the_step_of_the_closed_form_s(delay):
    """Whole steps of delay and parts of one: with a part the command's mean over the step counts."""
    forces = response({"delay": delay, "lag": 0.015}, 60.0)
    fine = STEP / 100 * (np.arange(20000) + 0.5)
    expected = 60 * rises(fine - delay).reshape(200, 100).mean(axis=1)
    whole = round(delay / STEP) == pytest.approx(delay / STEP)
    np.testing.assert_allclose(forces, expected, atol=1e-3 if whole else 0.6)  # N; a step changes 4 N
    np.testing.assert_allclose(forces[20:], expected[20:], atol=2e-2)


@pytest.mark.parametrize("step", [1e-3, 2e-3])
def test_the_impulse_of_a_command_does_not_depend_on_the_step(step):
    """A delay of 5 ms is 5 ms, also where the step is 2 ms."""
    forces = response({"delay": 0.005, "lag": 0.015}, 60.0, round(0.1 / step), step)
    assert step * forces.sum() == pytest.approx(60 * (0.095 - 0.015 * rises(0.095)), rel=5e-4)


def test_presets_and_errors():
    assert actuator_settings("realistic").delay == 0.005
    with pytest.raises(InputError, match=r"actuator is not valid: key 'lag'"):
        actuator_settings({"lag": -1})
    with pytest.raises(InputError, match="actuator must be 'ideal' or 'realistic'"):
        actuator_settings("perfect")


class Constant:
    """Pushes with all its force."""

    def reset(self, context):
        self.actions = context.actions

    def act(self, observation):
        return np.ones(self.actions)


def pushed(policy=None, **settings):
    return simulate("periodic-stiffness", "three-mass", 200, policy, **settings)


def test_steady_frame_force_adds_to_the_mean_contact_force():
    passive, run = pushed(), pushed(Constant(), actuator={"force_limit": 20.0})
    gain = run.contact_force[1200:].mean() - passive.contact_force[1200:].mean()
    assert gain == pytest.approx(20.0, rel=0.05)
    assert (run.frame_force.max(), run.head_force.max()) == (20.0, 0.0)


@pytest.mark.parametrize(("place", "frame"), [("head", 0.0), ("both", 100.0)])
def test_head_and_both_places_reach_the_plant(place, frame):
    run = pushed(Constant(), actuator={"place": place}, distance=60.0)
    assert (run.frame_force == frame).all()
    assert run.head_force.min() == 100.0
