import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph


def exact_force(speed_kmh, position, unilateral):
    """Paper 3, Eqs 5-8, by SciPy at rtol 1e-9, from rest under F(v)."""
    line, data = load_catenary("periodic-stiffness"), load_pantograph("three-mass")
    (m1, m2, m3), (k1, k2, k3), (c1, c2, c3) = data.masses, data.stiffnesses, data.dampings
    speed = speed_kmh / 3.6
    lift = 70.0 + 0.00097 * speed_kmh**2

    def stiffness(t):
        cosine = np.cos(2 * np.pi * speed * t / line.span_length)
        return line.mean_stiffness * (1 + line.stiffness_variation * cosine)

    def push(t, z1):
        return np.maximum(stiffness(t) * z1, 0) if unilateral else stiffness(t) * z1

    def rates(t, y):
        z1, z2, z3, v1, v2, v3 = y
        upper, middle = c1 * (v1 - v2) + k1 * (z1 - z2), c2 * (v2 - v3) + k2 * (z2 - z3)
        return [
            v1,
            v2,
            v3,
            -(upper + push(t, z1)) / m1,
            (upper - middle) / m2,
            (lift + middle - c3 * v3 - k3 * z3) / m3,
        ]

    stiff = np.array([[k1, -k1, 0], [-k1, k1 + k2, -k2], [0, -k2, k2 + k3]], dtype=float)
    stiff[0, 0] += stiffness(0)
    start = np.concatenate([np.linalg.solve(stiff, [0, 0, lift]), np.zeros(3)])
    time = position / speed
    # Steps end where contact may be lost: a kink in the force would spoil the solver's order.
    solution = solve_ivp(rates, (0, time[-1]), start, t_eval=time, rtol=1e-9, atol=1e-12, max_step=1e-2)
    return push(solution.t, solution.y[0])


@pytest.mark.slow
@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("speed", [160, 250, 350])
def test_contact_force_matches_scipy(speed, unilateral):
    run = simulate("periodic-stiffness", "three-mass", speed, bilateral=not unilateral)
    exact = exact_force(speed, run.position, unilateral)
    assert np.abs(run.contact_force - exact).max() < 0.005 * np.abs(exact).max()
    if speed == 350:  # contact is lost, or pulls
        assert (run.contact_force.min() < 0) == (not unilateral)
