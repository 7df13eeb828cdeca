"""Threads that share lanes: each lane once, by whoever is free; asleep when idle, gone with their owner."""

import functools
import gc
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from panto_env.backend import (
    HELPER,
    JIT,
    LEADER,
    LaneThreads,
    found_anywhere,
    hand_out,
    kernel,
    new_shares,
    next_share,
    results_of,
    share_done,
)
from panto_env.base.machine import cores

pytestmark = pytest.mark.skipif(not JIT, reason="plain Python has but one thread")

LANES = 1001


@kernel
def mark(shares, cost, steps, done, who, order, first, last, size, role, patience):
    """Add ``steps`` to ``done`` in each lane, at some cost, and write to ``who`` whose share it was in."""
    if role == LEADER:
        hand_out(shares, first, last, size, done, who, order)
    taken = 0
    while True:
        begin, end = next_share(shares, role, taken, patience, first, last, size)
        if begin < 0:
            break
        taken += 1
        done, who, order = results_of(shares, role, done, who, order)
        for lane in range(begin, end):
            for k in range(cost):
                done[lane] += np.sqrt(float(k)) * 1e-30
            done[lane] += steps[0]
            who[lane] = role
            order[lane] = taken
        share_done(shares, role, begin == 0)
    return found_anywhere(shares, role, False)


class Batch:
    """A kernel whose lanes are shared."""

    def __init__(self, cost, threads=3):
        shares, self.add = new_shares(), np.zeros(1)
        call = functools.partial(mark, shares, cost, self.add)
        self.threads = LaneThreads(call, LANES, shares, threads)

    def step(self, steps=1):
        """What was done, and by whom, in arrays of this step."""
        done, who, order = (np.zeros(LANES) for _ in range(3))
        self.add[0] = steps
        self.threads.step(done, who, order)
        return done, who, order


def helpers():
    return {thread for thread in threading.enumerate() if thread.name == "panto"}


def test_each_lane_is_worked_on_once_in_each_step_and_in_its_arrays():
    batch, shared = Batch(2000), False
    for k in range(200):
        done, who, _ = batch.step(k)
        assert (done.round() == k).all()
        shared = shared or (who == HELPER).any()
    assert shared or cores() == 1


def test_the_leader_takes_shares_from_the_front_and_helpers_from_the_back():
    """So that lanes stay in the cache of a core."""
    batch = Batch(2000, threads=2)
    for _ in range(50):
        _, who, order = batch.step()
        leader, helper = (np.flatnonzero(who == role) for role in (LEADER, HELPER))
        assert len(leader) == 0 or len(helper) == 0 or leader.max() < helper.min()
        assert (np.diff(order[leader]) >= 0).all()
        assert (np.diff(order[helper]) <= 0).all()


def test_a_small_batch_is_not_shared():
    before = helpers()
    batch = Batch(0)
    for _ in range(20):
        _, who, _ = batch.step()
        assert (who != HELPER).all()
    assert helpers() <= before


def test_helpers_sleep_when_there_is_nothing_to_do_and_wake_again():
    batch = Batch(2000)
    for _ in range(20):
        batch.step()
    time.sleep(0.2)
    used = time.process_time()
    time.sleep(0.2)
    assert time.process_time() - used < 0.05
    shared = False
    for _ in range(200):
        done, who, _ = batch.step()
        assert (done.round() == 1).all()
        shared = shared or (who == HELPER).any()
    assert shared or cores() == 1


def test_threads_end_with_their_owner():
    before = helpers()
    batch = Batch(2000)
    for _ in range(20):
        batch.step()
    ours = helpers() - before
    assert len(ours) == 2
    del batch
    gc.collect()
    for thread in ours:
        thread.join(timeout=10)
    assert not any(thread.is_alive() for thread in ours)


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
warnings.simplefilter("ignore")
envs = gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=512)
envs.reset(seed=1)
actions = np.zeros(envs.action_space.shape, dtype=np.float32)
for _ in range(20):
    envs.step(actions)
assert envs.unwrapped.task._threads._helpers
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
