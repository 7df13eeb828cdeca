"""A standard that a user owns: the form filled in, compared, and refused where it is wrong."""

import json
from pathlib import Path

import pytest

from panto_env.studies.en50318 import reference

from ..command import panto

FORM = (Path(__file__).parents[2] / "examples" / "standard.toml").read_text()


@pytest.fixture
def form(tmp_path, monkeypatch):
    """Write a form, with some text replaced, and compare it."""
    monkeypatch.chdir(tmp_path)

    def compare(*options, **changes):
        text = FORM
        for old, new in changes.values():
            assert old in text
            text = text.replace(old, new)
        Path("standard.toml").write_text(text)
        return panto("validate", "--standard", "standard.toml", *options)

    return compare


def test_figures_of_the_form_are_those_of_the_reference_model(form):
    done = form("--json")
    assert done.returncode == 0
    found = json.loads(done.stdout)
    runs = reference.reference_runs()
    usual = {(each.speed_kmh, each.value) for each in reference.check(runs)}
    own = {(each["speed_kmh"], each["value"]) for each in found["checks"] if each["speed_kmh"]}
    assert own
    assert own <= usual
    assert found["passed"]
    assert found["title"] == "EN 50318:2002, reference model"


def test_a_figure_outside_is_named_and_fails(form):
    done = form(std=("std = [26, 31]", "std = [26, 27]"), rest=("[38, 47]", "[0, 1]"))
    assert done.returncode == 1
    assert done.stdout.count("outside") == 2
    assert "27.89" in done.stdout


@pytest.mark.longer
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mean = [110, 120]", "meen = [110, 120]", "accepted has 'meen'; its figures are mean, std"),
        ("mid_span", "middle", "accepted has 'middle'"),
        ("std = [26, 31]", "std = [31, 26]", "accepted.std must be the smaller value first"),
        ("speed_kmh = 250", "sped_kmh = 250", "'sped_kmh' of run is no setting of a run"),
        ("speed_kmh = 250", "speed_kmh = -1", "250 km/h: "),
        ("spans = [5, 6]\nrun", "spans = [5, 60]\nrun", "250 km/h: "),
        ("spans = [5, 6]\nrun", "pantograph_number = 2\nrun", "250 km/h: pantograph_number is 2"),
        (
            '"at rest"\ncatenary = "en50318-2002"',
            '"rail"\ncatenary = "rail-10"',
            "rail: rail-10 has no dropp",
        ),
        (
            '"at rest"\ncatenary = "en50318-2002"',
            '"x"\ncatenary = "re250-curves"',
            "x: mid_span is for a line whose spans",
        ),
    ],
)
def test_mistakes_are_named(form, old, new, words):
    done = form(change=(old, new))
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())


def test_other_options_are_refused_beside_it(form):
    done = form("--brief")
    assert done.returncode == 2
    assert "--standard prints one table" in done.stderr
