import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env.backend import kernel
from panto_env.plant.pantograph.step import contact_force

pytestmark = pytest.mark.plain


@kernel
def force_of(compliance, gap, change, damping, gap_yield, change_yield, lowest):
    return contact_force(compliance, gap, change, damping, gap_yield, change_yield, lowest)


def law(stiffness, *others):
    """The contact law with a spring of this stiffness."""
    return force_of(1 / stiffness, *others)


def test_force_is_that_of_a_spring_at_the_mean_gap():
    stiffness, gap, yields = 50e3, 2.5e-3, 5e-6
    force = law(stiffness, gap, 1e-3, 0.0, yields, 1e-5, 0.0)
    assert force == pytest.approx(stiffness * (gap - yields * force))


def test_damper_adds_its_rate():
    force = law(50e3, 2.5e-3, 1e-3, 1e4, 0.0, 0.0, 0.0)
    assert force == pytest.approx(50e3 * 2.5e-3 + 1e4 * 1e-3)


def test_spring_and_damper_give_way_to_the_force_each_by_its_own():
    stiffness, gap, change, damping, yields, compliance = 30e3, 2.5e-3, 1e-3, 4e4, 4e-6, 1e-5
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
