"""A cold kernel is compiled by one of the processes that want it, and that is said."""

import os
import subprocess
import sys
import time

import pytest

from panto_env.backend import JIT

pytestmark = pytest.mark.skipif(not JIT, reason="nothing is compiled")

KERNEL = """
from panto_env.backend import kernel

@kernel
def twice(x):
    return 2.0 * x
"""
SETUP = """
import sys, time
from pathlib import Path
from module import twice

compile_really = twice._compiler.compile
def compile_slowly(*arguments):
    Path("compiling").touch()
    time.sleep(float(sys.argv[1]))
    return compile_really(*arguments)
twice._compiler.compile = compile_slowly
Path(f"ready-{sys.argv[2]}").touch()
while not Path("go").exists():
    time.sleep(0.01)
"""
CALL = (
    SETUP
    + "print(twice(1.5), *(sum(c.values()) for c in (twice.stats.cache_misses, twice.stats.cache_hits)))"
)
SHOWN = "import sys; sys.stderr.isatty = lambda: True\n"


@pytest.fixture
def start(tmp_path):
    """Starts a process that calls the kernel, whose compilation takes so many seconds longer."""
    (tmp_path / "module.py").write_text(KERNEL)
    started = []

    def start(seconds, code=CALL):
        command = [sys.executable, "-c", code, str(seconds), str(len(started))]
        environment = os.environ | {"PANTO_CACHE_DIR": str(tmp_path / "cache")}
        started.append(
            subprocess.Popen(
                command,
                cwd=tmp_path,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def wait_for(path):
    until = time.monotonic() + 60
    while not path.exists():
        assert time.monotonic() < until
        time.sleep(0.01)


def go(folder, count):
    for number in range(count):
        wait_for(folder / f"ready-{number}")
    (folder / "go").touch()


def test_four_cold_processes_compile_once_and_say_so(tmp_path, start):
    processes = [start(1.0, SHOWN + CALL) for _ in range(4)]
    go(tmp_path, 4)
    told = [process.communicate(timeout=60) for process in processes]
    assert sorted(out for out, _ in told) == ["3.0 0 1\n"] * 3 + ["3.0 1 0\n"]
    errors = sorted(error for _, error in told)
    assert errors[0].startswith("Compiling kernels, about ")
    assert [error.startswith("Waiting for another process that compiles") for error in errors[1:]] == [
        True
    ] * 3
    assert [error.count("\n") for error in errors] == [1] * 4


def test_a_process_that_dies_while_it_compiles_blocks_nobody(tmp_path, start):
    dying = start(600.0)
    go(tmp_path, 1)
    wait_for(tmp_path / "compiling")
    heir = start(0.0)
    with pytest.raises(subprocess.TimeoutExpired):
        heir.communicate(timeout=3)
    dying.kill()
    assert heir.communicate(timeout=60) == ("3.0 1 0\n", "")


def test_what_is_redirected_says_nothing_and_a_compiled_kernel_neither(tmp_path, start):
    (tmp_path / "go").touch()
    assert start(0.0).communicate(timeout=60) == ("3.0 1 0\n", "")
    assert start(0.0, SHOWN + CALL).communicate(timeout=60) == ("3.0 0 1\n", "")


def test_without_locks_of_files_each_compiles_for_itself(tmp_path, start):
    broken = (
        "from panto_env.backend import once\n"
        "def refuse(*_, **__): raise NotImplementedError('no flock')\n"
        "once.FileLock.acquire = refuse\n"
    )
    processes = [start(0.5, broken + CALL) for _ in range(2)]
    go(tmp_path, 2)
    assert [process.communicate(timeout=60)[0] for process in processes] == ["3.0 1 0\n"] * 2
