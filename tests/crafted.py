"""Files of ours with one wrong entry each, and a checksum that fits."""

import copy
import math

ODD = (None, True, "x", "nan", -1, 0, math.nan, 1e300, 10**400, 1e-320, 3.5, [], [1], {}, {"a": 1})
"""What stands in the place of an entry of a file."""


def entries(table, place=()):
    """Places of all entries of a table, in tables and lists, too."""
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield (*place, key)
        if isinstance(value, dict | list):
            yield from entries(value, (*place, key))


def changed(table, place, value):
    """A table with another value at a place, or without it."""
    made = inner = copy.deepcopy(table)
    for key in place[:-1]:
        inner = inner[key]
    if value is KeyError:
        del inner[place[-1]]
    else:
        inner[place[-1]] = value
    return made
