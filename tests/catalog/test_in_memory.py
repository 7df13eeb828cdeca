"""Lines and pantographs that are made in memory, from tables and from changes of others."""

import numpy as np
import pytest

from panto_env import InputError, line, pantograph, simulate
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.catalog.loader import text_of

MADE = {"catenary": (line, load_catenary), "pantograph": (pantograph, load_pantograph)}


@pytest.mark.parametrize(
    ("family", "name"), [(family, name) for family in MADE for name in available(family)]
)
def test_an_entry_without_changes_is_the_one_that_it_is_like(family, name):
    make, load = MADE[family]
    left_out, usual = {"name", "sources"}, load(name)
    for like in (name, usual):
        assert make({}, like=like).model_dump(exclude=left_out) == usual.model_dump(exclude=left_out)


def test_dotted_names_and_tables_say_the_same():
    flat = line({"contact_wire.tension": 25e3, "contact_wire.mass": 1.1}, like="re330", name="own")
    nested = line(
        {"contact_wire": {"tension": 25e3, "mass": {"value": 1.1, "source": "drawing"}}}, like="re330"
    )
    assert (flat.contact_wire, flat.name, nested.name) == (nested.contact_wire, "own", "like re330")
    assert nested.sources["contact_wire.mass"] == "drawing"
    assert (
        nested.sources["messenger_wire.tension"] == load_catenary("re330").sources["messenger_wire.tension"]
    )


def test_one_way_to_place_droppers_takes_the_place_of_the_other():
    usual = load_catenary("re330")
    spaced = line({"droppers": {"spacing": 6.0}}, like=usual)
    assert np.diff(spaced.droppers.positions) == pytest.approx(6.0, abs=0.3)
    assert spaced.droppers.stiffness == usual.droppers.stiffness
    placed = line({"droppers": {"positions": [10.0, 30.0, 50.0], "sag": [0.0, 0.02, 0.0]}}, like=spaced)
    assert placed.droppers.positions == (10.0, 30.0, 50.0)
    sequence = line({"sequence": [{"span_length": 50.0}] * 14}, like="en50318-2002")
    assert len(sequence.layout().spans) == 14


def test_a_table_is_simulated_as_its_file_is(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(text_of("re330").replace("value = 27e3", "value = 25e3"), encoding="utf-8")
    assert load_catenary(path).contact_wire.tension == 25e3
    given = {"pantograph": {"like": "dsa380"}, "speed_kmh": 250, "distance": 400.0, "record_droppers": False}
    own = simulate({"like": "re330", "contact_wire.tension": 25e3}, **given)
    file = simulate(path, **given)
    np.testing.assert_array_equal(own.contact_force, file.contact_force)


@pytest.mark.parametrize(
    ("table", "like", "message"),
    [
        (
            {"contact_wire.tensions": 25e3},
            "re330",
            "like re330 is not a valid entry: key 'contact_wire.tensions'",
        ),
        ({"contact_wire": 25e3}, "re330", "key 'contact_wire' must be a table"),
        ({}, None, "own catenary is not a valid entry: key 'kind' is missing"),
        ({}, "re33", "Unknown catenary 're33', did you mean 're330'"),
        ({"contact_wire.tension": -1.0}, "re330", "contact_wire.tension"),
    ],
)
def test_what_cannot_be_is_refused(table, like, message):
    with pytest.raises(InputError) as caught:
        line(table, like=like)
    assert message in str(caught.value)


def test_single_elements_of_a_list_count_from_1():
    masses = load_pantograph("dsa380").masses
    changed = pantograph({"masses.1": 9.0, "masses.3": 8.0}, like="dsa380")
    assert changed.masses == (9.0, masses[1], 8.0)
    with pytest.raises(InputError, match="'masses' has elements 1 to 3, not 0; they count from 1"):
        pantograph({"masses.0": 9.0}, like="dsa380")
    with pytest.raises(InputError, match="'static_force' is no list"):
        pantograph({"static_force.1": 9.0}, like="dsa380")
