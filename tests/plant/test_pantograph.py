import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from panto_env import simulate
from panto_env.backend import JIT, kernel
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.numerics import Numerics
from panto_env.plant.pantograph import schema as pantograph
from panto_env.plant.pantograph.step import move_freely
from panto_env.plant.plant import Plant
from panto_env.plant.state import ROW, Row
from panto_env.plant.train import Train

pytestmark = pytest.mark.plain


@pytest.mark.parametrize("name", ["en50318-2002", "three-mass", "own-motor-head"])
def test_discretisation_is_exact_for_held_forces(name):
    """Against SciPy's solver, for forces held over each step."""
    data = load_pantograph(name)
    step, random = 5e-3, np.random.default_rng(0)
    a, b = pantograph.matrices(data)
    transition, inputs = pantograph.discretise(data, step)
    state = exact = np.zeros(len(a))
    for _ in range(5):
        forces = random.normal(scale=100.0, size=3)
        state = transition @ state + inputs @ forces
        solution = solve_ivp(lambda t, x, f=forces: a @ x + b @ f, (0, step), exact, rtol=1e-11, atol=1e-14)
        exact = solution.y[:, -1]
    np.testing.assert_allclose(state, exact, rtol=1e-7, atol=1e-11)


@pytest.mark.parametrize("size", [1e-12, 0.2, 3.0, 400.0])
def test_exponential_is_scipy_s(size):
    matrix = size * np.random.default_rng(0).normal(size=(7, 7))
    matrix -= 4 * size * np.eye(7)  # it decays, as a pantograph does
    np.testing.assert_allclose(pantograph.exponential(matrix), expm(matrix), rtol=1e-10, atol=1e-13)
    np.testing.assert_array_equal(pantograph.exponential(0 * matrix), np.eye(7))


def test_matrices_of_two_masses_as_written_out():
    """Equations of motion of the two-mass model, term by term."""
    data = load_pantograph("en50318-2002")
    a, b = pantograph.matrices(data)
    (m1, m2), (k1, k2), (c1, c2) = data.masses, data.stiffnesses, data.dampings
    z1, z2, v1, v2, contact, frame, head = np.random.default_rng(1).normal(size=7)
    rates = a @ [z1, z2, v1, v2] + b @ [contact, frame, head]
    spring = k1 * (z2 - z1) + c1 * (v2 - v1)
    assert rates == pytest.approx(
        [v1, v2, (spring - contact + head) / m1, (-spring - k2 * z2 - c2 * v2 + frame - head) / m2]
    )


def test_rest_is_in_equilibrium_and_carries_the_lift_less_the_lowest_spring():
    data = load_pantograph("identified-2dof")
    compliance = 1 / 33e3
    (state,) = pantograph.rest_state(data, np.array([54.0]), np.array([0.01]), compliance)
    force = (state[0] - 0.01) / compliance
    assert force == pytest.approx(54.0 - data.stiffnesses[-1] * state[1])
    a, b = pantograph.matrices(data)
    assert a @ state + b @ [force, 54.0, 0.0] == pytest.approx(0.0, abs=1e-9)


def test_scatter_is_of_its_size_and_leaves_nothing_out():
    data, random = load_pantograph("three-mass"), np.random.default_rng(0)
    drawn = [pantograph.with_scatter(data, 0.1, random) for _ in range(300)]
    for name in ("masses", "stiffnesses", "dampings"):
        changes = np.log(np.array([getattr(each, name) for each in drawn]) / getattr(data, name))
        assert changes.std(axis=0) == pytest.approx([0.1] * 3, rel=0.2), name
        assert np.abs(np.corrcoef(changes.T) - np.eye(3)).max() < 0.25, name


@kernel
def swing(pantographs, run, heights):
    """Free motion of a pantograph of one mass, from where it is."""
    own = run.table[0, 0]
    after = own[ROW.STATE + 2 :]
    for k in range(heights.size):
        move_freely(pantographs, 0, own, 0)
        own[ROW.STATE] = after[0]
        own[ROW.STATE + 1] = after[1]
        heights[k] = own[ROW.STATE]


@pytest.mark.parametrize("friction", [6.0, 0.6])
def test_dry_friction_takes_2_f_over_k_from_each_swing_and_then_holds(friction):
    """A frame alone on its spring: the closed form of Coulomb friction."""
    spring = 4000.0
    changed = {"masses": (10.0,), "stiffnesses": (spring,), "dampings": (0.0,), "frame_friction": friction}
    data = load_pantograph("own-two-mass").model_copy(update=changed | {"static_force": 0.0})
    plant = Plant(load_catenary("en50318-2002"), Train.of(data), numerics=Numerics(time_step=2e-4, window=3))
    plant.start(0, 50.0)
    _, _, pantographs, _, run = plant.arrays
    run.table[0, 0, Row.STATE : Row.STATE + 2] = 0.02, 0.0
    height = np.zeros(6000 if JIT else 1500)
    swing(pantographs, run, height)
    up = np.diff(height) > 0
    turns = np.abs([0.02, *height[1:-1][up[1:] != up[:-1]]])
    assert -np.diff(turns[:3]) == pytest.approx(2 * friction / spring, rel=0.02)
    assert len(turns) < 0.02 / (2 * friction / spring) + 2
    if JIT and friction > 1:
        assert np.ptp(height[-500:]) == 0  # where the spring is weaker than the friction it stays
        assert abs(height[-1]) < friction / spring


@pytest.mark.skipif(not JIT, reason="a whole run takes minutes in plain Python")
def test_friction_in_the_frame_dampens_its_motion_under_a_line():
    """And one that is larger than all that pulls holds it where it is."""
    smooth = load_pantograph("own-two-mass")
    spreads = []
    for friction in (0.0, 5.0, 100.0):
        rubbed = smooth.model_copy(update={"frame_friction": friction})
        run = simulate("ohl-three-span", rubbed, 250, distance=400.0)
        spreads.append(run.frame[run.inside("all")].std())
    assert spreads[0] > 1.05 * spreads[1]
    assert spreads[2] < 0.05 * spreads[0]
