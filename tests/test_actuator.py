import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.actuators import actuator_settings
from panto_env.plant.actuators.lagged import LaggedActuator
from panto_env.plant.numerics import Numerics
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row

pytestmark = pytest.mark.plain

STEP = 1e-3


def response(actuator, command, steps=200):
    line, pantograph = load_catenary("periodic-stiffness"), load_pantograph("three-mass")
    plant = Plant(line, pantograph, numerics=Numerics(time_step=STEP), actuator=actuator)
    samples = plant.samples(steps + 1)
    plant.start(0, 50.0)
    plant.advance(np.array([[[command, 0.0]]]), steps, samples)
    return samples.rows[0, 1:, 0, Row.FRAME_FORCE]


def test_ideal_actuator_follows_at_once_within_its_limit():
    assert response(LaggedActuator(), 60.0, 3).tolist() == [60.0] * 3
    assert response(LaggedActuator(), 500.0, 1).tolist() == [100.0]
    assert response(LaggedActuator(), -500.0, 1).tolist() == [-100.0]


def test_delay_and_lag_are_those_of_the_closed_form():
    forces = response(LaggedActuator(delay=0.005, lag=0.015), 60.0)
    time = STEP * (np.arange(200) + 1)
    expected = 60 * (1 - np.exp(-np.maximum(time - 0.005, 0) / 0.015))
    np.testing.assert_allclose(forces, expected, atol=1e-9)


def test_rate_limit():
    forces = response(LaggedActuator(rate_limit=2500.0), 100.0)
    assert np.diff(forces, prepend=0.0).max() == pytest.approx(2.5)
    assert forces[-1] == 100.0
    assert (response(LaggedActuator(rate_limit=2500.0), -100.0) == -forces).all()


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
