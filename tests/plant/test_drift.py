"""A speed that drifts: the way is its integral, and everything that counts metres agrees with it."""

import gymnasium
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.signal import butter, sosfilt, sosfilt_zi

from panto_env import InputError, simulate
from panto_env.backend import python_function
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.estimation.estimate import estimate
from panto_env.estimation.motion import measure
from panto_env.metrics.compliance import largest_mean
from panto_env.metrics.trajectory import Trajectory
from panto_env.plant.functions import sine_of_turns
from panto_env.plant.speed import ahead, draw_drift, largest_drift, largest_lag
from panto_env.plant.state import Row

from ..lanes import check_lanes_are_singles
from ..pantograph_alone import means, replay

NAMES = ("panto_env:Pantograph-v0", "panto_env:PantographStiffness-v0")
DRIFT = {"speed_drift": 4.0}
SIMPLE = {"catenary": "periodic-stiffness", "pantograph": "three-mass"}


def speeds(drift, times, time_step):
    """Drift of the speed (m/s) at times (s), from its waves."""
    waves = drift[1:].reshape(-1, 3)
    turns = np.outer(times / time_step, waves[:, 1]) + waves[:, 2]
    return (2 * np.pi * waves[:, 0] * waves[:, 1] / time_step * np.cos(2 * np.pi * turns)).sum(axis=1)


def test_the_drift_is_of_its_size_slow_and_bounded():
    rms, time_step = 1.3, 1e-3
    drawn = [draw_drift(rms, time_step, np.random.default_rng(seed)) for seed in range(400)]
    assert np.mean([speeds(drift, np.array([2.0]), time_step)[0] ** 2 for drift in drawn]) == pytest.approx(
        rms**2, rel=0.15
    )
    times = np.arange(0, 400, 0.05)
    for drift in drawn[:20]:
        speed = speeds(drift, times, time_step)
        assert np.sqrt(np.mean(speed**2)) == pytest.approx(rms, rel=0.1)
        assert np.abs(speed).max() <= largest_drift(rms)
        assert np.abs(np.diff(speed)).max() / 0.05 < 0.85 * rms  # m/s^2
        assert np.abs(ahead(drift[None], times[None] / time_step)).max() <= largest_lag(rms)


def test_the_way_is_the_integral_of_the_speed():
    time_step = 2e-3
    drift = draw_drift(1.0, time_step, np.random.default_rng(4))
    times = np.linspace(0, 60, 6001)
    way = cumulative_simpson(speeds(drift, times, time_step), x=times, initial=0)
    np.testing.assert_allclose(ahead(drift[None], times[None] / time_step)[0], way, atol=1e-7)


def test_the_kernel_s_train_is_where_python_s_is():
    env = gymnasium.make(NAMES[1], **DRIFT, speed_kmh=200.0, distance=700.0).unwrapped
    env.reset(seed=2)
    positions, observed, ended = [], [], False
    while not ended:
        observation, _, *ends, info = env.step(np.zeros(1))
        positions.append(info["position"])
        observed.append(env.context.layout.read(observation, "speed"))
        ended = any(ends)
    task, run = env.task, env.trajectory
    steps = task.length.control_steps * np.arange(1, len(positions) + 1)
    row = task.plant.run.drift[0]
    times = steps * task.plant.time_step
    expected = 200 / 3.6 * times + ahead(row[None], steps[None])[0]
    np.testing.assert_allclose(positions, expected, atol=1e-9)
    np.testing.assert_allclose(observed, 200 / 3.6 + speeds(row, times, task.plant.time_step), rtol=1e-6)
    assert np.ptp(observed) > 1.0
    # The last control step is the first that ends beyond the distance.
    assert positions[-2] < 700.0 <= positions[-1]
    # Samples are of the middle of their steps.
    middle = 200 / 3.6 * run.time + ahead(row[None], run.time[None] / run.time_step)[0]
    np.testing.assert_allclose(run.position, middle, atol=1e-9)
    assert env.task.length.most_control_steps >= len(positions)


@pytest.mark.parametrize("line", [SIMPLE, {}])
def test_figures_kept_as_it_runs_are_those_of_the_record(line, tmp_path):
    task = Task(run_settings(line | DRIFT | {"distance": 900.0, "speed_kmh": 250.0}))
    task.reset(0, np.random.default_rng(1))
    task.run_passively()
    run = task.trajectory(0)
    kept, recorded = task.figures(0).as_dict(), run.summary("all").as_dict()
    for name, value in recorded.items():
        if name != "max_uplift":
            # Of the way, the one takes the mean of a control step, the other each step.
            assert kept[name] == pytest.approx(value, rel=1e-4, abs=1e-9), name
    assert kept["distance"] == pytest.approx(run.distance, abs=0.01)  # a tenth of a step
    assert run.distance != pytest.approx(run.speed_kmh / 3.6 * len(run.time) * run.time_step, abs=1.0)
    deviation = np.abs(run.contact_force - run.lift)
    assert recorded["cost_function"] == pytest.approx(np.trapezoid(deviation, run.position), rel=1e-9)
    run.save(tmp_path / "run.parquet")
    loaded = Trajectory.load(tmp_path / "run.parquet").summary("all").as_dict()
    assert loaded == pytest.approx(recorded, rel=0, abs=0, nan_ok=True)


def test_terms_of_an_episode_sum_to_its_figures_after_a_run_in():
    env = gymnasium.make(NAMES[0], **DRIFT, distance=200.0, settle=0.0, reward="paper1").unwrapped
    _, info = env.reset(seed=0)
    start, terms, ended = info["position"], np.zeros(2), False
    while not ended:
        *_, terminated, truncated, info = env.step(np.full(1, 0.1))
        ended = terminated or truncated
        told = info["reward_terms"]
        terms += told["cost_function"], told["contact_loss"]
    figures = info["figures"]
    assert terms[0] == pytest.approx(figures["cost_function"], rel=1e-9)
    assert terms[1] == pytest.approx(figures["contact_loss"], rel=0.02, abs=1e-9)
    assert figures["distance"] == pytest.approx(info["position"] - start, abs=1e-6)
    assert 200.0 <= figures["distance"] < 201.0


def test_without_drift_nothing_changes_and_nothing_is_drawn():
    given = SIMPLE | {"distance": 300.0, "line_condition": "fair", "seed": 3}
    plain, none = simulate(**given), simulate(**given, speed_drift=0.0)
    np.testing.assert_array_equal(plain.contact_force, none.contact_force)
    drifting = simulate(**given, speed_drift=3.0)
    assert np.abs(drifting.contact_force[:200] - plain.contact_force[:200]).max() > 0.01
    # What else is drawn comes before.
    tasks = [Task(run_settings(SIMPLE | {"line_condition": "fair"} | more)) for more in ({}, DRIFT)]
    for task in tasks:
        task.reset(0, np.random.default_rng(3))
    np.testing.assert_array_equal(tasks[0].plant.run.waves, tasks[1].plant.run.waves)


@pytest.mark.parametrize("name", NAMES)
def test_lanes_drift_each_on_its_own_as_single_environments_do(name):
    settings = {**DRIFT, "distance": 25.0, "speed_kmh": (200.0, 300.0), "settle": 0.0}
    assert check_lanes_are_singles(name, settings, steps=90).ends >= 5


def test_speeds_that_drift_out_of_what_is_possible_are_refused():
    with pytest.raises(InputError, match="speed must lie above 0"):
        Task(run_settings({"speed_kmh": 10.0, "speed_drift": 10.0}))
    with pytest.raises(InputError, match="below the wave speed"):
        Task(run_settings({"speed_kmh": 420.0, "speed_drift": 10.0}))
    with pytest.raises(InputError, match="A rig runs its line at one speed"):
        Task(run_settings({"catenary": "rig", "speed_kmh": 200.0, "speed_drift": 1.0}))


def test_sine_of_turns_is_good_enough_for_a_way():
    turns = np.linspace(0, 100, 7919)
    ours = [python_function(sine_of_turns)(each) for each in turns]
    np.testing.assert_allclose(ours, np.sin(2 * np.pi * turns), atol=1e-12)


SPEED_KMH, DRIFT_KMH = 300.0, 10.0
QUICK = {"speed_kmh": SPEED_KMH, "speed_drift": DRIFT_KMH}
TWO_WIRES = {"catenary": "en50318-2002", "pantograph": "dsa380"}
"""Both pantographs have 70 N of static force and 0.00097 N/(km/h)^2 of uplift."""
EVEN = load_catenary("periodic-stiffness").model_copy(update={"stiffness_variation": 0.0})
"""A spring that is the same everywhere."""


def kmh_at(times, seed=0):
    """Speed (km/h) of a run at times (s), from the sines of its drift."""
    drift = draw_drift(DRIFT_KMH, 1.0, np.random.default_rng(seed))
    amplitude, turns, phase = drift[1:].reshape(3, 3).T
    angles = 2 * np.pi * (np.outer(times, turns) + phase)
    return SPEED_KMH + np.cos(angles) @ (2 * np.pi * amplitude * turns)


def lifts(times, seed=0):
    """Static force and aerodynamic uplift (N) at times (s)."""
    return 70.0 + 0.00097 * kmh_at(times, seed) ** 2


def passive(given, seed=0):
    """A passive run, and the pantograph's state at its start."""
    task = Task(run_settings(given))
    task.reset(0, np.random.default_rng(seed))
    start = task.plant.run.table[0, 0, Row.STATE :][: task.plant.pantographs.sizes[0]].copy()
    task.run_passively()
    return task.trajectory(0), start


def test_an_even_wire_carries_what_lifts_the_pantograph_at_its_present_speed():
    """The drift is slow: all is nearly at rest."""
    run = simulate(EVEN, "three-mass", **QUICK, distance=1600.0)
    lift = lifts(run.time)
    assert np.ptp(lift) > 15.0
    carried = lift - 1.0 * run.frame  # less the spring of 1 N/m to the ground
    assert run.contact_force == pytest.approx(carried, abs=0.3)
    # Nor is there a jump at the start.
    assert run.contact_force[0] == pytest.approx(carried[0], abs=1e-2)


@pytest.mark.longer
@pytest.mark.parametrize("line", [SIMPLE, TWO_WIRES])
def test_the_motion_is_that_of_a_pantograph_alone_under_a_lift_that_follows_the_speed(line):
    """The contact force is the run's own; SciPy's matrix exponential does the rest."""
    run, start = passive(line | QUICK | {"distance": 900.0})
    data = load_pantograph(line["pantograph"])
    assert run.lift == pytest.approx(lifts(run.time), abs=1e-4)
    states = replay(run, data, start)
    n = len(data.masses)
    for series, place in (("head", 0), ("frame", n - 1), ("head_velocity", n), ("frame_velocity", 2 * n - 1)):
        assert getattr(run, series) == pytest.approx(means(states[:, place]), rel=1e-4, abs=1e-6), series


def test_the_cost_function_counts_from_the_force_at_the_present_speed():
    run, _ = passive({"catenary": EVEN, "pantograph": "three-mass", **QUICK, "distance": 700.0})
    deviation = np.abs(run.contact_force - lifts(run.time))
    assert run.summary("all").cost_function == pytest.approx(np.trapezoid(deviation, run.position), rel=1e-4)
    assert np.trapezoid(np.abs(run.contact_force - run.nominal_force), run.position) > 1500.0
    assert run.summary("all").cost_function < 150.0


def test_a_required_mean_follows_the_speed_and_the_static_force_does_not():
    given = {**TWO_WIRES, "speed_kmh": SPEED_KMH, "mean_force": "en50367"}
    run, steady = simulate(**given, speed_drift=DRIFT_KMH), simulate(**given)
    inside = run.inside()
    required = np.mean([largest_mean(speed / 3.6, "AC") for speed in kmh_at(run.time)[inside].tolist()])
    assert abs(required - largest_mean(SPEED_KMH / 3.6, "AC")) > 1.0
    assert run.summary().mean == pytest.approx(required, abs=0.06)
    assert run.nominal_force == pytest.approx(steady.nominal_force, abs=0.5)
    # The limits are those of the speed over these spans.
    mean, *_ = run.compliance()
    assert mean.highest == pytest.approx(required, abs=0.1)


def test_terms_of_the_reward_count_from_the_force_required_at_the_present_speed():
    weights = {"cost_function": 0.0, "contact_loss": 0.0, "low_passed": 1.0, "mean_force": 0.0}
    env = gymnasium.make("panto_env:PantographStiffness-v0", **SIMPLE, **QUICK, reward=weights).unwrapped
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
    given = {**SIMPLE, **QUICK, "observation": "centred", "distance": 600.0}
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
    given = {
        **SIMPLE,
        **QUICK,
        "speed_kmh": (290.0, 310.0),
        "normalise": (250.0, 350.0),
        "distance": 400.0,
    }
    env = gymnasium.make("panto_env:PantographStiffness-v0", **given).unwrapped
    env.reset(seed=0)
    layout = env.context.layout
    assert layout.entries[layout.index("contact force")].slope > 0.5
    for _ in range(100):
        seen, *_ = env.step(np.zeros(1))
        assert layout.read(seen, "contact force") == pytest.approx(env.trajectory.contact_force[-1], abs=0.02)


@pytest.mark.longer
def test_an_estimator_knows_the_uplift_of_the_speed():
    """A filter that took the mean speed's uplift would miss what differs from it: 5 N and more."""
    run, _ = passive(TWO_WIRES | QUICK | {"distance": 1400.0, "time_step": 1e-3})
    given = estimate(measure(run), load_pantograph("dsa380"))
    true = np.interp(given.time, run.time, run.contact_force)
    wrong = (given.force - true)[given.first :]
    slow = np.convolve(wrong, np.ones(2000) / 2000, mode="valid")
    assert np.abs(run.lift - run.nominal_force).max() > 8.0
    assert np.abs(slow).max() < 1.0
