"""Contact and wire stay stable together, however stiff, and their figures do not hang on grid and step."""

import numpy as np
import pytest
from scipy.linalg import eigvalsh

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible.grid import point_gain, stencil_weights
from panto_env.plant.catenary.three_span import ThreeSpan
from panto_env.plant.functions import stencil
from panto_env.plant.numerics import Numerics, Runs

from ..finite_element import simulation as finite_element
from ..finite_element.figures import figures as figures_of

LINE, PANTOGRAPH = load_catenary("en50318-2002"), load_pantograph("en50318-2002")
CLAMPS = LINE.droppers.model_copy(update={"contact_clamp_mass": 3.0, "messenger_clamp_mass": 3.0})
HEAVY = LINE.model_copy(update={"name": "heavy clamps", "droppers": CLAMPS})


def stiff(stiffness, damping=0.0):
    return PANTOGRAPH.model_copy(update={"contact_stiffness": stiffness, "contact_damping": damping})


@pytest.mark.parametrize(("dx", "step"), [(0.375, 2e-3), (0.125, 2.5e-4)])
def test_the_stiffest_explicit_contact_is_that_of_the_eigenvalues(dx, step):
    """The largest of k dt^2 W' (4 M - dt^2 K)^-1 W over places between two nodes, on 400 nodes of a ring."""
    wire, size = LINE.contact_wire, 400
    beta, stiffness, one = LINE.damping.beta, np.zeros((size, size)), np.eye(size)
    for shift, weight in enumerate(stencil_weights(wire, dx, step, beta), start=1):
        stiffness += weight * (2 * one - np.roll(one, shift, 0) - np.roll(one, -shift, 0))
    room = 4 * one - stiffness * (1 + 2 * beta / step)
    first, weights = stencil(100 * dx + np.linspace(0, dx, 50), dx)
    forces = np.zeros((size, 50))
    forces[first[:, None] + np.arange(4), np.arange(50)[:, None]] = weights
    largest = float((forces * np.linalg.solve(room, forces)).sum(axis=0).max())
    largest *= step**2 / (wire.mass * dx)
    assert point_gain(wire, dx, step, beta) == pytest.approx(largest, rel=0.01)
    # There the leapfrog with this contact has an eigenvalue of 4 / dt^2, and its fastest motion grows.
    pushed = step**2 / (wire.mass * dx) / point_gain(wire, dx, step, beta) * np.outer(*forces[:, [-1, -1]].T)
    assert eigvalsh(stiffness * (1 + 2 * beta / step) + pushed).max() <= 4 * 1.001


def test_the_stiffest_explicit_contact_of_modes_is_that_of_one_step_after_another():
    """On a grid of time: the free motion of all modes and a contact that reads them at mid-step."""
    given = {"numerics": Numerics(time_step=1e-2), "runs": Runs()}
    line = ThreeSpan(load_catenary("ohl-three-span"), lanes=1, collectors=1, spans=5, **given)
    parts, limit = line.line, 1 / line.contact_gain
    shape = max(parts.shape, key=lambda row: row @ row)
    growth = {}
    for share in (0.95, 1.1):
        yields = shape**2 @ parts.half_step[2]
        reads = np.concatenate([shape * parts.half_step[0], shape * parts.half_step[1]])
        force = -share * limit * reads / (1 + share * limit * yields)
        free = np.block([[np.diag(parts.propagate[k + 2 * j]) for k in range(2)] for j in range(2)])
        pushed = np.concatenate([parts.impulse[0] * shape, parts.impulse[1] * shape])
        growth[share] = np.abs(np.linalg.eigvals(free + np.outer(pushed, force))).max()
    assert growth[0.95] < 1.0 < growth[1.1]


FINE = {"spacing": 0.125, "time_step": 2.5e-4}


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", ["full", "fast"])
@pytest.mark.parametrize(
    ("catenary", "pantograph", "speed"),
    [
        ("en50318-2002", stiff(500e3), 300),
        ("en50318-2002", stiff(50e3, 1000.0), 300),
        ("re330", stiff(200e3), 350),
        (HEAVY, PANTOGRAPH, 300),
    ],
    ids=["500 kN/m", "1000 N s/m", "re330", "clamps of 3 kg"],
)
def test_a_stiff_contact_loses_no_contact_by_grid_or_step(catenary, pantograph, speed, accuracy):
    """Contact loss was 29 % at 200 kN/m on the grid of before, 4 % at 1000 N s/m; clamps of 3 kg diverged."""
    true = simulate(catenary, pantograph, speed, record_droppers=False, **FINE).summary((4, 9))
    ours = simulate(catenary, pantograph, speed, record_droppers=False, accuracy=accuracy).summary((4, 9))
    full = accuracy == "full"
    assert ours.std == pytest.approx(true.std, rel=0.01 if full else 0.07)
    assert ours.contact_loss == pytest.approx(true.contact_loss, rel=0.02, abs=0.1 if full else 2.5)
    assert ours.mean == pytest.approx(true.mean, rel=0.005)


@pytest.mark.filterwarnings("ignore:A grid of")
@pytest.mark.parametrize(
    ("stiffness", "settings"), [(50e3, {"time_step": 5e-3}), (1e6, {"accuracy": "fast"}), (1e6, {})]
)
def test_a_contact_that_may_pull_never_grows(stiffness, settings):
    given = {"bilateral": True, "record_droppers": False, "distance": 450.0} | settings
    run = simulate("en50318-2002", stiff(stiffness), 300, **given)
    assert run.summary((4, 6)).std < 60.0
    assert np.abs(run.contact_force).max() < 600.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("catenary", "pantograph", "speed", "spans"),
    [
        (LINE, stiff(200e3), 300.0, (5, 6)),
        (HEAVY, PANTOGRAPH, 300.0, (5, 6)),
        (LINE, PANTOGRAPH, 30.0, (2, 3)),
        (LINE, PANTOGRAPH, 400.0, (5, 6)),
    ],
    ids=["200 kN/m", "clamps of 3 kg", "30 km/h", "400 km/h"],
)
def test_finite_elements_agree_at_the_edges(catenary, pantograph, speed, spans):
    """As in tests/plant/test_flexible.py, where contact, line and speed are ordinary."""
    ours = simulate(catenary, pantograph, speed, record_droppers=False).summary(spans)
    step = 2.5e-4 if speed > 100 else 5e-4
    other = finite_element.simulate(
        catenary, pantograph, speed, element=0.25, time_step=step, distance=60.0 * spans[1] + 1
    )
    theirs = figures_of(other, spans)
    assert ours.std == pytest.approx(theirs.std, rel=0.02)
