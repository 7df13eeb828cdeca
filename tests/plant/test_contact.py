"""The contact law, plain arithmetic of kernels, and what every kind of catenary promises a kernel."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env.backend import kernel, python_function
from panto_env.catalog import load_catenary
from panto_env.plant.catenary import CATENARIES
from panto_env.plant.functions import cosine_of_turns, sine_of_turns, stencil
from panto_env.plant.line_condition import DrawnLine, LineCondition
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.pantograph.step import contact_force

from .test_flexible import travel

pytestmark = pytest.mark.plain


law_of = python_function(contact_force)


def law(stiffness, *others):
    """The contact law with a spring of this stiffness."""
    return law_of(1 / stiffness, *others)


@pytest.mark.parametrize(
    ("stiffness", "damping", "yields", "compliance"),
    [(50e3, 0.0, 5e-6, 1e-5), (50e3, 1e4, 0.0, 0.0), (30e3, 4e4, 4e-6, 1e-5)],
)
def test_spring_at_the_mean_gap_and_damper_give_way_to_the_force(stiffness, damping, yields, compliance):
    gap, change = 2.5e-3, 1e-3
    force = law(stiffness, gap, change, damping, yields, compliance, 0.0)
    spring, damper = stiffness * (gap - yields * force), damping * (change - compliance * force)
    assert force == pytest.approx(spring + damper)


def test_contact_only_pushes_unless_told_otherwise():
    assert law(50e3, -1.5e-3, -1e-3, 0.0, 5e-6, 1e-5, 0.0) == 0.0
    assert law(50e3, -1.5e-3, -1e-3, 0.0, 5e-6, 1e-5, -np.inf) < 0.0


def test_mass_bouncing_on_a_spring_matches_scipy_and_keeps_its_energy():
    """A mass dropped on a spring, through the law, against SciPy's solver with events."""
    mass, stiffness, weight, step, end = 7.2, 50e3, 120.0, 1e-4, 0.3

    def rates(t, y):
        return [y[1], (weight - stiffness * max(y[0], 0.0)) / mass]

    exact = solve_ivp(rates, (0, end), [-5e-3, 0.0], rtol=1e-10, atol=1e-13, max_step=1e-3)
    z, v, energy = -5e-3, 0.0, []
    for _ in range(round(end / step)):
        free = z + v * step + weight * step**2 / (2 * mass)
        yields = step**2 / (2 * mass)
        force = law(stiffness, 0.5 * (z + free), free - z, 0.0, 0.5 * yields, yields, 0.0)
        z, v = free - yields * force, v + (weight - force) * step / mass
        energy.append(mass * v**2 / 2 + stiffness * max(z, 0.0) ** 2 / 2 - weight * z)
    assert z == pytest.approx(exact.y[0, -1], abs=3e-5)
    assert max(energy) / min(energy) - 1 < 0.02


def test_cubics_are_interpolated_exactly():
    positions, spacing = np.random.default_rng(0).uniform(1, 9, 50), 0.25
    nodes = spacing * np.arange(60)
    first, weights = stencil(positions, spacing)
    for cubic in np.polynomial.Polynomial([1, -2, 0.5, 0.1]), np.polynomial.Polynomial([0, 0, 0, 1]):
        four = cubic(nodes)[first[:, None] + np.arange(4)]
        assert (weights * four).sum(axis=1) == pytest.approx(cubic(positions))
    between = positions / spacing - first
    assert ((between >= 1) & (between < 2)).all()


@kernel
def sine_and_cosine(turns):
    return sine_of_turns(turns), cosine_of_turns(turns)


def test_turns_are_numpy_s():
    turns = np.random.default_rng(0).uniform(-3, 50, 200)
    sines, cosines = np.transpose([sine_and_cosine(each) for each in turns])
    assert sines == pytest.approx(np.sin(2 * np.pi * turns), abs=1e-13)
    assert cosines == pytest.approx(np.cos(2 * np.pi * turns), abs=1e-13)


@pytest.mark.longer
@pytest.mark.parametrize("x", [40.17, 40.5])
@pytest.mark.parametrize("name", ["en50318-2002", "ohl-three-span"])
def test_the_wire_yields_to_a_force_as_it_was_said_to(name, x):
    """The contact law solves for the force with this yield: or else gap and force would not agree."""
    data, condition = load_catenary(name), LineCondition()
    numerics = Numerics(precision="double", window=3) if data.kind == "flexible" else Numerics()
    model = CATENARIES[data.kind].model(data, lanes=1, collectors=1, spans=10, numerics=numerics, runs=Runs())
    model.settle(0, DrawnLine(condition), 150.0)
    force, seen = 90.0, np.zeros(3)
    travel(model.line, model.wire, x, 0.0, force, np.zeros(1), seen)
    assert seen[1] != 0
    assert seen[2] - seen[0] == pytest.approx(seen[1] * force, rel=1e-8)
