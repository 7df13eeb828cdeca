import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from functools import partial
from types import SimpleNamespace

import pytest

from panto_env import InputError
from panto_env.analysis import pool
from panto_env.analysis import pool as worker
from panto_env.analysis.pool import collect, in_processes, in_threads, one_by_one, workers_for
from panto_env.base.machine import cores


def later(seconds, result):
    time.sleep(seconds)
    return result


def fail():
    raise InputError("This job fails.")


def environment_and_process():
    return os.environ.get("OPENBLAS_NUM_THREADS"), os.getpid()


@pytest.mark.parametrize("run", [one_by_one, in_threads, in_processes])
def test_results_are_in_the_order_of_the_jobs_and_progress_counts_every_job(run):
    done = []
    jobs = [partial(later, 0.2, "first"), partial(later, 0.0, "second"), partial(later, 0.0, "third")]
    assert run(jobs, progress=lambda *counts: done.append(counts)) == ["first", "second", "third"]
    assert done == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("run", [one_by_one, in_threads, in_processes])
def test_the_error_of_a_job_is_raised(run):
    with pytest.raises(InputError, match="This job fails"):
        run([fail, partial(later, 0.0, "never mind")])


def test_jobs_that_have_not_begun_are_cancelled_after_an_error():
    begun = []

    def slow():
        begun.append(1)
        time.sleep(0.01)

    with pytest.raises(InputError):
        in_threads([fail, *[slow] * 1000], workers=1)
    assert len(begun) < 1000


def test_each_process_is_another_one_with_one_thread_of_linear_algebra(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    ((threads, process),) = in_processes([environment_and_process])
    assert threads == "1"
    assert process != os.getpid()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"


def test_there_are_as_many_threads_as_cores_unless_told_otherwise():
    def name():
        time.sleep(0.01)
        return threading.current_thread().name

    assert len(set(in_threads([name] * 50))) <= cores()
    assert len(set(in_threads([name] * 50, workers=3))) <= 3


@pytest.mark.parametrize(
    ("jobs", "workers", "taken"),
    [
        (50, None, 3),  # one per core
        (2, None, 2),  # but not more than there are jobs
        (1, None, 1),
        (0, None, 1),
        (50, 1, 1),
        (50, 2, 2),
        (50, 12, 12),  # at most four per core
        (50, 13, 12),
        (11, 12, 11),
    ],
)
def test_the_number_of_workers(monkeypatch, jobs, workers, taken):
    monkeypatch.setattr(pool, "cores", lambda: 3)
    assert workers_for(jobs, workers) == taken


@pytest.mark.parametrize("workers", [0, -1])
def test_less_than_one_worker_is_refused(workers):
    with pytest.raises(InputError, match=f"^workers must be 1 or more, not {workers}.$"):
        workers_for(5, workers)


def test_each_result_is_taken_with_its_place_as_soon_as_it_is_there():
    first, second = Future(), Future()
    second.set_result("b")
    taken, done = [], []

    def take(place, result):
        taken.append((place, result))
        if not first.done():
            first.set_result("a")

    assert collect([first, second], lambda *counts: done.append(counts), take) == ["a", "b"]
    assert taken == [(1, "b"), (0, "a")]
    assert done == [(1, 2), (2, 2)]
    assert collect([], None) == []


def test_the_environment_is_as_it_was_after_processes_and_after_their_error(monkeypatch):
    given = {"OPENBLAS_NUM_THREADS": None, "MKL_NUM_THREADS": "5", "OMP_NUM_THREADS": None}
    for name, value in given.items():
        monkeypatch.setenv(name, value or "1")
        if value is None:
            monkeypatch.delenv(name)

    def during():
        with pool._one_thread_of_linear_algebra():
            assert {name: os.environ[name] for name in given} == dict.fromkeys(given, "1")
            fail()

    with pytest.raises(InputError):
        during()
    assert {name: os.environ.get(name) for name in given} == given


def test_a_script_without_main_guard_is_told_what_to_do(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from functools import partial\n"
        "from panto_env.analysis.pool import in_processes\n"
        "in_processes([partial(print, 'done')])\n"
    )
    result = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert result.returncode != 0
    assert "make this call under `if __name__ == '__main__':`" in result.stderr


def test_a_worker_ends_at_once_when_its_parent_is_gone_and_never_keeps_itself_alive(monkeypatch):
    """What a worker does first, here: a pipe is its parent, and closing the pipe is the parent's end."""
    ours, parents = os.pipe()
    ended, handler = threading.Event(), signal.getsignal(signal.SIGINT)
    statuses = []
    monkeypatch.setattr(worker, "parent_process", lambda: SimpleNamespace(sentinel=ours))
    monkeypatch.setattr(worker.os, "_exit", lambda status: (statuses.append(status), ended.set()))
    try:
        worker.end_with_parent()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN, "an interrupt is the parent's"
        (watch,) = [thread for thread in threading.enumerate() if thread.name == "panto-parent"]
        assert watch.daemon, "the worker would wait for its parent, which waits for it"
        assert not ended.wait(0.1)
        os.close(parents)
        assert ended.wait(10)
        watch.join(10)
    finally:
        signal.signal(signal.SIGINT, handler)
        os.close(ours)
    assert statuses == [worker.ORPHANED] == [1]
