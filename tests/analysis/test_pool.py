import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from types import SimpleNamespace

import pytest

from panto_env import InputError
from panto_env.analysis import worker
from panto_env.analysis.pool import in_processes, in_threads, one_by_one
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
