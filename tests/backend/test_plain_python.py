"""The kernels' source does the same as plain Python (NUMBA_DISABLE_JIT=1) as it does compiled, and as it did.

python -m tests.backend.test_plain_python   # writes kernel_results.json anew
"""

import json
import os
import subprocess
import sys
from functools import cache, partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import panto_env
from panto_env.backend import JIT
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible import FlexibleCatenaryData

from ..marks import some_at_once

pytestmark = pytest.mark.plain

DEFECTS = {"broken_droppers": [(1, 2)], "miscut_droppers": [(1, 4, 0.02)], "irregularity": 1.0}
LIGHT = {"precision": "double", "reward": "paper1", "settle": 0.0}  # without passive runs, in plain Python
CASES = {
    "stiffness": ("PantographStiffness-v0", {"sensors": "realistic", "pantograph_scatter": 0.1}),
    "three spans": ("PantographThreeSpan-v0", {"speed_kmh": 340, "control_interval": 0.05}),
    "flexible": ("Pantograph-v0", LIGHT | {"window": 3, "actuator": "realistic"}),
    "both actuators": (
        "PantographStiffness-v0",
        {"observation": "full", "actuator": {"place": "both", "delay": 0.01}, "sensors": {"delay": 0.02}},
    ),
    "motors": ("PantographStiffness-v0", {"actuator": {"kind": "motor", "place": "both"}}),
    "loose motors": ("PantographStiffness-v0", {"actuator": "head-motor:backlash=0.014"}),
    "defects": ("Pantograph-v0", LIGHT | {"window": 3, "line_condition": DEFECTS}),
    "clamps": ("Pantograph-v0", LIGHT | {"catenary": "re330", "window": 3, "observation": "full"}),
}
STEPS = {"three spans": 20, "stiffness": 30}
"""Control steps of a case, 6 unless named here: the three-span line is to pass a support."""


def observations(name):
    """All observations and rewards of a case, under a fixed tape of actions."""
    identifier, settings = CASES[name]
    env = gymnasium.make(identifier, **settings)
    rows = [env.reset(seed=3)[0].tolist()]
    tape = np.random.default_rng(0)
    for _ in range(STEPS.get(name, 6)):
        action = tape.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, *_ = env.step(action)
        rows.append([*observation.tolist(), reward])
    return rows


def short_line():
    """The reference line with spans of 12 m: a window of three moves along it within a short run."""
    line = load_catenary("en50318-2002")
    near = line.droppers.model_copy(update={"positions": (2.0, 6.0, 10.0), "sag": (0.0, 0.0, 0.0)})
    return line.model_copy(update={"span_length": 12.0, "droppers": near, "spans": 5})


def run_of(*series, line=None, pantograph="en50318-2002", **settings):
    """Series of a run on a short line, in double precision."""
    given = {"precision": "double", "spacing": 0.5, "time_step": 2e-3} | settings
    run = panto_env.simulate(line or short_line(), pantograph, **given)
    return [getattr(run, each).tolist() for each in series]


EVERYTHING = "contact_force", "dropper_force", "uplift"
DAMPED = load_pantograph("en50318-2002").model_copy(update={"contact_damping": 100.0})


def passive_run():
    """Forces of contact and droppers and uplift, from the line's first anchor to its last."""
    return run_of(*EVERYTHING, window=3, distance=58.0)


def drifting_run():
    """A worn line under a damped contact, at a speed that drifts."""
    uneven = {"speed_drift": 5.0, "line_condition": "worn", "seed": 1}
    return run_of("contact_force", "position", pantograph=DAMPED, window=3, distance=30.0, **uneven)


def run_in_weather():
    """Ice on both wires, one of them fixed and cold, and a speed that drifts in a gusty wind."""
    line = short_line()
    fixed = line.messenger_wire.model_copy(update={"axial_stiffness": 10e6})
    line = line.model_copy(update={"messenger_wire": fixed})
    blown = load_pantograph("en50318-2002").model_copy(update={"aerodynamic_coefficient": 1e-3})
    weather = {"wind": 12.0, "ice": 0.4, "temperature": -20.0}
    drawn = {"speed_drift": 5.0, "line_condition": weather, "seed": 1, "window": 3, "distance": 30.0}
    return run_of("contact_force", "dropper_force", line=line, pantograph=blown, **drawn)


def unlike_spans(distance, conditions, changes, droppers):
    """Runs on a sequence of short spans, in a window that travels and on the whole line."""
    table = short_line().model_dump(exclude={"sources", "spans"}, exclude_none=True)
    table["droppers"] |= droppers
    line = FlexibleCatenaryData.model_validate(table | changes)
    found = []
    for window, condition in conditions.items():
        given = {"window": window or None, "line_condition": condition, "distance": distance}
        found += run_of(*EVERYTHING, line=line, **given)
    return found


def uneven_run():
    """Short spans that differ: a window that travels, and the whole line with a hard spot."""
    spans = [{"span_length": length} for length in (12.0, 14.3, 11.1, 13.7, 12.9)]
    arm = short_line().steady_arm.model_dump(exclude_none=True) | {"stiffness": 300.0, "mass": 0.9}
    conditions = {3: {"raised_supports": [(2, 0.02)]}, 0: {"hard_spots": [(3, 4.2, 2.0, 100.0)]}}
    changes = {"sequence": spans, "steady_arm": arm}
    return unlike_spans(62.0, conditions, changes, {"contact_clamp_mass": 0.2})


def overlapping_run():
    """Short spans with stitch wires and an overlap: a window that travels, and defects on the whole line."""
    changes = {
        "stitch_wire": {"length": 9.0, "tension": 2000.0, "mass": 0.3, "clamp_mass": 0.2},
        "span_length": 20.0,
        "sequence": [{}, {}, {"stitch_wire": {"length": 0.0}}, {}] * 2,
        "overlaps": [{"first_span": 4, "rises": (0.02, 0.1), "level": 1.0}],
    }
    conditions = {4: {"broken_droppers": [(5, 5)]}, 0: {"hard_spots": [(6, 4.2, 2.0, 100.0)]}}
    droppers = {"positions": (2.5, 10.0, 17.5), "sag": (0.0, 0.0, 0.0)}
    return unlike_spans(150.0, conditions, changes, droppers)


def train_run():
    """Two controlled pantographs of different kinds with damped strips, one behind the other."""
    train = {"pantographs": [DAMPED, "three-mass"], "distances": [14.0], "controlled": [1, 2]}
    numerics = {"window": 3, "spacing": 0.5, "time_step": 2e-3}
    given = LIGHT | train | numerics | {"catenary": short_line(), "spans": 8, "run_in": 0.0, "washout": 0.5}
    env = gymnasium.make("Pantograph-v0", **given)
    rows = [env.reset(seed=3)[0].tolist()]
    for step in range(40):
        force = 0.2 * np.sin(step + np.arange(2.0)).astype(np.float32)
        observation, reward, *_ = env.step(force)
        rows.append([*observation.tolist(), reward])
    return [*rows, *(own.contact_force.tolist() for own in env.unwrapped.trajectory.train)]


def rig_run():
    """A rig's computer and cylinder."""
    run = panto_env.simulate(catenary="rig", distance=8.0, speed_kmh=200)
    return [run.contact_force.tolist(), run.wire.tolist()]


def several_lanes():
    """Observations and rewards of four lanes that end apart, each then idle for a step."""
    envs = gymnasium.make_vec(
        "PantographStiffness-v0", num_envs=4, speed_kmh=(200, 300), distance=12.0, line_condition="worn"
    )
    rows = [envs.reset(seed=3)[0].tolist()]
    tape = np.random.default_rng(0)
    for _ in range(30):
        action = tape.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
        observation, reward, *_ = envs.step(action)
        rows.append(np.column_stack([observation, reward]).tolist())
    return rows


RUNS = {
    **{name: partial(observations, name) for name in CASES},
    "a window that moves along a line": passive_run,
    "a speed that drifts": drifting_run,
    "spans that differ": uneven_run,
    "stitch wires and an overlap": overlapping_run,
    "weather": run_in_weather,
    "a train": train_run,
    "a rig": rig_run,
    "several lanes": several_lanes,
}
LONG = ("a train", "a rig", "stitch wires and an overlap") if JIT else ()
"""Runs whose kernels nothing else has, and which take half a minute to compile: for `make proofs`."""
USUAL = tuple(name for name in RUNS if name not in LONG)
CHOSEN = pytest.mark.parametrize("name", some_at_once(RUNS, USUAL))
STORED = Path(__file__).with_name("kernel_results.json")


def digest(rows):
    """A few numbers in which each number of a run counts, differently."""
    values = np.concatenate([np.ravel(row) for row in rows])
    weights = np.random.default_rng(0).uniform(1, 2, (3, values.size))
    return (weights @ values / weights.sum(axis=1)).tolist()


@cache
def in_the_other_way(names):
    """Runs by name, compiled where this process runs plain Python and the other way round."""
    code = f"import json; from {__name__} import RUNS; print(json.dumps([RUNS[name]() for name in {names}]))"
    environment = os.environ | {"NUMBA_DISABLE_JIT": str(int(JIT))}
    root = Path(__file__).parents[2]
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True, check=True
    )
    return dict(zip(names, json.loads(result.stdout), strict=True))


@pytest.mark.slow
@CHOSEN
def test_plain_python_and_compiled_kernels_agree(name):
    others = in_the_other_way(LONG if name in LONG else USUAL)
    for ours, theirs in zip(RUNS[name](), others[name], strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)


@pytest.mark.longer
@CHOSEN
def test_kernels_compute_what_they_did(name):
    """Physics has tests of its own; this one notices each change of a result, wanted or not."""
    assert digest(RUNS[name]()) == pytest.approx(json.loads(STORED.read_text())[name], rel=1e-5)


def test_a_passive_run_agrees_with_one_under_control():
    """Two kernels share the plant's step: a run without policy, and one whose policy does nothing."""
    settings = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 40.0}
    passive = panto_env.simulate(**settings)
    controlled = panto_env.simulate(**settings, policy="passive")
    np.testing.assert_array_equal(passive.contact_force, controlled.contact_force)


if __name__ == "__main__":
    results = {name: digest(run()) for name, run in RUNS.items()}
    STORED.write_text(json.dumps(results, indent=1) + "\n")
