"""The observation "estimated": the kernel's filter is that of panto_env.estimation, in each lane."""

import copy

import gymnasium
import numpy as np
import pytest

from panto_env import InputError
from panto_env.catalog import load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.estimation.kalman import run_filter, steady_gains
from panto_env.estimation.model import EstimatorSettings, build_model
from panto_env.plant.state import Row

FLEXIBLE = {"catenary": "en50318-2002", "pantograph": "own-two-mass", "speed_kmh": 250.0}
MASSLESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 250.0}


def readings(task, steps, seed=0):
    """Estimated force, (steps + 1,), of lane 0 in a passive run."""
    task.reset(np.arange(task.lanes), np.random.default_rng(seed))
    place, seen = task.layout.index("contact force"), []
    for _ in range(steps + 1):
        seen.append(float(task.results.observation[0, place]) * task.layout.entries[place].scale)
        task.step(np.zeros((task.lanes, len(task.actuator.places))))
    return np.array(seen)


@pytest.mark.longer
@pytest.mark.parametrize(
    ("settings", "estimator"),
    [(FLEXIBLE, "usual"), (FLEXIBLE, "displacements"), (MASSLESS, "usual:suspension_drift=0")],
)
def test_the_kernel_s_filter_is_the_steady_one_of_the_room_of_estimators(settings, estimator):
    chosen = run_settings(
        {
            **settings,
            "observation": "estimated",
            "estimator": estimator,
            "time_step": 1e-3,
            "control_interval": 1e-3,
        }
    )
    task = Task(chosen)
    seen = readings(task, 400)
    run = task.trajectory(0)
    process = chosen.estimator.force_model.process(None, None)
    model = build_model(chosen.pantograph, process, chosen.estimator, 1e-3)
    columns = [run.head, run.frame, run.head_velocity, run.frame_velocity][: len(model.observed)]
    measured = np.column_stack(columns)
    inputs = np.column_stack([run.nominal_force + run.frame_force, run.head_force])
    start = task.sensors
    state = np.zeros(len(model.transition))
    masses = len(chosen.pantograph.masses)
    state[:masses] = start.shape @ [run_start(task, Row.HEAD_HEIGHT), run_start(task, Row.FRAME_HEIGHT)]
    state[2 * masses] = run_start(task, Row.CONTACT_FORCE)
    filtered = run_filter(model, steady_gains(model), measured, inputs, state)
    # The observation is of single precision.
    assert seen[1:401] == pytest.approx((filtered.state @ model.force)[:400], rel=1e-6, abs=2e-5)
    assert np.std(seen[1:]) > 1.0


def run_start(task, row):
    return task.samples.rows[0, 0, 0, row]


@pytest.mark.longer
def test_lanes_are_single_environments_and_copies_go_on():
    settings = FLEXIBLE | {
        "observation": "estimated",
        "sensors": "realistic",
        "line_condition": "fair",
        "pantograph_scatter": 0.05,
        "speed_kmh": (200, 300),
        "distance": 60.0,
    }
    lanes = gymnasium.make_vec("panto_env:Pantograph-v0", 3, **settings)
    alone = gymnasium.make("panto_env:Pantograph-v0", **settings).unwrapped
    seen, single = lanes.reset(seed=5)[0][1], alone.reset(seed=6)[0]
    other, first = None, seen
    for k in range(90):
        assert np.array_equal(seen, single)
        action = np.sin(0.3 * k + np.arange(3.0)).reshape(3, 1).astype(np.float32)
        together = lanes.step(action)
        if other is not None:
            assert np.array_equal(other.step(action)[0], together[0])
        if k == 20:
            other = copy.deepcopy(lanes)
        if together[2][1] or together[3][1]:
            break
        seen, single = together[0][1], alone.step(action[1])[0]
    assert k > 30
    assert not np.array_equal(seen, first)


@pytest.mark.longer
def test_an_estimate_follows_the_force_and_is_as_late_as_the_sensors():
    delayed = {}
    for delay in (0.0, 0.01):
        task = Task(
            run_settings(
                {
                    **FLEXIBLE,
                    "observation": "estimated",
                    "time_step": 2.5e-4,
                    "control_interval": 5e-3,
                    "sensors": {"delay": delay, "displacement_noise": 2e-5, "velocity_noise": 5e-3},
                }
            )
        )
        delayed[delay] = readings(task, 1500)
        true = task.trajectory(0).contact_force.reshape(-1, 20).mean(axis=1)[:1500]
    early, late = delayed[0.0], delayed[0.01]
    assert np.corrcoef(early[400:1498], late[402:1500])[0, 1] > 0.97  # noise differs: it is used up otherwise
    lags = [np.corrcoef(early[400 + k : 1490 + k], true[400:1490])[0, 1] for k in range(5)]
    assert max(lags) > 0.93
    assert np.argmax(lags) <= 2


@pytest.mark.longer
def test_noise_of_displacement_reaches_the_estimate_and_that_of_a_force_sensor_does_not():
    spreads = {}
    for name, sensors in {
        "none": {},
        "force": {"force_noise": 50.0},
        "displacement": {"displacement_noise": 2e-4},
    }.items():
        task = Task(run_settings({**FLEXIBLE, "observation": "estimated", "sensors": sensors}))
        spreads[name] = readings(task, 300)
    assert np.array_equal(spreads["none"], spreads["force"])
    assert np.std(spreads["displacement"] - spreads["none"]) > 3.0


@pytest.mark.longer
def test_policies_and_estimator_may_know_another_pantograph_than_the_true_one():
    known = load_pantograph("benchmark-2015")
    settings = {**FLEXIBLE, "observation": "estimated"}
    true, mistaken = (Task(run_settings(settings | more)) for more in ({}, {"known_pantograph": known}))
    assert true.context(0).pantograph == load_pantograph("own-two-mass")
    assert mistaken.context(0).pantograph == known
    right, wrong = readings(true, 300), readings(mistaken, 300)
    assert len(mistaken.sensors.shape) == 3
    assert np.std(wrong - right) > 1.0


@pytest.mark.parametrize(
    ("estimator", "said"),
    [
        ("kalman", "estimator must be 'usual'"),
        ("usual:lags=1", "estimator is not valid"),
        ({"displacement_noise": -1.0}, "displacement_noise"),
    ],
)
def test_what_is_no_estimator_is_refused(estimator, said):
    with pytest.raises(InputError, match=said):
        run_settings({"observation": "estimated", "estimator": estimator})
    assert EstimatorSettings() == run_settings({"observation": "estimated"}).estimator
