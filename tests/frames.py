"""How long a frame takes: python -m tests.frames

Median over an episode of each id, at 1280 x 720, of all that `render` does.
"""

from __future__ import annotations

import statistics
import time

import gymnasium

from panto_env.base.table import Table
from panto_env.envs import IDS
from panto_env.studies.throughput.processor import describe
from panto_env.terminal import print_table

FRAMES = 300


def milliseconds(name: str) -> float:
    """Median time of a frame of an id (ms)."""
    env = gymnasium.make(name, render_mode="rgb_array")
    env.reset(seed=0)
    taken = []
    for _ in range(FRAMES):
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
        begin = time.perf_counter()
        env.render()
        taken.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(taken)


def main() -> None:
    """Measure and print."""
    rows = []
    for name in IDS:
        taken = milliseconds(name)
        rows.append((name, f"{taken:.1f}", f"{1e3 / taken:.0f}"))
    title = f"Frames of 1280 x 720, {describe()['processor']}"
    print_table(Table(title, ("id", "ms per frame", "frames per second"), rows))


if __name__ == "__main__":
    main()
