"""Faults of sensors and actuators: what a policy reads, and what reaches the plant."""

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.control.faults import FAULTS
from panto_env.control.settings import run_settings

from ..lanes import check_lanes_are_singles

NAME = "panto_env:PantographStiffness-v0"
READINGS = ("head displacement", "frame displacement", "head velocity", "frame velocity", "contact force")
GIVEN = {"speed_kmh": 200.0, "distance": 120.0, "observation": "measured", "settle": 0.0, "run_in": 0.0}


def passes(faults, sensors="ideal", **more):
    """Readings, (steps, 5), and the actuator's forces (N) of an episode under a constant action."""
    env = gymnasium.make(NAME, **GIVEN, sensors=sensors, faults=faults, **more).unwrapped
    observation, _ = env.reset(seed=3)
    layout, read, forces, ended = env.context.layout, [], [], False
    while not ended:
        read.append([layout.read(observation, name) for name in READINGS])
        observation, _, *ends, info = env.step(np.full(1, 0.2))
        forces.append(info["frame_force"])
        ended = any(ends)
    return np.array(read), np.array(forces)


def test_without_faults_nothing_changes():
    whole, forces = passes(())
    later, same = passes({"part": "readings", "kind": "silent", "begin": 100.0})
    np.testing.assert_array_equal(whole, later)
    np.testing.assert_array_equal(forces, same)


@pytest.mark.parametrize(
    ("part", "columns", "sensors"),
    [
        ("force", [4], "ideal"),
        ("displacements", [0, 1], "ideal:force_noise=3,displacement_noise=1e-3"),
        ("velocities", [2, 3], "ideal"),
        ("readings", range(5), "ideal:force_noise=3,displacement_noise=1e-3"),
    ],
)
def test_a_silent_part_reads_zero_and_a_frozen_one_what_it_was(part, columns, sensors):
    usual, _ = passes((), sensors=sensors)
    others = [k for k in range(5) if k not in columns]
    for kind in ("silent", "frozen"):
        read, _ = passes({"part": part, "kind": kind, "begin": 1.0, "lasts": 0.5}, sensors=sensors)
        during = read[101:150][:, columns]
        np.testing.assert_array_equal(during, np.broadcast_to(during[0], during.shape))
        assert kind == "frozen" or not during.any()
        np.testing.assert_array_equal(read[:100], usual[:100])
        np.testing.assert_array_equal(read[151:], usual[151:])
        np.testing.assert_array_equal(read[:, others], usual[:, others])


def test_gain_and_offset():
    usual, _ = passes(())
    read, _ = passes(
        [
            {"part": "force", "kind": "gain", "value": 0.7},
            {"part": "velocities", "kind": "offset", "value": 0.1},
        ]
    )
    np.testing.assert_allclose(read[:, 4], 0.7 * usual[:, 4], rtol=1e-6)
    np.testing.assert_allclose(read[:, 2:4], usual[:, 2:4] + 0.1, atol=1e-6)


def test_a_fault_of_the_actuator_reaches_the_plant_and_not_the_policy_s_last_action():
    limit = 100.0
    _, forces = passes({"part": "actuator", "kind": "silent", "begin": 1.0, "lasts": 0.5}, actuator="ideal")
    assert forces[:99] == pytest.approx(0.2 * limit)
    assert not forces[101:149].any()
    assert forces[151:] == pytest.approx(0.2 * limit)
    _, weak = passes("actuator-weak", actuator="ideal")
    assert weak == pytest.approx(0.1 * limit)


def test_a_frozen_actuator_holds_its_force():
    run = simulate(
        "periodic-stiffness",
        "three-mass",
        200.0,
        policy="pd",
        distance=400.0,
        faults={"part": "actuator", "kind": "frozen", "begin": 2.0, "lasts": 1.0},
    )
    inside = (run.time > 2.05) & (run.time < 2.95)
    assert np.ptp(run.frame_force[inside]) == 0.0
    assert run.frame_force[inside][0] != 0.0
    assert np.ptp(run.frame_force[run.time > 3.1]) > 0.0


def test_it_comes_again_from_a_time_that_is_drawn():
    starts = set()
    for seed in range(4):
        env = gymnasium.make(NAME, **GIVEN | {"distance": 250.0}, faults="force-silent").unwrapped
        env.reset(seed=seed)
        layout, silent = env.context.layout, []
        for _ in range(440):
            observation, *_ = env.step(np.zeros(1))
            silent.append(layout.read(observation, "contact force") == 0.0)
        silent = np.array(silent)
        assert silent.mean() == pytest.approx(0.25, abs=0.07)
        starts.add(int(np.flatnonzero(silent)[0]))
    assert len(starts) == 4


def test_slow_averages_take_up_what_is_read():
    """A silent force deviates from its average by less and less."""
    env = gymnasium.make(
        NAME,
        **GIVEN | {"observation": "deviations", "distance": 180.0},
        faults={"part": "force", "kind": "silent", "begin": 0.5},
    ).unwrapped
    observation, _ = env.reset(seed=0)
    seen = []
    for _ in range(300):
        observation, *_ = env.step(np.zeros(1))
        seen.append(env.context.layout.read(observation, "contact force deviation"))
    assert seen[55] < -50.0
    assert abs(seen[-1]) < 0.1 * abs(seen[55])


def test_lanes_are_single_environments():
    faults = [
        "force-silent:lasts=0.2,every=0.6,probability=0.5",
        {"part": "force", "kind": "gain", "value": (0.7, 1.3)},
    ]
    check_lanes_are_singles(NAME, {"faults": faults, "distance": 60.0}, steps=100)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_named_and_takes_values(name):
    assert run_settings({"faults": name}).faults == (FAULTS[name],)
    assert run_settings({"faults": f"{name}:begin=2"}).faults[0].begin == 2.0


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("nothing", "must be 'force-silent'"),
        ({"part": "force"}, "key 'kind' is missing"),
        ({"part": "force", "kind": "gain"}, "value must be given"),
        ({"part": "force", "kind": "silent", "value": 1.0}, "value must be given for a gain"),
        ({"part": "readings", "kind": "offset", "value": 1.0}, "different units"),
        ({"part": "force", "kind": "silent", "every": 2.0}, "lasts must be given"),
        ({"part": "force", "kind": "silent", "every": 2.0, "lasts": 3.0}, "at most every"),
        (["force-silent"] * 17, "up to 16"),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused(fault, said):
    with pytest.raises(InputError, match=said):
        run_settings({"faults": fault})


def test_the_estimating_filter_has_no_faults():
    with pytest.raises(InputError, match="reads the sensors before their faults"):
        run_settings({"faults": "force-silent", "observation": "estimated"})
