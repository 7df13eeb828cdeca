"""How long a frame takes: python -m tests.frames

Median over an episode of each id, at 1280 x 720, of all that `render` does; and how long Gymnasium's
RecordVideo takes for a second of an episode, in which it draws each control step and writes an MP4.
"""

from __future__ import annotations

import statistics
import tempfile
import time

import gymnasium

from panto_env.base.table import Table
from panto_env.envs import IDS
from panto_env.studies.throughput.roofline import describe
from panto_env.terminal import print_table

FRAMES = 200
RECORDED = 1.0
"""Seconds of an episode."""


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
    env.close()
    return statistics.median(taken)


def recording(name: str) -> float:
    """Time (s) that RecordVideo takes for a second of an episode, the steps and the film's file with it."""
    with tempfile.TemporaryDirectory() as folder:
        plain = gymnasium.make(name, render_mode="rgb_array")
        env = gymnasium.wrappers.RecordVideo(plain, folder, disable_logger=True)
        begin = time.perf_counter()
        env.reset(seed=0)
        steps = round(RECORDED * env.metadata["render_fps"])
        for _ in range(steps):
            *_, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                env.reset()
        env.close()
        return (time.perf_counter() - begin) / RECORDED


def main() -> None:
    """Measure and print."""
    rows = []
    for name in IDS:
        taken = milliseconds(name)  # first, so that all is compiled when the recording is timed
        rows.append((name, f"{taken:.1f}", f"{1e3 / taken:.0f}", f"{recording(name):.1f}"))
    title = f"Frames of 1280 x 720, {describe()['processor']}; RecordVideo in s per second of an episode"
    headings = ("id", "ms per frame", "frames per second", "RecordVideo")
    print_table(Table(title, headings, rows))


if __name__ == "__main__":
    main()
