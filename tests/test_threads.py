"""Threads that share lanes: each lane once, errors to the caller, gone with their owner."""

import gc
import threading
import time

import numpy as np
import pytest

from panto_env.backend import LaneThreads


def running():
    return {thread for thread in threading.enumerate() if thread.name == "panto"}


def test_each_lane_is_worked_on_once_in_each_work():
    threads, done = LaneThreads(100, 7, 3), np.zeros(100, int)

    def work(first, last):
        time.sleep(1e-4)
        done[first:last] += 1

    for k in range(20):
        threads.run(work)
        assert (done == k + 1).all()


@pytest.mark.parametrize("here", [True, False])
def test_an_error_in_any_thread_is_the_caller_s_and_spoils_no_later_work(here):
    threads, caller = LaneThreads(100, 7, 2), threading.current_thread()

    def work(first, last):
        time.sleep(1e-3)
        if (threading.current_thread() is caller) == here:
            raise ValueError("no")

    for _ in range(3):
        with pytest.raises(ValueError, match="no"):
            threads.run(work)
    done = np.zeros(100, int)
    threads.run(lambda first, last: np.add.at(done, np.arange(first, last), 1))
    assert (done == 1).all()


def test_threads_end_with_their_owner():
    before = running()
    threads = LaneThreads(100, 7, 3)
    threads.run(lambda first, last: None)
    ours = running() - before
    assert len(ours) == 2
    del threads
    gc.collect()
    for thread in ours:
        thread.join(timeout=10)
    assert not any(thread.is_alive() for thread in ours)
