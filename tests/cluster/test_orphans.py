"""What a command has started ends with it, however it is ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are read from /proc")

JOBS = """
import sys, time
from functools import partial
from pathlib import Path
from panto_env.analysis.pool import in_processes

def work(name):
    Path(name).touch()
    time.sleep(600)

if __name__ == "__main__":
    in_processes([partial(work, f"{sys.argv[1]}/begun-{k}") for k in range(2)], workers=2)
"""
LONG = """
import time
from pathlib import Path
import numpy as np

class Slow:
    def reset(self, context):
        pass
    def act(self, observation):
        Path(__file__).with_suffix(".begun").touch()
        time.sleep(0.05)
        return np.zeros(1)
"""
BENCHMARK = ("benchmark", "slow.py:Slow", "--speed", "300", "--seeds", "4", "--workers", "2")


def family(process: int) -> list[int]:
    """The process and all that it has started and that they have, as far as they live."""
    parents: dict[int, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = stat.read_text().rpartition(")")[2].split()[:2]
        except OSError:  # it has just ended
            continue
        if state not in "ZX":
            parents[int(stat.parent.name)] = int(parent)
    found = [process]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found[1:]


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def wait_for(condition, seconds):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    assert condition()


def ended(command, begun, number, folder):
    """Start a command, wait until its workers work, end it by a signal: its status and what it wrote."""
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)
    children: list[int] = []
    try:
        wait_for(lambda: all(path.exists() for path in begun) or process.poll() is not None, 60)
        assert process.poll() is None, process.stderr.read()
        children = family(process.pid)
        assert len(children) >= 2
        process.send_signal(number)
        _, errors = process.communicate(timeout=60)  # on a busy machine
        wait_for(lambda: not any(map(alive, children)), 30)
        return process.returncode, errors
    finally:
        process.kill()
        for child in filter(alive, children):
            os.kill(child, signal.SIGKILL)


@pytest.mark.slow
def test_workers_end_with_their_parent(tmp_path):
    (tmp_path / "jobs.py").write_text(JOBS)
    begun = [tmp_path / "begun-0", tmp_path / "begun-1"]
    status, _ = ended([sys.executable, "jobs.py", str(tmp_path)], begun, signal.SIGKILL, tmp_path)
    assert status == -signal.SIGKILL


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_benchmark_s_workers_end_with_it(number, tmp_path):
    """And it says so, where it is left the time to."""
    (tmp_path / "slow.py").write_text(LONG)
    command = [sys.executable, "-c", "from panto_env.cli import main; main()", *BENCHMARK]
    status, errors = ended(command, [tmp_path / "slow.begun"], number, tmp_path)
    said = "panto: Stopped by SIGTERM before it was done.\n" if number == signal.SIGTERM else ""
    assert (status, errors) == (128 + number, said)
