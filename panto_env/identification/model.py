"""The two-mass pantograph on a contact plate (paper 1, Fig. 4, Eqs 1-2) and the names of its parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.settings import ranges_of
from ..plant.pantograph.schema import PantographData

Parameters = Mapping[str, float]
"""Values by the names in ``UNITS``, SI."""

MEASURED = ("k1T", "m2", "k2")
"""What paper 1 measures on the dismantled pantograph (section 3)."""

IDENTIFIED = ("c1T", "c2", "m3", "c3", "k3")
"""What the records give, in the order of X (Eq. 5)."""

UNITS = {
    "k1T": "N/m",
    "m2": "kg",
    "k2": "N/m",
    "c1T": "N s/m",
    "c2": "N s/m",
    "m3": "kg",
    "c3": "N s/m",
    "k3": "N/m",
}


HEAD, SUPPORT, HEAD_SPEED, SUPPORT_SPEED, PLATE = range(5)
"""Places in the state: y_p2, y_p3, y_p2', y_p3', and y_p1 where the contact force drives the plate."""


def _range(field: str) -> tuple[float, float]:
    """Lowest and highest value that a pantograph may have."""
    (between,) = set(ranges_of(PantographData.model_fields[field].rebuild_annotation()))
    return between.low, between.high


RANGES = {
    "k1T": _range("contact_stiffness"),
    "m2": _range("masses"),
    "k2": (1.0, _range("stiffnesses")[1]),  # without a spring between them head and support are two things
    "c1T": _range("contact_damping"),
    "c2": _range("dampings"),
    "m3": (1.0, _range("masses")[1]),  # of an articulated frame
    "c3": _range("dampings"),
    "k3": _range("stiffnesses"),
}
"""Lowest and highest value of each parameter, in its unit."""


def possible(name: str, value: float) -> bool:
    """Whether a pantograph can have this value of a parameter; nan is none."""
    low, high = RANGES[name]
    return low <= value <= high


def check_known(known: Parameters) -> dict[str, float]:
    """Values known beforehand, all of MEASURED among them; any of IDENTIFIED may be fixed too.

    Raises InputError for an unknown or missing name, a value that makes no sense, or nothing left to find.
    """
    for name, value in known.items():
        if name not in UNITS:
            raise InputError(f"Measured parameter '{name}' is not known; known are {', '.join(UNITS)}.")
        if not possible(name, value):
            low, high = RANGES[name]
            raise InputError(
                f"Measured parameter {name} must be a number from {low:,g} to {high:,g} {UNITS[name]}, "
                f"not {value:g}."
            )
    missing = [name for name in MEASURED if name not in known]
    if missing:
        raise InputError(
            f"No measured value of {' and '.join(missing)} is given; give k1T (N/m), m2 (kg) and k2 (N/m), "
            "as --measured k1T=32992 m2=5 k2=14544."
        )
    if set(known) >= set(IDENTIFIED):
        raise InputError("All parameters are given as measured; leave out at least one to be identified.")
    return dict(known)


def parameters_of(pantograph: PantographData) -> dict[str, float]:
    """The eight parameters of a catalogue entry. Raises InputError unless it has two masses on a spring."""
    if len(pantograph.masses) != 2 or pantograph.contact_stiffness == "rigid":
        raise InputError(f"Pantograph '{pantograph.name}' must have two masses and a contact spring.")
    return {
        "k1T": pantograph.contact_stiffness,
        "m2": pantograph.masses[0],
        "k2": pantograph.stiffnesses[0],
        "c1T": pantograph.contact_damping,
        "c2": pantograph.dampings[0],
        "m3": pantograph.masses[1],
        "c3": pantograph.dampings[1],
        "k3": pantograph.stiffnesses[1],
    }


def matrices(parameters: Parameters) -> tuple[Array, Array]:
    """A, (4, 4), and B, (4, 2), of x' = A x + B [y_p1, y_p1'], with x = [y_p2, y_p3, y_p2', y_p3']."""
    k1, m2, k2, c1, c2, m3, c3, k3 = (parameters[name] for name in UNITS)
    a = np.array(
        [
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-(k1 + k2) / m2, k2 / m2, -(c1 + c2) / m2, c2 / m2],
            [k2 / m3, -(k2 + k3) / m3, c2 / m3, -(c2 + c3) / m3],
        ]
    )
    b = np.array([[0.0, 0.0], [0.0, 0.0], [k1 / m2, c1 / m2], [0.0, 0.0]])
    return a, b
