"""The same bits whatever the machine gives to linear algebra: an episode of each id, and policies' gains."""

import os
import subprocess
import sys

import pytest

CODE = """
import hashlib, sys, warnings
import gymnasium, numpy as np
from panto_env import simulate
from panto_env.envs import IDS
warnings.simplefilter("ignore")

def told(name, *arrays):
    print(name, hashlib.sha256(b"".join(np.ascontiguousarray(each).tobytes() for each in arrays)).hexdigest())

for name in IDS:
    env = gymnasium.make(f"panto_env:{name}")
    random, seen = np.random.default_rng(0), [env.reset(seed=1)[0]]
    for _ in range(100):
        observation, reward, *_ = env.step(random.uniform(-1, 1, env.action_space.shape))
        seen += [observation, np.array([reward])]
    told(name, *seen)
for policy in ("lqg", "h-infinity", "mpc", "repetitive", "fb+ff"):
    run = simulate(policy=policy, distance=150.0, sensors="realistic", actuator="realistic")
    told(policy, run.contact_force, run.frame_force)
"""


def hashes(threads):
    environment = os.environ | dict.fromkeys(
        ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), threads
    )
    result = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, env=environment, check=True
    )
    return result.stdout.splitlines()


@pytest.mark.slow
def test_bits_are_the_same_under_one_and_two_threads_of_linear_algebra():
    one, two = hashes("1"), hashes("2")
    assert len(one) == 8
    assert one == two
