"""Every observation's entries, with unit, scale and centre, are those that policies and agents were made for.

python -m tests.control.test_layouts   # writes layouts.json anew
"""

import json
from itertools import product
from pathlib import Path

from panto_env.control.observation import Layout
from panto_env.control.settings import run_settings

STORED = Path(__file__).with_name("layouts.json")
OPTIONS = {"plain": {}, "all": {"harmonics": 3, "history": 2, "line_values": True}}


def layouts():
    """All kinds of observation with all options, and the plain one."""
    found = {}
    for place, kind, name in product(
        ("frame", "both"), ("measured", "full", "centred", "estimated"), OPTIONS
    ):
        given = {"actuator": {"place": place}, "pantograph": "benchmark-2015", "observation": kind}
        found[f"{kind}, {place}, {name}"] = [
            [each.name, each.unit, each.scale, each.centre, each.slope]
            for each in Layout.of(run_settings(given | OPTIONS[name])).entries
        ]
    return found


def test_entries_are_as_stored():
    assert layouts() == json.loads(STORED.read_text())


if __name__ == "__main__":
    text = (
        json.dumps(layouts()).replace("], [", "],\n  [").replace("]], ", "]],\n ").replace(": [[", ": [\n  [")
    )
    STORED.write_text(text + "\n")  # an entry a line
