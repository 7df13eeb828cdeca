"""Environments made, reset, stepped, copied and thrown away for minutes: memory does not grow.

python -m tests.fuzz.soak --minutes 5
"""

from __future__ import annotations

import argparse
import copy
import gc
import os
import sys
import threading
import time
import warnings
from pathlib import Path

import gymnasium
import numpy as np

from panto_env import simulate
from panto_env.envs import IDS

WARM = 0.2
"""Share of the time in which memory may still grow: compilers and libraries take theirs."""
GROWTH = 30.0
"""MB that it may grow by in the rest."""


def in_use() -> float:
    """Memory that this process has (MB)."""
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
                steps += 1
        copy.deepcopy(env).step(env.action_space.sample())
        env.reset(options={"speed_kmh": float(random.uniform(150, 250))})
        env.close()
        envs = gymnasium.make_vec(f"panto_env:{name}", num_envs=32, accuracy="fast")
        envs.reset(seed=number)
        for _ in range(30):
            envs.step(envs.action_space.sample())
            steps += 32
        envs.close()
    simulate(policy="p", speed_kmh=float(random.uniform(150, 300)), distance=200.0)
    return steps


def soak(seconds: float) -> tuple[int, float, int]:
    """Steps made, growth of memory after the warm part (MB), and threads that are left."""
    begun, steps, number, first = time.monotonic(), 0, 0, None
    while time.monotonic() < begun + seconds:
        steps += once(number)
        number += 1
        if first is None and time.monotonic() > begun + WARM * seconds:
            gc.collect()
            first = in_use()
    gc.collect()
    time.sleep(0.5)  # threads that were dismissed end
    return steps, in_use() - (first or in_use()), threading.active_count()


def main() -> None:
    """Soak, tell, and end with 1 where memory grew or threads are left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0)
    warnings.simplefilter("ignore")
    steps, growth, threads = soak(60 * parser.parse_args().minutes)
    print(f"{steps:,} steps; memory grew by {growth:.1f} MB; {threads} threads")
    sys.exit(growth > GROWTH or threads > 1)


if __name__ == "__main__":
    main()
