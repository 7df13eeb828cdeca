import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.actuators import actuator_settings
from panto_env.plant.actuators.lagged import LaggedActuator
from panto_env.plant.numerics import Numerics
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

pytestmark = pytest.mark.plain

STEP = 1e-3


def response(actuator, command, steps=200, step=STEP):
    line, pantograph = load_catenary("periodic-stiffness"), load_pantograph("three-mass")
    plant = Plant(line, Train.of(pantograph, actuator=actuator), numerics=Numerics(time_step=step))
    samples = plant.samples(steps + 1)
    plant.start(0, 50.0)
    plant.advance(np.array([[[command, 0.0]]]), steps, samples)
    return samples.rows[0, 1:, 0, Row.FRAME_FORCE]


def test_ideal_actuator_follows_at_once_within_its_limit():
    assert response(LaggedActuator(), 60.0, 3).tolist() == [60.0] * 3
    assert response(LaggedActuator(), 500.0, 1).tolist() == [100.0]
    assert response(LaggedActuator(), -500.0, 1).tolist() == [-100.0]


def rises(time):
    """Share of a step of command that a lag of 15 ms has followed."""
    return 1 - np.exp(-np.maximum(time, 0) / 0.015)


@pytest.mark.parametrize("delay", [0.0, 0.005, 0.0052, 0.0004, 0.00575])
def test_force_is_the_mean_over_the_step_of_the_closed_form_s(delay):
    """Whole steps of delay and parts of one: with a part the command's mean over the step counts."""
    forces = response(LaggedActuator(delay=delay, lag=0.015), 60.0)
    fine = STEP / 100 * (np.arange(20000) + 0.5)
    expected = 60 * rises(fine - delay).reshape(200, 100).mean(axis=1)
    whole = round(delay / STEP) == pytest.approx(delay / STEP)
    np.testing.assert_allclose(forces, expected, atol=1e-3 if whole else 0.6)  # N; a step changes 4 N
    np.testing.assert_allclose(forces[20:], expected[20:], atol=2e-2)


def test_a_delay_without_a_lag_shifts_the_command_by_itself():
    forces = response(LaggedActuator(delay=0.00325), 60.0, 6)
    assert forces == pytest.approx([0.0, 0.0, 0.0, 45.0, 60.0, 60.0])


@pytest.mark.parametrize("step", [1e-3, 2e-3, 2.5e-3])
def test_the_impulse_of_a_command_does_not_depend_on_the_step(step):
    """A delay of 5 ms is 5 ms, also where the step is 2 ms."""
    forces = response(LaggedActuator(delay=0.005, lag=0.015), 60.0, round(0.1 / step), step)
    assert step * forces.sum() == pytest.approx(60 * (0.095 - 0.015 * rises(0.095)), rel=5e-4)


def test_a_step_that_the_rate_alone_limits_counts_as_half_gone_with_a_lag_too():
    forces = response(LaggedActuator(lag=0.015, rate_limit=2500.0), 100.0, 10)
    assert forces == pytest.approx(2.5 * (np.arange(10) + 0.5))


def test_rate_limit():
    """A ramp, whose mean over a step is that at its middle."""
    forces = response(LaggedActuator(rate_limit=2500.0), 100.0)
    assert forces[:40] == pytest.approx(2.5 * (np.arange(40) + 0.5))
    assert (forces[40:] == 100.0).all()
    assert (response(LaggedActuator(rate_limit=2500.0), -100.0) == -forces).all()


def test_a_ramp_that_ends_within_a_step_counts_as_its_mean():
    """51 N at 2.5 N a step: in the 21st step 1 N is gone in 0.4 of it."""
    forces = response(LaggedActuator(rate_limit=2500.0), 51.0, 22)
    assert forces[20:] == pytest.approx([50.0 + 1.0 * (1 - 0.2), 51.0])


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


def test_steady_frame_force_adds_to_the_mean_contact_force():
    passive = simulate("periodic-stiffness", "three-mass", 200)
    pushed = simulate("periodic-stiffness", "three-mass", 200, Constant(), actuator={"force_limit": 20.0})
    gain = pushed.contact_force[1200:].mean() - passive.contact_force[1200:].mean()
    assert gain == pytest.approx(20.0, rel=0.05)
    assert pushed.frame_force.max() == 20.0
    assert pushed.head_force.max() == 0.0


def test_head_and_both_places_reach_the_plant():
    head = simulate("periodic-stiffness", "three-mass", 200, Constant(), actuator={"place": "head"})
    assert head.frame_force.max() == 0.0
    assert head.head_force.min() == 100.0
    both = simulate("periodic-stiffness", "three-mass", 200, Constant(), actuator={"place": "both"})
    assert both.frame_force.min() == both.head_force.min() == 100.0
