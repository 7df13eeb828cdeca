"""The kernels' source does the same as plain Python (NUMBA_DISABLE_JIT=1) as it does compiled."""

import json
import os
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import panto_env
from panto_env.backend import JIT

pytestmark = pytest.mark.plain

DEFECTS = {"broken_droppers": [(1, 2)], "miscut_droppers": [(1, 4, 0.02)], "irregularity": 1.0}
CASES = {
    "stiffness": ("PantographStiffness-v0", {"sensors": "realistic", "pantograph_scatter": 0.1}),
    "three spans": ("PantographThreeSpan-v0", {"speed_kmh": 340, "control_interval": 0.05}),
    "flexible": ("Pantograph-v0", {"precision": "double", "window": 3, "actuator": "realistic"}),
    "both actuators": (
        "PantographStiffness-v0",
        {"observation": "full", "actuator": {"place": "both", "delay": 0.01}, "sensors": {"delay": 0.02}},
    ),
    "defects": ("Pantograph-v0", {"precision": "double", "window": 3, "line_condition": DEFECTS}),
    "clamps": (
        "Pantograph-v0",
        {"catenary": "re330", "precision": "double", "window": 3, "observation": "full"},
    ),
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


def in_the_other_way(names):
    """The same, compiled where this process runs plain Python and the other way round."""
    code = (
        f"import json; from {__name__} import observations; "
        f"print(json.dumps([observations(name) for name in {names}]))"
    )
    environment = os.environ | {"NUMBA_DISABLE_JIT": str(int(JIT))}
    root = Path(__file__).parents[1]
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True, check=True
    )
    return dict(zip(names, json.loads(result.stdout), strict=True))


@pytest.fixture(scope="module")
def others():
    return in_the_other_way(list(CASES))


@pytest.mark.parametrize("name", CASES)
def test_plain_python_and_compiled_kernels_agree(name, others):
    for ours, theirs in zip(observations(name), others[name], strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)


def test_a_passive_run_agrees_with_one_under_control():
    """Two kernels share the plant's step: a run without policy, and one whose policy does nothing."""
    settings = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 40.0}
    passive = panto_env.simulate(**settings)
    controlled = panto_env.simulate(**settings, policy="passive")
    np.testing.assert_array_equal(passive.contact_force, controlled.contact_force)
