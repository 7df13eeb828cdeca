"""A head that rolls on two springs, touched beside its middle."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.periodic_stiffness import PeriodicStiffnessData
from panto_env.plant.pantograph.schema import PantographData

from .test_plan import ARM, CURVE, ZIGZAG, line_with

INERTIA, DISTANCE = 7.12 * 1.2**2 / 12, 1.0  # of the reference: a bar of 1.2 m on springs at 0.5 m


def rolling(name="dsa380", **changes):
    own = {"roll_inertia": INERTIA, "spring_distance": DISTANCE} | changes
    return load_pantograph(name).model_copy(update=own)


@pytest.mark.longer
def test_on_a_massless_line_it_moves_as_scipy_s_solver_has_it(monkeypatch):
    """The line's wire lies beside the middle of the head."""
    line, aside, speed, force = load_catenary("periodic-stiffness"), 0.3, 50.0, 120.0
    monkeypatch.setattr(PeriodicStiffnessData, "lateral", lambda self, places, *_: 0 * places + aside)
    values = {"contact_stiffness": 50e3, "dampings": (100.0, 10.0, 32.0)}
    own = rolling("three-mass", static_force=force, aerodynamic_coefficient=0.0, **values)
    run = simulate(line, own, 3.6 * speed, time_step=2.5e-4, distance=100.0)
    masses, springs, dampers = map(np.array, (own.masses, own.stiffnesses, own.dampings))

    def contact(x, t):
        stiffness = 4000.0 * (1 + 0.4 * np.cos(2 * np.pi * speed * t / 50.0))
        return max((x[0] + aside * x[3]) / (1 / 50e3 + 1 / stiffness), 0.0)

    def motion(t, state):
        x, v = state[:4], state[4:]
        f = contact(x, t)
        pull = springs * (x[:3] - np.append(x[1:3], 0.0)) + dampers * (v[:3] - np.append(v[1:3], 0.0))
        arm = (DISTANCE / 2) ** 2
        chain = (-pull + np.append(0.0, pull[:2]) + np.array([-f, 0.0, force])) / masses
        roll = (-springs[0] * arm * x[3] - dampers[0] * arm * v[3] - f * aside) / INERTIA
        return np.concatenate([v, chain, [roll]])

    rest = np.zeros(8)
    held = run.contact_force[0]
    rest[3] = -held * aside / (springs[0] * (DISTANCE / 2) ** 2)
    rest[0] = held * (1 / 50e3 + 1 / (4000.0 * 1.4)) - aside * rest[3]
    rest[1] = rest[0] + held / springs[0]
    rest[2] = rest[1] + held / springs[1]
    times = np.linspace(0.0, 2.0, 8001)
    found = solve_ivp(motion, (0.0, 2.0), rest, t_eval=times, rtol=1e-9, atol=1e-12, max_step=1e-3)
    forces = [contact(x, t) for x, t in zip(found.y[:4].T, times, strict=True)]
    middle = (run.time[1:] - 0.5 * 2.5e-4, run.contact_force[1:])
    assert np.interp(times[40:], *middle) == pytest.approx(np.array(forces)[40:], abs=0.15)
    assert np.std(forces) > 5
    still = simulate(
        line, own.model_copy(update={"roll_inertia": None, "spring_distance": None}), 180.0, distance=100.0
    )
    assert abs(still.contact_force.std() - run.contact_force.std()) > 0.2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "plan", "change"),
    [(250, ZIGZAG, -3.9), (300, ZIGZAG, -4.8), (250, CURVE, -0.7), (300, CURVE, -3.5)],
)
def test_it_changes_sigma_as_in_three_dimensions(speed, plan, change):
    """The reference's own plane with the plan's positions is within 2.6 % of its three dimensions."""
    line, given = line_with(plan, steady_arm=ARM), {"spans": 14, "window": 0, "distance": 720.0}
    rolls, still = (simulate(line, own, speed, **given).summary((8, 11)).std for own in (rolling(), "dsa380"))
    assert rolls / still == pytest.approx(1 + change / 100, abs=0.026)


def test_where_the_line_has_no_plan_a_head_does_not_roll():
    runs = [simulate("en50318-2002", own, 250.0, distance=120.0) for own in (rolling(), "dsa380")]
    assert (runs[0].contact_force == runs[1].contact_force).all()


def test_a_very_inert_head_on_far_springs_does_not_roll():
    line = line_with(ZIGZAG, steady_arm=ARM)
    stiff = rolling(roll_inertia=50.0, spring_distance=2.0)
    runs = [simulate(line, own, 250.0, spans=14, distance=360.0) for own in (stiff, "dsa380", rolling())]
    assert runs[0].contact_force.std() == pytest.approx(runs[1].contact_force.std(), rel=0.02)
    assert (runs[2].contact_force != runs[1].contact_force).mean() > 0.9


ONE_MASS = {"masses": (7.0,), "stiffnesses": (100.0,), "dampings": (10.0,)}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"roll_inertia": 1.0}, "go together"),
        ({"spring_distance": 1.0}, "go together"),
        ({"roll_inertia": 1.0, "spring_distance": 5.0}, "from 0.1 to 2 m"),
        (ONE_MASS | {"roll_inertia": 1.0, "spring_distance": 1.0}, "second mass below it"),
    ],
)
def test_what_cannot_roll_is_refused(changes, sentence):
    table = load_pantograph("dsa380").model_dump(exclude={"sources"}) | changes
    with pytest.raises(ValueError, match=sentence):
        PantographData.model_validate(table)
