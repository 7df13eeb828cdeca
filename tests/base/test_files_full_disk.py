"""A disk that is full when a result is to be written: it is printed, and the old file stays."""

import errno
import json
import os

import pytest
from typer.testing import CliRunner

from panto_env import InputError, studies
from panto_env.analysis import simulation
from panto_env.base import files
from panto_env.cli import make_app
from panto_env.cli import studies as reproduce

from ..command import panto
from ..full_disk import largest_file
from ..fuzz.lines import SHORT

LIMIT = 8192
"""Bytes that a file may have once the run is over: a result has more."""
COMMANDS = {
    "simulate": (["simulate", *SHORT, "--output", "run.parquet"], "run.parquet"),
    "simulate as CSV": (["simulate", *SHORT, "--output", "run.csv"], "run.csv"),
    "simulate as workbook": (["simulate", *SHORT, "--output", "run.xlsx"], "run.xlsx"),
    "simulate --json": (["simulate", *SHORT, "--json", "--output", "run.parquet"], "run.parquet"),
    "simulate --plot": (["simulate", *SHORT, "--plot", "run.png"], "run.png"),
    "simulate --plot of vectors": (["simulate", *SHORT, "--plot", "run.pdf"], "run.pdf"),
}


@pytest.fixture
def no_room(monkeypatch):
    """Files of more than ``LIMIT`` bytes cannot be written once a run is over."""
    run = simulation.simulate

    def then_full(**settings):
        done = run(**settings)
        limit(LIMIT)
        return done

    monkeypatch.setattr(simulation, "simulate", then_full)
    with largest_file() as limit:
        yield


@pytest.mark.parametrize("name", COMMANDS)
def test_what_was_computed_is_printed_and_the_old_file_stays(name, no_room, tmp_path):
    words, file = COMMANDS[name]
    (tmp_path / file).write_text("old")
    done = panto(*words, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    *_, last = done.stderr.splitlines()
    assert last == f"panto: {file} cannot be written: File too large."
    if "--json" in words:
        assert json.loads(done.stdout)["figures"]["mean"] > 0
    else:
        assert "standard deviation" in done.stdout
    assert (tmp_path / file).read_text() == "old"
    assert os.listdir(tmp_path) == [file]


@pytest.fixture
def full(monkeypatch):
    """A disk that takes no file at its place any more."""

    def replace(self, target):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.Path, "replace", replace)


@pytest.mark.parametrize(
    ("words", "file", "shown"),
    [
        (["simulate", *SHORT, "--output", "out.parquet"], "out.parquet", "standard deviation"),
        (["sweep", "speed_kmh=200,250", *SHORT, "--output", "out.csv"], "out.csv", "250"),
        (["sweep", "speed_kmh=200,250", *SHORT, "--output", "out.parquet"], "out.parquet", "250"),
        (
            [
                "benchmark",
                "passive",
                *SHORT[:4],
                "--speed",
                "250",
                "--seeds",
                "1",
                "--workers",
                "1",
                "--output",
                "out.json",
            ],
            "out.json",
            "passive",
        ),
    ],
)
def test_a_result_is_printed_before_it_fails_to_be_written(words, file, shown, full, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(make_app(), words)
    assert isinstance(result.exception, InputError), result.output
    assert str(result.exception) == f"{file} cannot be written: No space left on device."
    assert shown in result.stdout
    assert not os.listdir(tmp_path)


def test_one_file_that_fails_does_not_keep_the_others_from_being_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    real = files.Path.replace

    def replace(self, target):
        if str(target).endswith(".parquet"):
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(self, target)

    monkeypatch.setattr(files.Path, "replace", replace)
    result = CliRunner().invoke(make_app(), ["simulate", *SHORT, "--output", "a.parquet", "--plot", "a.png"])
    assert isinstance(result.exception, InputError)
    assert os.listdir(tmp_path) == ["a.png"]


@pytest.mark.parametrize("json_wanted", [False, True])
def test_studies_are_printed_and_the_others_go_on(json_wanted, full, tmp_path, monkeypatch, capsys):
    made = studies.Outcome("a study", (studies.Comparison("m", "kg", 1.25, 1, 1, 2),))
    monkeypatch.setattr(reproduce.studies, "find_study", lambda name: lambda report: made)
    with pytest.raises(InputError, match="cannot be written: No space left on device"):
        reproduce.reproduce("all", output=tmp_path / "new", json=json_wanted)
    told = capsys.readouterr().out
    assert told.count("1.25") == len(studies.STUDIES)
    if json_wanted:
        assert list(json.loads(told)) == list(studies.STUDIES)
    assert not [path for path in (tmp_path / "new").rglob("*") if path.is_file()]


def test_a_model_is_whole_or_not_there(full, tmp_path):
    pytest.importorskip("torch")
    from panto_agents.model_file import export_model
    from panto_agents.stored import FOLDER

    (tmp_path / "out.safetensors").write_text("old")
    with pytest.raises(InputError, match=r"out\.safetensors cannot be written: No space left on device"):
        export_model(FOLDER / "head.safetensors", tmp_path / "out.safetensors")
    assert (tmp_path / "out.safetensors").read_text() == "old"
    assert os.listdir(tmp_path) == ["out.safetensors"]
