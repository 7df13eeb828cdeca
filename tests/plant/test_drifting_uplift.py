"""A speed that drifts: the aerodynamic force follows it, and so does all that is required or known of it."""

import gymnasium
import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfilt_zi

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.estimation.estimate import estimate
from panto_env.estimation.motion import measure
from panto_env.metrics.compliance import largest_mean
from panto_env.plant.speed import draw_drift
from panto_env.plant.state import Row

from ..pantograph_alone import means, replay

SPEED_KMH, DRIFT_KMH = 300.0, 10.0
DRIFT = {"speed_kmh": SPEED_KMH, "speed_drift": DRIFT_KMH}
MASSLESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass"}
TWO_WIRES = {"catenary": "en50318-2002", "pantograph": "dsa380"}
"""Both pantographs have 70 N of static force and 0.00097 N/(km/h)^2 of uplift."""
EVEN = load_catenary("periodic-stiffness").model_copy(update={"stiffness_variation": 0.0})
"""A spring that is the same everywhere."""


def speeds(times, seed=0):
    """Speed (km/h) of a run at times (s), from the sines of its drift."""
    drift = draw_drift(DRIFT_KMH, 1.0, np.random.default_rng(seed))
    amplitude, turns, phase = drift[1:].reshape(3, 3).T
    angles = 2 * np.pi * (np.outer(times, turns) + phase)
    return SPEED_KMH + np.cos(angles) @ (2 * np.pi * amplitude * turns)


def lifts(times, seed=0):
    """Static force and aerodynamic uplift (N) at times (s)."""
    return 70.0 + 0.00097 * speeds(times, seed) ** 2


def passive(given, seed=0):
    """A passive run, and the pantograph's state at its start."""
    task = Task(run_settings(given))
    task.reset(0, np.random.default_rng(seed))
    start = task.plant.run.table[0, 0, Row.STATE :][: task.plant.pantographs.sizes[0]].copy()
    task.run_passively()
    return task.trajectory(0), start


def test_an_even_wire_carries_what_lifts_the_pantograph_at_its_present_speed():
    """The drift is slow: all is nearly at rest."""
    run = simulate(EVEN, "three-mass", **DRIFT, distance=1600.0)
    lift = lifts(run.time)
    assert np.ptp(lift) > 15.0
    carried = lift - 1.0 * run.frame  # less the spring of 1 N/m to the ground
    assert run.contact_force == pytest.approx(carried, abs=0.3)
    # Nor is there a jump at the start.
    assert run.contact_force[0] == pytest.approx(carried[0], abs=1e-2)


@pytest.mark.parametrize("line", [MASSLESS, TWO_WIRES])
def test_the_motion_is_that_of_a_pantograph_alone_under_a_lift_that_follows_the_speed(line):
    """The contact force is the run's own; SciPy's matrix exponential does the rest."""
    run, start = passive(line | DRIFT | {"distance": 900.0})
    data = load_pantograph(line["pantograph"])
    assert run.lift == pytest.approx(lifts(run.time), abs=1e-4)
    states = replay(run, data, start)
    n = len(data.masses)
    for series, place in (("head", 0), ("frame", n - 1), ("head_velocity", n), ("frame_velocity", 2 * n - 1)):
        assert getattr(run, series) == pytest.approx(means(states[:, place]), rel=1e-4, abs=1e-6), series


def test_the_cost_function_counts_from_the_force_at_the_present_speed():
    run, _ = passive({"catenary": EVEN, "pantograph": "three-mass", **DRIFT, "distance": 700.0})
    deviation = np.abs(run.contact_force - lifts(run.time))
    assert run.summary("all").cost_function == pytest.approx(np.trapezoid(deviation, run.position), rel=1e-4)
    assert np.trapezoid(np.abs(run.contact_force - run.nominal_force), run.position) > 1500.0
    assert run.summary("all").cost_function < 150.0


@pytest.mark.parametrize("seed", [0, 3])
def test_a_required_mean_follows_the_speed_and_the_static_force_does_not(seed):
    given = {**TWO_WIRES, "speed_kmh": SPEED_KMH, "mean_force": "en50367", "seed": seed}
    run, steady = simulate(**given, speed_drift=DRIFT_KMH), simulate(**given)
    inside = run.inside()
    required = np.mean([largest_mean(speed / 3.6, "AC") for speed in speeds(run.time, seed)[inside].tolist()])
    assert abs(required - largest_mean(SPEED_KMH / 3.6, "AC")) > 1.0
    assert run.summary().mean == pytest.approx(required, abs=0.06)
    assert run.nominal_force == pytest.approx(steady.nominal_force, abs=0.5)
    # The limits are those of the speed over these spans.
    mean, *_ = run.compliance()
    assert mean.highest == pytest.approx(required, abs=0.1)


def test_terms_of_the_reward_count_from_the_force_required_at_the_present_speed():
    weights = {"cost_function": 0.0, "contact_loss": 0.0, "low_passed": 1.0, "mean_force": 0.0}
    env = gymnasium.make("panto_env:PantographStiffness-v0", **MASSLESS, **DRIFT, reward=weights).unwrapped
    env.reset(seed=4)
    told, cost, ended = [], [], False
    while not ended:
        *_, terminated, truncated, info = env.step(np.zeros(1))
        told.append(info["reward_terms"]["low_passed"])
        cost.append(info["reward_terms"]["cost_function"])
        ended = terminated or truncated
    run = env.trajectory
    sections = butter(6, 20, fs=1 / run.time_step, output="sos")
    filtered, _ = sosfilt(sections, run.contact_force, zi=sosfilt_zi(sections) * run.contact_force[0])
    assert np.abs(run.lift - run.nominal_force).mean() > 5.0
    expected = (((filtered - run.lift) / run.nominal_force) ** 2).reshape(len(told), -1).mean(axis=1)
    # Within a control step the lift is taken as that of its end.
    assert told == pytest.approx(expected, rel=2e-3, abs=1e-5)
    assert sum(cost) == pytest.approx(run.summary("all").cost_function, rel=1e-3)


def test_observed_nominal_force_and_centres_follow_the_speed():
    given = {**MASSLESS, **DRIFT, "observation": "centred", "distance": 600.0}
    env = gymnasium.make("panto_env:PantographStiffness-v0", **given, history=1).unwrapped
    env.reset(seed=0)
    layout, pairs = env.context.layout, []
    for _ in range(200):
        seen, *_ = env.step(np.zeros(1))
        lift, speed = layout.read(seen, "nominal force"), layout.read(seen, "speed")
        pairs.append((lift - 70.0 - 0.00097 * (3.6 * speed) ** 2, lift))
        assert layout.read(seen, "contact force") == pytest.approx(env.trajectory.contact_force[-1], rel=1e-5)
    missed, lift = np.array(pairs).T
    assert np.abs(missed).max() < 0.05
    assert np.abs(lift - 157.3).mean() > 3.0


def test_entries_normalised_by_speed_read_as_what_they_are():
    given = {**MASSLESS, **DRIFT, "speed_kmh": (290.0, 310.0), "normalise": (250.0, 350.0), "distance": 400.0}
    env = gymnasium.make("panto_env:PantographStiffness-v0", **given).unwrapped
    env.reset(seed=0)
    layout = env.context.layout
    assert layout.entries[layout.index("contact force")].slope > 0.5
    for _ in range(100):
        seen, *_ = env.step(np.zeros(1))
        assert layout.read(seen, "contact force") == pytest.approx(env.trajectory.contact_force[-1], abs=0.02)


def test_an_estimator_knows_the_uplift_of_the_speed():
    """A filter that took the mean speed's uplift would miss what differs from it: 5 N and more."""
    run, _ = passive(TWO_WIRES | DRIFT | {"distance": 1400.0, "time_step": 1e-3})
    given = estimate(measure(run), load_pantograph("dsa380"))
    true = np.interp(given.time, run.time, run.contact_force)
    wrong = (given.force - true)[given.first :]
    slow = np.convolve(wrong, np.ones(2000) / 2000, mode="valid")
    assert np.abs(run.lift - run.nominal_force).max() > 8.0
    assert np.abs(slow).max() < 1.0
