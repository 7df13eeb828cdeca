import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env.backend import python_function
from panto_env.plant.contact import contact_force

pytestmark = pytest.mark.plain

law = python_function(contact_force)


def test_force_is_the_mean_of_the_springs_at_both_ends_of_the_step():
    stiffness, gap_0, gap_free, compliance = 50e3, 2e-3, 3e-3, 1e-5
    force = law(stiffness, gap_0, stiffness, gap_free, 0.0, compliance, 0.0)
    gap_1 = gap_free - compliance * force
    assert force == pytest.approx(stiffness * (gap_0 + gap_1) / 2)


def test_damper_adds_its_rate():
    force = law(50e3, 2e-3, 50e3, 3e-3, 1e4, 0.0, 0.0)
    assert force == pytest.approx(50e3 * 2.5e-3 + 1e4 * 1e-3)


def test_stiffness_may_change_and_the_damper_gives_way_too():
    gap_0, gap_free, compliance, damping = 2e-3, 3e-3, 1e-5, 4e4
    force = law(50e3, gap_0, 30e3, gap_free, damping, compliance, 0.0)
    gap_1 = gap_free - compliance * force
    assert force == pytest.approx((50e3 * gap_0 + 30e3 * gap_1) / 2 + damping * (gap_1 - gap_0))


def test_contact_only_pushes_unless_told_otherwise():
    assert law(50e3, -1e-3, 50e3, -2e-3, 0.0, 1e-5, 0.0) == 0.0
    assert law(50e3, -1e-3, 50e3, -2e-3, 0.0, 1e-5, -np.inf) < 0.0


def test_mass_bouncing_on_a_spring_matches_scipy_and_keeps_its_energy():
    """A mass dropped on a spring, through the law, against SciPy's solver with events."""
    mass, stiffness, weight, step, end = 7.2, 50e3, 120.0, 1e-4, 0.3

    def rates(t, y):
        return [y[1], (weight - stiffness * max(y[0], 0.0)) / mass]

    exact = solve_ivp(rates, (0, end), [-5e-3, 0.0], rtol=1e-10, atol=1e-13, max_step=1e-3)
    z, v, energy = -5e-3, 0.0, []
    for _ in range(round(end / step)):
        free = z + v * step + weight * step**2 / (2 * mass)
        force = law(stiffness, z, stiffness, free, 0.0, step**2 / (2 * mass), 0.0)
        z, v = free - force * step**2 / (2 * mass), v + (weight - force) * step / mass
        energy.append(mass * v**2 / 2 + stiffness * max(z, 0.0) ** 2 / 2 - weight * z)
    assert z == pytest.approx(exact.y[0, -1], abs=3e-5)
    assert max(energy) / min(energy) - 1 < 0.02
