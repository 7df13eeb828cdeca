"""Threads share lanes: each lane once in a step, the same bits with any number, gone with their owner."""

import functools
import gc
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

from panto_env.backend import JIT, LaneThreads, kernel, threads
from panto_env.control import Task
from panto_env.control.settings import run_settings

pytestmark = pytest.mark.skipif(not JIT, reason="in plain Python only one thread computes at a time")

LANES = 1001


@kernel
def mark(cost, add, done, calls, first, last):
    """Add a number to ``done`` in each lane, at some cost; count the call in ``calls`` of its first lane."""
    for lane in range(first, last):
        for k in range(cost):
            done[lane] += np.sqrt(float(k)) * 1e-30
        done[lane] += add[0]
    calls[first] += 1
    return last if add[0] == 7 else 0


class Batch:
    """A kernel whose lanes are shared."""

    def __init__(self, cost, threads=3):
        self.add = np.zeros(1)
        self.threads = LaneThreads(functools.partial(mark, cost, self.add), LANES, threads)

    def step(self, add=1):
        """What was done in each lane, the number of calls, and what the kernel answered."""
        done, calls = np.zeros(LANES), np.zeros(LANES)
        self.add[0] = add
        answer = self.threads.step(done, calls)
        return done, calls.sum(), answer


def helpers():
    return {thread for thread in threading.enumerate() if thread.name.startswith("panto")}


def test_each_lane_is_worked_on_once_in_each_step():
    batch, counts = Batch(2000), set()
    for k in range(20):
        done, calls, answer = batch.step(k)
        assert (done.round() == k).all()
        assert answer == (LANES if k == 7 else 0)  # the largest answer of all threads
        counts.add(calls)
    assert counts == {1, 3}


def test_a_small_batch_is_not_shared():
    before, batch = helpers(), Batch(0)
    assert {batch.step()[1] for _ in range(20)} == {1}
    assert helpers() <= before


@pytest.mark.longer
def test_threads_end_with_their_owner():
    before, batch = helpers(), Batch(2000)
    for _ in range(20):
        batch.step()
    ours = helpers() - before
    assert 1 <= len(ours) <= 2
    del batch
    gc.collect()
    for thread in ours:
        thread.join(timeout=10)
    assert not any(thread.is_alive() for thread in ours)


def test_bits_do_not_depend_on_the_number_of_threads(monkeypatch):
    settings = {"sensors": "realistic", "distance": 200.0}
    monkeypatch.setattr(threads, "WORTH", 0.0)
    seen = []
    for count in (1, 3):
        monkeypatch.setattr(threads, "cores", lambda count=count: count)
        task, random = Task(run_settings(settings), lanes=7), np.random.default_rng(0)
        task.reset(np.arange(7), np.random.default_rng(1))
        for step in range(20):
            skip = np.arange(7) == 3 if step % 5 == 4 else None
            task.step(random.uniform(-1, 1, (7, 1)), skip)
        assert (task._threads._pool is None) == (count == 1)
        seen.append([task.results.observation, task.results.values, task.plant.run.table])
    for one, other in zip(*seen, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_forked_process_steps_on_and_sees_what_its_parent_sees():
    """A child has none of the threads that helped its parent: it waited for them for ever."""
    code = """
import os, sys, warnings
import gymnasium, numpy as np
from panto_env.base import machine
machine.cores = lambda: 3
import panto_env.backend.threads as threads
threads.cores = machine.cores
threads.WORTH = 0.0
warnings.simplefilter("ignore")
envs = gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=8)
envs.reset(seed=1)
actions = np.zeros(envs.action_space.shape, dtype=np.float32)
for _ in range(20):
    envs.step(actions)
assert envs.unwrapped.task._threads._pool
child = os.fork()
for _ in range(20):
    seen = envs.step(actions)
digest = hash(seen[0].tobytes())
if child == 0:
    print(digest, flush=True)
    os._exit(0)
_, status = os.waitpid(child, 0)
print(digest, status)
"""
    environment = os.environ | {"PYTHONHASHSEED": "0"}
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment
    )
    assert told.returncode == 0, told.stderr
    of_child, of_parent, status = told.stdout.split()
    assert (of_child, status) == (of_parent, "0")
