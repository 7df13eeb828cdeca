"""Every observation's entries, with unit, scale and centre, are those that policies and agents were made for.

python -m tests.control.test_layouts   # writes layouts.json anew
"""

import json
from pathlib import Path

import pytest

from panto_env.catalog import load_pantograph
from panto_env.control.entries import CENTRED, ESTIMATED, FULL, MEASURED, EntryOptions, entries_of
from panto_env.plant.actuators import actuator_settings

STORED = Path(__file__).with_name("layouts.json")


def layouts():
    """All kinds of observation with all options, and the plain one."""
    found = {}
    for place in ("frame", "both"):
        actuator, pantograph = actuator_settings({"place": place}), load_pantograph("benchmark-2015")
        for kind in (MEASURED, FULL, CENTRED, ESTIMATED):
            for name, options in {
                "plain": {},
                "all": {"harmonics": 3, "history": 2, "line_values": True},
            }.items():
                entries = entries_of(kind, EntryOptions(actuator, pantograph, **options))
                found[f"{kind}, {place}, {name}"] = [
                    [each.name, each.unit, each.scale, each.centre, each.slope] for each in entries
                ]
    return found


@pytest.mark.parametrize("name", json.loads(STORED.read_text()) if STORED.exists() else [])
def test_entries_are_as_stored(name):
    assert layouts()[name] == json.loads(STORED.read_text())[name]


def test_nothing_is_missing_among_the_stored():
    assert set(layouts()) == set(json.loads(STORED.read_text()))


if __name__ == "__main__":
    STORED.write_text(json.dumps(layouts(), indent=1) + "\n")
