"""Files are written whole or not at all; what cannot be written is refused before any work."""

import errno
import json
import os
import re
import subprocess
import sys

import pytest
import typer
from filelock import FileLock

from panto_baselines.oracle import stored
from panto_baselines.policies.lanes_law import gain_file, load_gains
from panto_env import InputError, Trajectory, studies
from panto_env.analysis import simulation
from panto_env.base import files
from panto_env.base.checksums import with_checksum
from panto_env.base.files import alone_in, check_output, make_folder, write_whole
from panto_env.cli import studies as reproduce

from ..command import panto, whole
from ..full_disk import largest_file
from ..fuzz.lines import QUICK, SHORT, USUAL

PANTO = f"{sys.executable} -c 'from panto_env.cli import main; main()'"
BENCHMARK = ("benchmark", "passive", *QUICK, "--speed", "250", "--seeds", "1", "--workers", "1")
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
RUN = f"{PANTO} simulate {' '.join(SHORT)} --json --output run.parquet"


@pytest.fixture
def old(tmp_path, monkeypatch):
    """A file that is there already, in a folder of its own, which is the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out.json").write_text("old")
    yield tmp_path / "out.json"
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".out")]


def write(path):
    with write_whole(path) as temporary:
        temporary.write_text("new")


def fail(*_, **__):
    raise FULL


@pytest.mark.parametrize("where", ["the body", "os.fsync", "os.replace"])
def test_a_disk_that_fails_leaves_the_old_file_and_nothing_else(where, old, monkeypatch):
    if where != "the body":
        monkeypatch.setattr(where, fail)
    message = r"out\.json cannot be written: No space left on device\.$"
    with pytest.raises(InputError, match=message), write_whole(old) as temporary:  # noqa: PT012
        temporary.write_text("half")
        if where == "the body":
            fail()
    assert old.read_text() == "old"
    assert os.listdir() == ["out.json"]


def test_a_file_is_on_the_disk_before_it_takes_the_old_one_s_place(old, monkeypatch):
    done = []
    monkeypatch.setattr(os, "fsync", lambda number: done.append(os.fstat(number).st_ino))
    write(old)
    assert done == [old.stat().st_ino]
    assert old.read_text() == "new"


def test_a_link_stays_and_what_it_leads_to_is_replaced(old, tmp_path):
    link = tmp_path / "link.png"
    link.symlink_to("out.json")
    check_output(link, (".png",))
    with write_whole(link) as temporary:
        assert temporary.suffix == ".png"  # by which it is written
        temporary.write_text("new")
    assert link.is_symlink()
    assert old.read_text() == "new"


def test_a_file_may_be_read_and_written_by_whom_the_user_wants(old, tmp_path):
    before = os.umask(0o027)
    try:
        write(old)
        (tmp_path / "plain").write_text("as any other")
    finally:
        os.umask(before)
    assert old.stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_suffixes_that_a_file_may_have_are_named(tmp_path):
    check_output(tmp_path / "out.PNG", (".png", ".svg"))
    for suffixes, wanted in (((".png",), "must end in .png."), ((".png", ".svg"), "one of .png, .svg.")):
        with pytest.raises(InputError, match=f"{re.escape(wanted)}$"):
            check_output(tmp_path / "out.doc", suffixes)


def test_a_full_disk_is_found_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setattr(files.Path, "write_bytes", fail)
    with pytest.raises(InputError, match=r"out\.json cannot be written: No space left on device\.$"):
        check_output(tmp_path / "out.json", (".json",))
    with pytest.raises(InputError, match=r"^Nothing can be written into the folder .*: No space left"):
        make_folder(tmp_path / "folder")
    assert os.listdir(tmp_path) == ["folder"]


def test_a_folder_that_another_process_holds_is_refused_at_once(tmp_path):
    with FileLock(tmp_path / ".lock"), pytest.raises(InputError, match="Another process trains into"):  # noqa: SIM117
        with alone_in(tmp_path, "trains into"):
            pass
    with alone_in(tmp_path, "trains into"):  # now it is free
        assert (tmp_path / ".lock").exists()


# --- outputs of commands ----------------------------------------------------------------------------

NAMES = ("output", "plot", "html", "figures", "droppers", "values", "keep", "pantograph_output")
OF_FOLDERS = {
    "reproduce": ("paper2",),
    "train": ("ppo",),
    "trainings": ("ppo",),
    "ablation": ("ablation",),
    "design": ("file",),
    "dataset episodes": ("dataset-known-line",),
    "dataset designs": (),
}
"""Commands whose output is a folder, and what else they are given."""


def outputs(command, words=()):
    """Options of a command, and of those in its group, that name something to write."""
    for name, below in getattr(command, "commands", {}).items():
        yield from outputs(below, (*words, name))
    for parameter in () if isinstance(command, typer.core.TyperGroup) else command.params:
        if parameter.name in NAMES:
            flag = parameter.opts[0] if parameter.param_type_name == "option" else ""
            yield pytest.param(words, flag, id=" ".join((*words, flag)))


def refused(*words):
    done = panto(*words)
    assert (done.returncode, done.stdout) == (2, "")
    *_, last = done.stderr.splitlines()
    return last


@pytest.mark.slow
@pytest.mark.parametrize(("words", "flag"), list(outputs(whole())))
def test_an_output_that_can_t_be_written_is_refused_before_the_work(words, flag, old, tmp_path, monkeypatch):
    name = " ".join(words)
    given = (*words, *OF_FOLDERS.get(name, USUAL[words]), *([flag] if flag else []))
    if "--output" in given[:-1]:
        place = given.index("--output")
        given = given[:place] + given[place + 2 :]
    if not flag:  # the last argument
        given = given[:-1]
    if name not in ("tune", "train", "trainings", "ablation"):  # whose settings make a task, without a step
        for work in ("panto_env.control.Task.__init__", "panto_env.analysis.pool.in_processes"):
            monkeypatch.setattr(work, lambda *_, **__: pytest.fail("work began"))
    (tmp_path / "file").write_text("old")
    if name in OF_FOLDERS:
        for path in ("file", "file/out"):
            assert path in refused(*given, path)
        return
    suffix = re.search(r"must end in (?:one of )?(\.\w+)", refused(*given, "out"))[1]
    assert "must end in " in refused(*given, "out.docx")
    for folder in ("nowhere", "file"):
        assert f"there is no folder {folder}, so make it first." in refused(*given, f"{folder}/out{suffix}")
    os.mkdir(f"folder{suffix}")
    assert "it is a folder" in refused(*given, f"folder{suffix}")
    assert sorted(os.listdir()) == sorted(["file", f"folder{suffix}", "out.json"])


# --- a disk that fills up during the run --------------------------------------------------------------


@pytest.mark.parametrize("options", [["--output", "run.parquet"], ["--json", "--output", "run.xlsx"]])
def test_what_was_computed_is_printed_and_the_old_file_stays(options, tmp_path, monkeypatch):
    run, file = simulation.simulate, options[-1]

    def then_full(**settings):
        done = run(**settings)
        limit(8192)  # bytes that a file may have
        return done

    monkeypatch.setattr(simulation, "simulate", then_full)
    (tmp_path / file).write_text("old")
    with largest_file() as limit:
        done = panto("simulate", *SHORT, *options, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"panto: {file} cannot be written: File too large."
    if "--json" in options:
        assert json.loads(done.stdout)["figures"]["mean"] > 0
    assert len(done.stdout) > 1000
    assert (tmp_path / file).read_text() == "old"
    assert os.listdir(tmp_path) == [file]


@pytest.mark.longer
def test_one_file_that_fails_does_not_keep_the_others_from_being_written(old, monkeypatch):
    replace = files.Path.replace
    monkeypatch.setattr(
        files.Path, "replace", lambda path, to: fail() if "parquet" in str(to) else replace(path, to)
    )
    done = panto("simulate", *SHORT, "--output", "a.parquet", "--plot", "a.png", "--figures", "a.csv")
    assert done.stderr == "panto: a.parquet cannot be written: No space left on device.\n"
    assert sorted(os.listdir()) == ["a.csv", "a.png", "out.json"]


@pytest.mark.parametrize("wanted", [False, True])
def test_studies_are_printed_and_the_others_go_on(wanted, tmp_path, monkeypatch, capsys):
    made = studies.Outcome("a study", (studies.Comparison("m", "kg", 1.25, 1, 1, 2),))
    monkeypatch.setattr(reproduce.studies, "find_study", lambda name: lambda report: made)
    monkeypatch.setattr(files.Path, "replace", fail)
    with pytest.raises(InputError, match="cannot be written: No space left on device"):
        reproduce.reproduce("all", output=tmp_path / "new", json=wanted)
    told = capsys.readouterr().out
    assert told.count("1.25") == len(studies.STUDIES)
    assert not wanted or list(json.loads(told)) == list(studies.STUDIES)
    assert not [path for path in (tmp_path / "new").rglob("*") if path.is_file()]


# --- what is there already ----------------------------------------------------------------------------


@pytest.mark.longer
def test_overwriting_is_told_in_one_line(tmp_path):
    words = ("simulate", *SHORT, "--output", "run.parquet")
    first = panto(*words, cwd=tmp_path)
    assert (first.returncode, first.stderr) == (0, "")
    before = (tmp_path / "run.parquet").read_bytes()
    (tmp_path / "run.parquet").write_text("old")
    second = panto(*words, cwd=tmp_path)
    assert second.stderr == "panto: warning: run.parquet exists already and will be overwritten.\n"
    assert (tmp_path / "run.parquet").read_bytes() == before


@pytest.mark.longer
def test_a_benchmark_is_overwritten_only_if_asked(old, monkeypatch):
    words = (*BENCHMARK, "--output", "out.json")
    assert "out.json exists already; give another --output, or --force" in refused(*words)
    monkeypatch.setattr(files.Path, "replace", fail)
    done = panto(*words, "--force")
    assert (done.returncode, "passive" in done.stdout) == (2, True)
    warned, failed = done.stderr.splitlines()
    assert warned.endswith("out.json exists already and will be overwritten.")
    assert failed == "panto: out.json cannot be written: No space left on device."
    assert (old.read_text(), os.listdir()) == ("old", ["out.json"])


def test_an_oracle_and_gains_that_would_be_lost_are_kept(old, tmp_path, monkeypatch):
    other = {"version": "0", "command": "panto oracle", "cells": [{"asked": {"fingerprint": "of another"}}]}
    old.write_text(json.dumps(with_checksum(other)))
    monkeypatch.setattr("panto_baselines.oracle.search.find", lambda *_: pytest.fail("it searched"))
    words = ("oracle", *QUICK, "--speed", "250", "--seed", "0", "--output", "out.json")
    assert "out.json exists already" in refused(*words)
    assert stored.read("out.json") == other
    mine = tmp_path / "skyhook.toml"
    mine.write_bytes(gain_file("skyhook").read_bytes())
    before = load_gains(mine)
    expected = "already holds gains for en50318-2002 on en50318-2002, actuator on 'frame'; give another"
    assert expected in refused("tune", "skyhook", "--output", mine)
    assert load_gains(mine) == before


# --- standard output and error ------------------------------------------------------------------------


def shell(text, folder):
    """A buffer is what a command has unless it is told otherwise."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run(["sh", "-c", text], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_output_on_a_full_disk_is_told_in_one_sentence(tmp_path):
    done = shell(f"{PANTO} list > /dev/full", tmp_path)
    assert done.stderr == "panto: [Errno 28] No space left on device.\n"
    assert done.returncode == 2


@pytest.mark.slow
def test_a_file_is_written_though_nothing_can_be_printed(tmp_path):
    """Where nobody reads on, or output or error are closed, there is no traceback."""
    for end in ("| true", ">&-", "2>&-"):
        done = shell(f"{RUN} {end}", tmp_path)
        assert "Traceback" not in done.stderr, done.stderr
        assert Trajectory.load(tmp_path / "run.parquet").position[-1] > 0.0, end
        (tmp_path / "run.parquet").write_text("old")
    assert json.loads(done.stdout)["figures"]["mean"] > 0.0  # though no remark on overwriting could be made


@pytest.mark.slow
def test_an_output_without_greek_letters_is_no_error(tmp_path):
    done = shell(f"PYTHONIOENCODING=ascii {PANTO} list en50318-2002 --toml", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
