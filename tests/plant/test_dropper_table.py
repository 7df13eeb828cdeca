"""Droppers of a line at rest: weights that they carry, and the independent finite-element model."""

import json

import numpy as np
import pandas
import pytest

from panto_env.catalog import load_catenary
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.static import RestingDropper, as_rows, dropper_table, droppers_at_rest

from ..command import panto
from ..finite_element.sections import line_of
from ..finite_element.static import static_shape
from ..uniform_lines import UNIFORM

LINES = {"ohl-three-span": "own-two-mass", "periodic-stiffness": "three-mass", "en50318-2002": "en50318-2002"}


@pytest.mark.parametrize("name", UNIFORM)
def test_lengths_and_stretches_fill_the_room_between_the_wires(name):
    """As finite elements give it, with the messenger's supports yielding under all that they carry."""
    line = load_catenary(name)
    table, other, droppers = droppers_at_rest(line), static_shape(line, element=0.1), line.droppers
    forces = [each.static_force for each in table]
    assert sum(forces) == pytest.approx(other.dropper_tension.sum(), rel=1e-3)
    assert forces == pytest.approx(other.dropper_tension, rel=1e-3, abs=0.2)
    assert [each.length + each.stretch for each in table] == pytest.approx(other.dropper_length, abs=5e-4)
    stiffness = [droppers.stiffness or droppers.axial_stiffness / each.length for each in table]
    assert [each.stretch for each in table] == pytest.approx(np.array(forces) / stiffness, rel=1e-9)


def test_the_command_lists_them_and_writes_them_with_units(tmp_path):
    line = load_catenary("re250")
    table = droppers_at_rest(line)
    told = panto("list", "re250")
    assert "Droppers of a span at rest" in told.stdout
    for each in table:
        assert f"{each.static_force:.1f}" in told.stdout
        assert f"{each.length:.4f}" in told.stdout
    listed = json.loads(panto("list", "re250", "--json").stdout)["catenary"]["droppers_at_rest"]
    assert [each["static_force"] for each in listed] == [each.static_force for each in table]
    for suffix, read in ((".csv", pandas.read_csv), (".xlsx", pandas.read_excel)):
        path = tmp_path / f"droppers{suffix}"
        result = panto("list", "re250", "--droppers", path)
        assert result.returncode == 0, result.stderr
        frame = read(path)
        assert frame["number"].tolist() == list(range(1, 8))
        assert frame["from support (m)"].tolist() == list(line.droppers.positions)
        assert frame["static force (N)"].tolist() == pytest.approx([each.static_force for each in table])
        assert frame["length, unloaded (m)"].tolist() == pytest.approx([each.length for each in table])
        assert frame["stretch at rest (m)"].tolist() == pytest.approx([each.stretch for each in table])


@pytest.mark.parametrize("name", ["dsa250", "periodic-stiffness"])
def test_what_has_no_droppers_has_no_table(name, tmp_path):
    result = panto("list", name, "--droppers", tmp_path / "droppers.csv")
    assert result.returncode == 2
    assert "not a line with droppers" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_rig_has_those_of_its_line():
    assert droppers_at_rest(load_catenary("rig-flexible")) == droppers_at_rest(load_catenary("en50318-2002"))


def test_the_table_numbers_spans_only_where_they_differ():
    given = {"sequence": ["a", "a", {"span_length": 60.0}], "span_types": {"a": {}}}
    differ = as_rows(droppers_at_rest(line_of("re250", given)))
    assert [row["span"] for row in differ] == [1] * 7 + [2] * 7 + [3] * 6  # 60 m
    alike = as_rows(droppers_at_rest(load_catenary("re250")))
    assert alike[0].keys() == differ[0].keys() - {"span"}


@pytest.mark.parametrize("name", LINES)
def test_tension_is_recorded_of_every_dropper_and_only_on_request(name):
    given = {"catenary": name, "pantograph": LINES[name], "distance": 120.0}
    plant = Task(run_settings(given), lanes=2).plant
    droppers = len(plant.model.droppers)
    assert (droppers > 0) == (name == "en50318-2002")
    assert plant.samples(5).tension.shape == (2, 5, 0)
    assert plant.samples(5, tension=True).tension.shape == (2, 5, droppers)
    assert plant.samples(5).uplift.shape == (2, len(plant.model.supports), 5)
    assert plant.samples(5).rows.shape[:2] == (2, 5)
    if name != "periodic-stiffness":  # a massless line keeps no tension at all
        plant.start(np.arange(2), 50.0)
        tension = plant.model.rest_tension(0)
        assert tension.shape == (droppers,)
        assert (tension > 0).all()


def dropper(span, number):
    return RestingDropper(number, 5.0 * number, 0.0124, 1.23456, 123.44, 0.001234, span)


def test_a_line_is_drawn_below_the_last_dropper_of_each_span():
    places = [(1, 1), (1, 2), (1, 3), (2, 1), (3, 1), (3, 2)]
    made = dropper_table([dropper(*place) for place in places])
    assert made.section_ends == (2, 3)
    assert [row[:3] for row in made.rows[:2]] == [("1", "1", "5.000"), ("1", "2", "10.000")]
    assert made.rows[-1] == ("3", "2", "10.000", "12.4", "1.2346", "123.4", "1.23")
    assert made.title == "Droppers of all spans at rest, as designed"
    assert made.headings[:2] == ("span", "dropper")
    alike = dropper_table([dropper(1, 1), dropper(1, 2)])
    assert alike.section_ends == ()
    assert alike.rows[0] == ("1", "5", "12.4", "1.2346", "123.4", "1.23")
    assert alike.title == "Droppers of a span at rest, as designed"
    assert len(alike.headings) == len(made.headings) - 1 == 6
    assert "sag (mm)" in alike.headings
    assert "stretch at rest (mm)" in alike.headings
