"""Values of a line that a policy may observe, so that it can adapt to lines that it has not met."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.catenary import CatenaryData
from ..plant.catenary.flexible import FlexibleCatenaryData

SPAN_LENGTH = ("span length", 50.0, "m")
"""Name, scale and unit of the length of the span that the train is in."""
LINE_ENTRIES = (
    ("wave speed", 150.0, "m/s"),
    ("contact wire tension", 20e3, "N"),
    ("messenger wire tension", 20e3, "N"),
    ("contact wire mass", 1.0, "kg/m"),
    ("messenger wire mass", 1.0, "kg/m"),
    ("droppers of a span", 10.0, "-"),
)
"""Name, scale and unit of each value of the whole line."""
LINE_CENTRES = {
    "span length": (55.0, 8.0),
    "wave speed": (140.0, 14.0),
    "contact wire tension": (22e3, 5e3),
    "messenger wire tension": (16e3, 3e3),
    "contact wire mass": (1.15, 0.12),
    "messenger wire mass": (0.85, 0.15),
    "droppers of a span": (8.0, 2.0),
}
"""Centre and scale of each in "centred", from the lines of the family high-speed."""


def line_values(line: CatenaryData) -> Array:
    """The values of a line in the order of ``LINE_ENTRIES``. Raises InputError where it has not got them."""
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError(
            f"Only a flexible catenary has the values that line_values observes, and line '{line.name}' is "
            "not one; leave out line_values."
        )
    contact, messenger = line.contact_wire, line.messenger_wire
    return np.array(
        [
            contact.wave_speed,
            contact.tension,
            messenger.tension,
            contact.mass,
            messenger.mass,
            float(len(line.droppers.positions)),
        ]
    )
