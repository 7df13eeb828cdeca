"""Environments made, reset, stepped, copied and thrown away for MINUTES=1: memory does not grow."""

import copy
import gc
import os
import sys
import threading
import time
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from panto_env import simulate
from panto_env.backend import JIT
from panto_env.envs import IDS

WARM = 0.2
"""Share of the time in which memory may still grow: compilers and libraries take theirs."""
GROWTH = 30.0
"""MB that it may grow by in the rest."""


def in_use() -> float:
    """Memory that this process has (MB)."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def once(number: int) -> int:
    """Some of everything; returns steps made."""
    random, steps = np.random.default_rng(number), 0
    for name in IDS:
        env = gymnasium.make(f"panto_env:{name}", accuracy="fast")
        for seed in range(2):
            env.reset(seed=seed)
            for _ in range(50):
                env.step(env.action_space.sample())
        copy.deepcopy(env).step(env.action_space.sample())
        env.reset(options={"speed_kmh": float(random.uniform(150, 250))})
        env.close()
        envs = gymnasium.make_vec(f"panto_env:{name}", num_envs=32, accuracy="fast")
        envs.reset(seed=number)
        for _ in range(30):
            envs.step(envs.action_space.sample())
        envs.close()
        steps += 2 * 50 + 30 * 32
    simulate(policy="p", speed_kmh=float(random.uniform(150, 300)), distance=200.0)
    return steps


@pytest.mark.study
@pytest.mark.filterwarnings("ignore")
@pytest.mark.skipif(
    not JIT or not sys.platform.startswith("linux"), reason="reads Linux's own account of memory"
)
def test_memory_does_not_grow_and_threads_end():
    seconds = 60 * float(os.environ.get("MINUTES", "1"))
    begun, steps, number, first = time.monotonic(), 0, 0, None
    while time.monotonic() < begun + seconds:
        steps += once(number)
        number += 1
        if first is None and time.monotonic() > begun + WARM * seconds:
            first = in_use()
    time.sleep(0.5)  # threads that were dismissed end
    assert steps > 2000
    assert in_use() - first < GROWTH
    assert threading.active_count() <= 3  # pytest's own and a monitor's
