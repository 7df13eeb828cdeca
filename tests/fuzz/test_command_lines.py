"""The table of command lines: a sample of it quickly, some hundreds slowly."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from .lines import BY_HAND, USUAL, command_lines
from .processes import run_all

ROOT = Path(__file__).parents[2]


def tried(folder, *options):
    """Try command lines in a fresh process, which has no threads: how many ends of each kind."""
    command = [sys.executable, "-m", "tests.fuzz.command_lines", *options, "--folder", folder]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    *told, counts = done.stdout.splitlines() or [done.stderr]
    print(counts)
    assert done.returncode == 0, "\n".join([*told, counts, done.stderr])
    return json.loads(counts)


def test_the_table_is_long_and_has_every_command():
    lines = command_lines()
    assert len(lines) == len(set(lines)) > 1000
    assert {line[0] for line in BY_HAND} > {"simulate", "sweep", "benchmark", "train", "dataset", "report"}


@pytest.mark.slow
def test_what_a_bad_option_is_put_into_succeeds_without_it(tmp_path):
    """So that it is the bad option that a command line of the table is refused for."""
    assert tried(tmp_path, "--usual") == {"done": len(USUAL)}


@pytest.mark.slow
def test_hundreds_of_command_lines_end_well(tmp_path):
    ends = tried(tmp_path, "--count", "400")
    assert sum(ends.values()) == 400
    assert ends["refused in one sentence"] > 250


def exit_with_5():
    sys.exit(5)


def fail():
    raise ValueError("no")


def hang():
    while True:
        pass


def take_all_memory():
    bytearray(10**11)


def test_each_way_to_end_is_told(tmp_path):
    """Of processes made for it, in a fresh one that forks them."""
    cases = [exit_with_5, fail, hang, take_all_memory]
    ends = dict(run_all(cases, tmp_path, limit=2.0))
    assert [ends[k].status for k in range(4)] == [5, 1, None, 1]
    assert "ValueError: no" in ends[1].errors
    assert "MemoryError" in ends[3].errors
