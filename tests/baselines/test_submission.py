"""Submissions: the card, the check, and what it says."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from panto_baselines.benchmark.command import submission
from panto_baselines.benchmark.submission import place_among, read_submission
from panto_env import InputError

EXAMPLE = Path(__file__).parents[2] / "examples" / "submission"
TRACK = """
actuator = "realistic"
sensors = "realistic"
line_condition = "as-built"
[[lines]]
distance = 310
spans = [3, 5]
speeds_kmh = [300]
policies = ["pd"]
"""


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(EXAMPLE, tmp_path / "mine"))


def checked(folder, *arguments):
    track = folder.parent / "track.toml"
    track.write_text(TRACK)
    words = ["check", str(folder), "--config", str(track), "--workers", "1", *arguments]
    return CliRunner().invoke(submission, words, env={"COLUMNS": "200"})


def test_the_example_would_be_ranked(folder):
    done = checked(folder)
    assert done.exit_code == 0, done.output
    assert "Damped frame by A. Author (MIT)" in done.stdout
    assert "It requires: numpy>=2.0" in done.stdout
    assert "It would be ranked." in done.stdout


def test_a_submission_that_presses_would_not_be_ranked(folder):
    (folder / "policy.py").write_text(
        "import numpy as np\nclass DampedFrame:\n    def reset(self, context): pass\n"
        "    def act(self, observation): return np.full(1, 0.2)\n"
    )
    done = checked(folder, "--salt", "today", "--json")
    table = json.loads(done.stdout)
    assert table["card"]["name"] == "Damped frame"
    assert min(row["seed"] for row in table["result"]["rows"]) >= 2**52
    mine, tape = table["result"]["standings"][-2:]
    assert mine["policy"] == f"{folder}/policy.py:DampedFrame"
    assert tape["policy"] == f"tape of {folder}/policy.py:DampedFrame"
    assert "mean force" in mine["disqualified"]
    assert "It would not be ranked" in checked(folder).stdout


def test_its_place_is_that_among_others():
    assert place_among(-20.0, [-30.0, -10.0, 0.0]) == 2
    assert place_among(-40.0, [-30.0]) == 1


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("name", '""', "key 'name'"),
        ("policy", '"../policy.py:Mine"', "must be a file in the folder of the card"),
        ("policy", '"/etc/passwd"', "must be a file in the folder of the card"),
        ("policy", '"other.py:Mine"', "there is no file"),
        ("policy", '"policy.py:Mine"', "has no class 'Mine'"),
        ("colour", '"red"', "key 'colour'"),
        ("authors", "[]", "key 'authors'"),
    ],
)
def test_a_card_that_is_not_whole_is_refused(folder, key, value, words):
    card = folder / "card.toml"
    lines = [line for line in card.read_text().splitlines() if not line.startswith(f"{key} =")]
    card.write_text("\n".join([*lines, f"{key} = {value}"]))
    done = checked(folder)
    assert isinstance(done.exception, InputError)
    assert words in str(done.exception)


def test_a_folder_without_a_card_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"card.toml could not be read: there is no such file"):
        read_submission(tmp_path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda own: (own / "requirements.txt").write_bytes(b"\xff\xfen"), "write it as text in UTF-8"),
        (lambda own: (own / "requirements.txt").write_text("numpy\x1b[2J"), "printable characters only"),
        (lambda own: named(own, "Mine\\u001b]0;x"), "printable characters only"),
        (lambda own: linked(own, "requirements.txt"), "requirements.txt is a link that leaves the folder"),
        (lambda own: linked(own, "policy.py"), "policy.py is a link that leaves the folder"),
        (lambda own: linked(own, "card.toml"), "card.toml is a link that leaves the folder"),
    ],
)
def test_what_is_not_whole_is_refused_before_anything_runs(folder, monkeypatch, change, words):
    monkeypatch.setattr("panto_baselines.benchmark.submission.run", lambda *_: pytest.fail("it ran"))
    change(folder)
    done = checked(folder)
    assert isinstance(done.exception, InputError)
    assert words in str(done.exception)


def named(folder, name):
    card = folder / "card.toml"
    card.write_text(card.read_text().replace('"Damped frame"', f'"{name}"'))


def linked(folder, name):
    outside = (folder / name).rename(folder.parent / name)
    (folder / name).symlink_to(outside)
