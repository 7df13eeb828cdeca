"""Standard output and error on a full disk, closed, or read by nobody: no traceback, no result lost."""

import errno
import io
import json
import os
import subprocess
import sys

import pytest

from panto_env import InputError, Trajectory
from panto_env.terminal import guarded_streams

from ..fuzz.lines import SHORT

FULL = "/dev/full"
COMMAND = f"{sys.executable} -c 'from panto_env.cli import main; main()'"
RUN = " ".join(["simulate", *SHORT])

pytestmark = pytest.mark.skipif(not os.path.exists(FULL), reason="no device that is always full")


# A buffer is what a command has unless it is told otherwise.
BUFFERED = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}


def shell(words, folder, environment=BUFFERED):
    return script(f"{COMMAND} {words}", folder, environment)


def script(text, folder, environment=BUFFERED):
    return subprocess.run(
        ["sh", "-c", text],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.parametrize("words", [f"{RUN} --json", "list", "--version", ""])
def test_output_on_a_full_disk_is_told_in_one_sentence(words, tmp_path):
    done = shell(f"{words} > {FULL}", tmp_path)
    assert done.stderr == "panto: Standard output cannot be written: No space left on device.\n"
    assert done.returncode == 2


def test_so_it_is_without_a_buffer(tmp_path):
    done = shell(f"list > {FULL}", tmp_path, BUFFERED | {"PYTHONUNBUFFERED": "1"})
    assert done.stderr == "panto: Standard output cannot be written: No space left on device.\n"
    assert done.returncode == 2


@pytest.mark.slow
def test_a_file_is_written_though_nothing_can_be_printed(tmp_path):
    for end in (f"> {FULL}", ">&-", "| true"):
        shell(f"{RUN} --output run.parquet {end}", tmp_path)
        assert Trajectory.load(tmp_path / "run.parquet").position[-1] > 0.0, end
        os.remove(tmp_path / "run.parquet")


@pytest.mark.parametrize("end", [f"2> {FULL}", "2>&-"])
def test_results_come_though_no_remark_can_be_made(end, tmp_path):
    """Neither the line about overwriting nor a warning ends the run, or strays into the result."""
    (tmp_path / "run.parquet").write_text("old")
    coarse = "simulate --distance 120 --spans 1-2 --time-step 2"
    done = shell(f"{coarse} --json --output run.parquet {end}", tmp_path)
    assert done.returncode == 0
    assert json.loads(done.stdout)["figures"]["mean"] > 0.0
    assert Trajectory.load(tmp_path / "run.parquet").position[-1] > 0.0
    refused = shell(f"simulate --speed -1 {end}", tmp_path)
    assert refused.returncode == 2
    assert refused.stdout == ""


@pytest.mark.parametrize("words", ["list"])
def test_where_nobody_reads_on_it_ends_without_a_word(words, tmp_path):
    done = script(f"({COMMAND} {words}; echo $? >&2) | true", tmp_path)
    assert done.stderr in ("1\n", "0\n")  # 0: it was done before the reader was gone


@pytest.mark.parametrize("words", ["list", f"{RUN} --json"])
def test_closed_output_is_no_error(words, tmp_path):
    done = shell(f"{words} >&-", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_within_the_body_output_that_fails_is_told_and_streams_are_put_back(monkeypatch):
    class Full(io.StringIO):
        def write(self, text):
            raise OSError(errno.ENOSPC, "No space left on device")

    full, remarks = Full(), Full()
    monkeypatch.setattr(sys, "stdout", full)
    monkeypatch.setattr(sys, "stderr", remarks)
    with guarded_streams():
        with pytest.raises(
            InputError, match=r"^Standard output cannot be written: No space left on device\.$"
        ):
            print("a result")
        print("a remark", file=sys.stderr)  # dropped
    assert sys.stdout is full
    assert sys.stderr is remarks
