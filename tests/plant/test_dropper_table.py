"""Droppers of a line at rest: weights that they carry, and the independent finite-element model."""

import json

import numpy as np
import pandas
import pytest

from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import as_rows, droppers_at_rest

from ..command import panto
from ..finite_element.static import GRAVITY, static_shape
from ..uniform_lines import UNIFORM


@pytest.mark.parametrize("name", UNIFORM)
def test_forces_carry_the_contact_wire(name):
    """Less clamps and half of the droppers, they add up to its weight, with what a steady arm holds."""
    line = load_catenary(name)
    table, other = droppers_at_rest(line), static_shape(line, element=0.1)
    own = sum(each.length * line.droppers.mass / 2 + line.droppers.contact_clamp_mass for each in table)
    weight = GRAVITY * (line.contact_wire.mass * line.span_length + own)
    carried = sum(each.static_force for each in table)
    if not line.steady_arm.holds_wire:
        assert carried == pytest.approx(weight, rel=1e-9)
    assert carried == pytest.approx(other.dropper_tension.sum(), rel=1e-3)
    assert [each.static_force for each in table] == pytest.approx(other.dropper_tension, rel=1e-3, abs=0.2)


@pytest.mark.parametrize("name", UNIFORM)
def test_lengths_and_stretches_fill_the_room_between_the_wires(name):
    """As finite elements give it, with the messenger's supports yielding under all that they carry."""
    line = load_catenary(name)
    table, other = droppers_at_rest(line), static_shape(line, element=0.1)
    droppers = line.droppers
    loaded = [each.length + each.stretch for each in table]
    assert loaded == pytest.approx(other.dropper_length, abs=5e-4)
    stiffness = [droppers.stiffness or droppers.axial_stiffness / each.length for each in table]
    stretch = np.array([each.static_force for each in table]) / stiffness
    assert [each.stretch for each in table] == pytest.approx(stretch, rel=1e-9)


def test_published_lengths_are_in_the_table():
    """Of the benchmark of 2015, within 3 mm."""
    half = [1.017, 0.896, 0.810, 0.758, 0.741]
    found = [each.length for each in droppers_at_rest(load_catenary("benchmark-2015"))]
    assert found == pytest.approx(half + half[-2::-1], abs=3e-3)


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
    table = load_catenary("re250").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    given = {"sequence": ["a", "a", {"span_length": 60.0}], "span_types": {"a": {}}}
    differ = as_rows(droppers_at_rest(FlexibleCatenaryData.model_validate(table | given)))
    assert [row["span"] for row in differ] == [1] * 7 + [2] * 7 + [3] * 6  # 60 m
    alike = as_rows(droppers_at_rest(load_catenary("re250")))
    assert alike[0].keys() == differ[0].keys() - {"span"}
