"""What is there already: a line says that it will be overwritten; what took hours asks for --force."""

import json

import pytest
from typer.testing import CliRunner

from panto_baselines.oracle import stored
from panto_baselines.policies.lanes_law import load_gains
from panto_env import InputError
from panto_env.base.checksums import with_checksum
from panto_env.cli import make_app

LINE = ["--catenary", "periodic-stiffness", "--pantograph", "three-mass"]
RUN = ["simulate", *LINE, "--distance", "150", "--spans", "1-2"]
BENCHMARK = ["benchmark", "passive", *LINE, "--speed", "250", "--seeds", "1", "--workers", "1"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def called(*words):
    return CliRunner().invoke(make_app(), list(words))


@pytest.mark.parametrize(("option", "file"), [("--output", "run.parquet"), ("--plot", "run.png")])
def test_overwriting_is_told_in_one_line(option, file, folder):
    first = called(*RUN, option, file)
    assert first.exit_code == 0
    assert "overwritten" not in first.stderr
    before = (folder / file).read_bytes()
    (folder / file).write_text("old")
    second = called(*RUN, option, file)
    assert second.exit_code == 0
    assert second.stderr.splitlines() == [f"panto: warning: {file} exists already and will be overwritten."]
    assert (folder / file).read_bytes() == before


def test_a_benchmark_is_overwritten_only_if_asked(folder):
    (folder / "out.json").write_text("old")
    refused = called(*BENCHMARK, "--output", "out.json")
    assert isinstance(refused.exception, InputError)
    assert "out.json exists already; give another --output, or --force" in str(refused.exception)
    assert (folder / "out.json").read_text() == "old"
    done = called(*BENCHMARK, "--output", "out.json", "--force")
    assert done.exit_code == 0, done.output
    assert "out.json exists already and will be overwritten." in done.stderr
    assert "sha256" in json.loads((folder / "out.json").read_text())


def test_an_oracle_that_would_be_lost_is_kept(folder, monkeypatch):
    other = {"version": "0", "command": "panto oracle", "cells": [{"asked": {"fingerprint": "of another"}}]}
    (folder / "oracles.json").write_text(json.dumps(with_checksum(other)))
    monkeypatch.setattr("panto_baselines.oracle.search.find", lambda *_: pytest.fail("it searched"))
    refused = called("oracle", *LINE, "--speed", "250", "--seed", "0", "--output", "oracles.json")
    assert isinstance(refused.exception, InputError)
    assert "oracles.json exists already" in str(refused.exception)
    assert stored.read("oracles.json") == other


def test_gains_are_replaced_only_if_asked(folder):
    # Of the shipped file, whose gains for this line and place took minutes.
    from panto_baselines.policies.lanes_law import gain_file

    mine = folder / "skyhook.toml"
    mine.write_bytes(gain_file("skyhook").read_bytes())
    before = load_gains(mine)
    refused = called("tune", "skyhook", "--output", str(mine))
    assert isinstance(refused.exception, InputError)
    expected = "already holds gains for en50318-2002 on en50318-2002, actuator on 'frame'; give another"
    assert expected in str(refused.exception)
    assert load_gains(mine) == before
