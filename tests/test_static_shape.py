import numpy as np
import pytest

from panto_env.catalog import available, load_catenary
from panto_env.plant.catenary.flexible import static_shape

from .finite_element import simulation as finite_element

FLEXIBLE = [name for name in available("catenary") if load_catenary(name).kind == "flexible"]


def test_dropper_lengths_of_the_2015_benchmark_within_3_mm():
    shape = static_shape.solve(load_catenary("benchmark-2015"))
    half = [1.017, 0.896, 0.810, 0.758, 0.741]
    assert shape.dropper_length == pytest.approx(half + half[-2::-1], abs=3e-3)


@pytest.mark.parametrize("name", FLEXIBLE)
def test_agrees_with_finite_elements(name):
    line = load_catenary(name)
    shape, other = static_shape.solve(line), finite_element.static_shape(line, element=0.1)
    inner = (other.x >= 0) & (other.x <= line.span_length)
    # Smooth elements round the kinks at the droppers, at first order.
    np.testing.assert_allclose(shape.contact.height(other.x[inner]), other.contact[inner], atol=2e-4)
    np.testing.assert_allclose(shape.dropper_tension, other.dropper_tension, rtol=1e-3, atol=0.2)


@pytest.mark.parametrize("name", FLEXIBLE)
def test_in_equilibrium(name):
    """Droppers and steady arm carry the contact wire's weight; tensions are positive."""
    line = load_catenary(name)
    shape = static_shape.solve(line)
    weight = line.contact_wire.mass * static_shape.GRAVITY * line.span_length
    assert shape.contact.forces.sum() == pytest.approx(weight)
    assert shape.dropper_tension.min() > 0
    sag = -np.array(line.droppers.sag)
    assert shape.contact.height(np.array(line.droppers.positions)) == pytest.approx(sag, abs=1e-9)


def test_string_hangs_in_a_parabola_between_its_droppers():
    line = load_catenary("en50318-2002")
    limp = line.contact_wire.model_copy(update={"bending_stiffness": 0.0})
    shape = static_shape.solve(line.model_copy(update={"contact_wire": limp}))
    a, b = line.droppers.positions[4:6]
    deepest = limp.mass * static_shape.GRAVITY * (b - a) ** 2 / (8 * limp.tension)
    assert shape.contact.height(np.array([(a + b) / 2]))[0] == pytest.approx(-deepest, rel=1e-6)


def test_wire_is_level_at_the_support_only_where_the_arm_holds_it():
    line = load_catenary("en50318-2002")
    free = line.model_copy(update={"steady_arm": line.steady_arm.model_copy(update={"holds_wire": False})})
    assert static_shape.solve(line).contact.height(np.zeros(1))[0] == pytest.approx(0, abs=1e-9)
    assert static_shape.solve(free).contact.height(np.zeros(1))[0] == pytest.approx(-8.0e-3, abs=1e-4)
