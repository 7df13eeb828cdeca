import os
import subprocess
import sys
import time
from concurrent.futures import Future
from functools import partial

import pytest

from panto_env import InputError
from panto_env.analysis import pool
from panto_env.analysis.pool import collect, in_processes, in_threads, one_by_one, workers_for

RUNNERS = [one_by_one, in_threads, pytest.param(in_processes, marks=pytest.mark.slow)]


def later(seconds, result):
    time.sleep(seconds)
    return result


def fail():
    raise InputError("This job fails.")


def environment_and_process():
    return os.environ.get("OPENBLAS_NUM_THREADS"), os.getpid()


@pytest.mark.parametrize("run", RUNNERS)
def test_results_are_in_the_order_of_the_jobs_and_progress_counts_every_job(run):
    done = []
    jobs = [partial(later, 0.2, "first"), partial(later, 0.0, "second"), partial(later, 0.0, "third")]
    assert run(jobs, progress=lambda *counts: done.append(counts)) == ["first", "second", "third"]
    assert done == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("run", RUNNERS)
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


@pytest.mark.longer
def test_each_process_is_another_one_with_one_thread_of_linear_algebra(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    ((threads, process),) = in_processes([environment_and_process])
    assert threads == "1"
    assert process != os.getpid()
    assert (os.environ["OPENBLAS_NUM_THREADS"], os.environ.get("MKL_NUM_THREADS")) == ("7", None)


def test_the_number_of_workers(monkeypatch):
    """One per core, or as many as asked for up to four per core, but not more than there are jobs."""
    monkeypatch.setattr(pool, "cores", lambda: 3)
    given = {(50, None): 3, (2, None): 2, (0, None): 1, (50, 1): 1, (50, 12): 12, (50, 13): 12, (11, 12): 11}
    assert {each: workers_for(*each) for each in given} == given
    with pytest.raises(InputError, match=r"^workers must be 1 or more, not 0\.$"):
        workers_for(5, 0)


def test_each_result_is_reported_as_soon_as_it_is_there():
    first, second = Future(), Future()
    second.set_result("b")
    done = []

    def progress(*counts):
        done.append(counts)
        if not first.done():
            first.set_result("a")

    assert collect([first, second], progress) == ["a", "b"]
    assert done == [(1, 2), (2, 2)]
    assert collect([], None) == []


@pytest.mark.slow
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
