"""Whole episodes with Numba's check of every index: none lies outside its array. `make bounds` runs them."""

import os
import subprocess
import sys

import pytest

from panto_env.backend import JIT

pytestmark = [pytest.mark.study, pytest.mark.skipif(not JIT, reason="plain Python checks indices by itself")]


def run(code, tmp_path):
    environment = os.environ | {"NUMBA_BOUNDSCHECK": "1"}
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        env=environment,
        cwd=tmp_path,
        timeout=900,
    )


def test_the_check_is_on(tmp_path):
    (tmp_path / "module.py").write_text(
        "from panto_env.backend import kernel\n@kernel\ndef at(x, k):\n    return x[k]\n"
    )
    told = run("import numpy as np\nfrom module import at\nat(np.zeros(3), 1)\nat(np.zeros(3), 5)", tmp_path)
    assert "IndexError" in told.stderr


EPISODES = """
import gymnasium, numpy as np
from panto_env.envs import IDS
count = 0
for name in IDS:
    for sizes in (None, 5):
        for settings in ({}, {"actuator": {"place": "both"}, "observation": "full", "speed_drift": 5.0}):
            make = gymnasium.make if sizes is None else gymnasium.make_vec
            env = make(f"panto_env:{name}", **settings, **({} if sizes is None else {"num_envs": sizes}))
            env.reset(seed=0)
            for _ in range(3000 if sizes is None else 1200):
                _, _, terminated, truncated, _ = env.step(env.action_space.sample())
                count += sizes or 1
                if sizes is None and (terminated or truncated):
                    env.reset()
print(count)
"""


def test_whole_episodes_of_every_id(tmp_path):
    told = run(EPISODES, tmp_path)
    assert told.returncode == 0, told.stderr[-2000:]
    assert int(told.stdout) > 50_000


LINES = """
import warnings
import sys
sys.path.insert(0, {root!r})
from tests.plant.test_nonsense import case_of, made
from panto_env import InputError, simulate
ways = {{"finite": 0, "refused": 0}}
for seed in range(40):
    case = case_of(seed)
    try:
        line, pantograph = made(case)
        simulate(line, pantograph, case["speed_kmh"], seed=1, distance=line.alignment().support(4.5),
                 line_condition=case["line_condition"], policy="p")
        ways["finite"] += 1
    except (InputError, ValueError):
        ways["refused"] += 1
print(ways["finite"])
"""


def test_random_lines(tmp_path):
    told = run(LINES.format(root=os.path.dirname(os.path.dirname(os.path.dirname(__file__)))), tmp_path)
    assert told.returncode == 0, told.stderr[-2000:]
    assert int(told.stdout) >= 10
