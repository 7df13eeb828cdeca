"""Outputs that cannot be written are refused before any work begins, with exit status 2 and one line."""

import os
import subprocess
import sys

import pytest
import typer
from typer.testing import CliRunner

from panto_env import InputError
from panto_env.cli import make_app

FILE, FOLDER = "file", "folder"
OUTPUTS = {
    "simulate --output": (["simulate"], FILE, ".parquet"),
    "simulate --plot": (["simulate"], FILE, ".png"),
    "film --output": (["film", "passive"], FILE, ".mp4"),
    "sweep --output": (["sweep", "speed_kmh=250"], FILE, ".csv"),
    "sweep --plot": (["sweep", "speed_kmh=250"], FILE, ".svg"),
    "validate --plot": (["validate"], FILE, ".png"),
    "identify --output": (["identify", "rig.csv"], FILE, ".toml"),
    "identify --plot": (["identify", "rig.csv"], FILE, ".pdf"),
    "estimate --output": (["estimate", "rig.csv", "--pantograph", "dsa380"], FILE, ".parquet"),
    "estimate --plot": (["estimate", "rig.csv", "--pantograph", "dsa380"], FILE, ".png"),
    "record --output": (["record", "a.csv"], FILE, ".csv"),
    "record --plot": (["record", "a.csv"], FILE, ".png"),
    "record --html": (["record", "a.csv"], FILE, ".html"),
    "compare --plot": (["compare", "a.csv", "a.parquet"], FILE, ".png"),
    "compare --html": (["compare", "a.csv", "a.parquet"], FILE, ".html"),
    "fit --output": (["fit", "a.csv", "--line", "re250", "--pantograph", "dsa380"], FILE, ".toml"),
    "fit --values": (["fit", "a.csv", "--line", "re250", "--pantograph", "dsa380"], FILE, ".csv"),
    "fit --pantograph-output": (
        ["fit", "a.csv", "--line", "re250", "--pantograph", "dsa380"],
        FILE,
        ".toml",
    ),
    "fit --plot": (["fit", "a.csv", "--line", "re250", "--pantograph", "dsa380"], FILE, ".png"),
    "fit --keep": (["fit", "a.csv", "--line", "re250", "--pantograph", "dsa380"], FILE, ".safetensors"),
    "drift --plot": (["drift", "a.safetensors", "b.safetensors"], FILE, ".png"),
    "drift --values": (["drift", "a.safetensors", "b.safetensors"], FILE, ".csv"),
    "diagnose --plot": (["diagnose", "a.parquet", "--healthy", "b.parquet"], FILE, ".png"),
    "speed --plot": (["speed"], FILE, ".png"),
    "rig --plot": (["rig"], FILE, ".png"),
    "line --output": (["line", "re250"], FILE, ".toml"),
    "line --plot": (["line", "re250"], FILE, ".png"),
    "list --droppers": (["list", "re250"], FILE, ".csv"),
    "simulate --figures": (["simulate"], FILE, ".csv"),
    "simulate --droppers": (["simulate"], FILE, ".xlsx"),
    "report --figures": (["report", "a.parquet"], FILE, ".csv"),
    "report --droppers": (["report", "a.parquet"], FILE, ".csv"),
    "benchmark --output": (["benchmark", "passive"], FILE, ".json"),
    "benchmark --plot": (["benchmark", "passive"], FILE, ".png"),
    "benchmark --html": (["benchmark", "passive"], FILE, ".html"),
    "tune --output": (["tune", "skyhook"], FILE, ".toml"),
    "oracle --output": (["oracle"], FILE, ".json"),
    "oracle --plot": (["oracle"], FILE, ".png"),
    "report --output": (["report", "a.json"], FILE, ".html"),
    "evaluate --plot": (["evaluate", "passive"], FILE, ".png"),
    "reproduce --output": (["reproduce", "paper2"], FOLDER, ""),
    "train --output": (["train", "ppo"], FOLDER, ""),
    "trainings --output": (["trainings", "ppo"], FOLDER, ""),
    "ablation --output": (["ablation", "ablation"], FOLDER, ""),
    "dataset episodes --output": (["dataset", "episodes", "dataset-known-line"], FOLDER, ""),
    "dataset designs --output": (["dataset", "designs"], FOLDER, ""),
}
"""By option: the command without it, whether it names a file or a folder, and a suffix that it may have."""
OF_FILES = {
    "no folder": ("nowhere/out{suffix}", "there is no folder nowhere, so make it first"),
    "a file for its folder": ("file/out{suffix}", "is not a folder"),
    "a folder of its name": ("folder{suffix}", "it is a folder"),
    "a pipe": ("pipe{suffix}", "it is not a regular file"),
    "a link to itself": ("link{suffix}", "its symbolic links lead round in a circle"),
    "no suffix": ("out", "must end in "),
    "another suffix": ("out.docx", "must end in "),
    "a name too long": ("o" * 5000 + "{suffix}", "the maximum is 200 bytes for a name"),
}
OF_FOLDERS = {
    "a file for it": ("file", "file"),
    "a file for the one above": ("file/out", "file/out"),
    "a pipe": ("pipe", "pipe"),
    "a name too long": ("o" * 5000, "the maximum is 200 bytes for a name"),
}
CASES = [
    (option, trouble)
    for option, (_, kind, _) in OUTPUTS.items()
    for trouble in (OF_FILES if kind == FILE else OF_FOLDERS)
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("old")
    (tmp_path / "a.json").write_text("{}")
    return tmp_path


@pytest.fixture
def no_work(monkeypatch):
    """Whatever simulates, fails the test."""

    def work(*_, **__):
        pytest.fail("work began")

    for name in ("panto_env.control.Task.__init__", "panto_env.analysis.pool.in_processes"):
        monkeypatch.setattr(name, work)


def refused(words):
    result = CliRunner().invoke(make_app(), words)
    assert isinstance(result.exception, InputError), result.output
    assert result.stdout == ""
    return str(result.exception)


@pytest.mark.parametrize(("option", "trouble"), CASES)
def test_an_output_that_can_t_be_written_is_refused_before_the_work(option, trouble, folder, request):
    words, kind, suffix = OUTPUTS[option]
    if words[0] not in (
        "tune",
        "train",
        "trainings",
        "ablation",
    ):  # whose settings make a task, without a step
        request.getfixturevalue("no_work")
    name, message = (OF_FILES if kind == FILE else OF_FOLDERS)[trouble]
    path = name.format(suffix=suffix)
    if trouble == "a pipe":
        os.mkfifo(path)
    elif trouble == "a folder of its name":
        os.mkdir(path)
    elif trouble == "a link to itself":
        os.symlink(path, path)
    before = sorted(folder.rglob("*"))
    told = refused([*words, f"--{option.rpartition('--')[2]}", path])
    assert message in told
    assert "\n" not in told
    assert sorted(folder.rglob("*")) == before


NAMES = ("output", "plot", "html", "figures", "droppers", "values", "keep", "pantograph_output")


def outputs(command, words=()):
    """Options and arguments of a command, and of those in its group, that name something to write."""
    if isinstance(command, typer.core.TyperGroup):
        for name in command.list_commands(None):
            yield from outputs(command.get_command(None, name), (*words, name))
        return
    for parameter in command.params:
        if parameter.name in NAMES:
            yield f"{' '.join(words)} {parameter.opts[0]}"


def test_every_output_of_every_command_is_tried():
    known = {*OUTPUTS, "export output"}  # an argument: below
    assert set(outputs(typer.main.get_command(make_app()))) == known


def test_an_argument_that_can_t_be_written_is_refused(folder):
    assert "there is no folder nowhere" in refused(["export", "model.safetensors", "nowhere/out.safetensors"])
    assert "must end in .safetensors" in refused(["export", "model.safetensors", "out.onnx"])


def test_the_command_ends_with_2_and_one_line(folder):
    command = [sys.executable, "-c", "from panto_env.cli import main; main()"]
    done = subprocess.run(
        [*command, "simulate", "--output", "nowhere/out.parquet"], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("panto: nowhere/out.parquet cannot be written: ")
