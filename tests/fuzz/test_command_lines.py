"""Every command line of the table ends with 0, or with 2 and one sentence: never otherwise.

COMMANDS=400 is how many are tried, those by hand and others evenly chosen, each in a process of its own.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from .files import write_files, write_made_files
from .lines import BY_HAND, USUAL, command_lines

LIMIT = 180
"""Seconds that a command line may take: processes that import PyTorch take one minute on two busy cores."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    write_files(folder)
    write_made_files(folder)
    return folder


def end_of(line: tuple[str, ...], files: Path) -> str:
    """What kind of end it is, in a new folder that has all files and is the user's home."""
    with tempfile.TemporaryDirectory() as home:
        shutil.copytree(files, home, dirs_exist_ok=True)
        environment = {"HOME": home, "MINARI_DATASETS_PATH": f"{home}/data", "COLUMNS": "120"}
        command = [sys.executable, "-c", "from panto_env.cli import main; main()", *line]
        try:
            done = subprocess.run(
                command, cwd=home, env=os.environ | environment, capture_output=True, text=True, timeout=LIMIT
            )
        except subprocess.TimeoutExpired:
            return "not ended in time"
    said = [each for each in done.stderr.splitlines() if not each.startswith("panto: warning: ")]
    if done.returncode == 0:
        return "done"
    if done.returncode == 1 and ("It has no figures." in done.stdout or '"terminated": true' in done.stdout):
        return "ended early, as it says"
    if done.returncode == 2 and len(said) == 1 and re.fullmatch(r"panto: .*[.?!]", said[0]):
        return "refused in one sentence"
    return f"status {done.returncode}: {done.stderr[-1500:]}"


def ends_of(lines, files):
    with ThreadPoolExecutor(2) as pool:
        return dict(zip(lines, pool.map(lambda line: end_of(line, files), lines), strict=True))


def evenly(lines, count):
    return [lines[k * len(lines) // count] for k in range(min(count, len(lines)))]


def test_the_table_is_long_and_has_every_command():
    lines = command_lines()
    assert len(lines) == len(set(lines)) > 1000
    assert {line[0] for line in BY_HAND} > {"simulate", "sweep", "benchmark", "train", "dataset", "report"}
    assert {" ".join(words) for words in USUAL} >= {"train", "dataset verify", "submission check"}


@pytest.mark.slow
def test_what_a_bad_option_is_put_into_succeeds_without_it(files):
    """So that it is the bad option that a command line of the table is refused for."""
    ends = ends_of([(*command, *words) for command, words in USUAL.items()], files)
    assert {line: end for line, end in ends.items() if end != "done"} == {}


@pytest.mark.slow
def test_hundreds_of_command_lines_end_well(files):
    count, lines = int(os.environ.get("COMMANDS", "400")), command_lines()
    first = BY_HAND if count >= 2 * len(BY_HAND) else evenly(BY_HAND, count // 2)
    ends = ends_of([*first, *evenly(lines[len(BY_HAND) :], count - len(first))], files)
    good = ("done", "ended early, as it says", "refused in one sentence")
    assert {line: end for line, end in ends.items() if end not in good} == {}
    assert Counter(ends.values())["refused in one sentence"] > 0.625 * count
