"""The two-mass pantograph on a contact plate (paper 1, Fig. 4, Eqs 1-2) and the names of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

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

UNITS = {name: {"k": "N/m", "m": "kg", "c": "N s/m"}[name[0]] for name in (*MEASURED, *IDENTIFIED)}

HEAD, SUPPORT, HEAD_SPEED, _, PLATE = range(5)
"""Places in the state: y_p2, y_p3, y_p2', y_p3', and y_p1 where the contact force drives the plate."""


def _range(field: str) -> tuple[float, float]:
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
    (m2, m3), (k2, k3), (c2, c3) = pantograph.masses, pantograph.stiffnesses, pantograph.dampings
    k1, c1 = pantograph.contact_stiffness, pantograph.contact_damping
    return dict(zip(UNITS, (k1, m2, k2, c1, c2, m3, c3, k3), strict=True))


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


Z = 1.959963984540054  # of the normal distribution, two-sided, at 95 %


@dataclass(frozen=True)
class Fit:
    """Identified parameters of one record by one method."""

    method: str
    known: Parameters  # what was given
    names: tuple[str, ...]  # what was identified, p of them
    values: Array  # (p,): SI
    std: Array  # (p,): standard deviation of each, by the method's own account
    condition: float  # of A (Eq. 4), or of the Jacobian with columns of length 1
    dependence: float  # condition number with columns of length 1: how nearly they depend on each other

    @property
    def rsd(self) -> Array:
        """(p,): relative standard deviation (%), paper 1's measure of confidence."""
        with np.errstate(divide="ignore"):
            return np.asarray(100 * self.std / np.abs(self.values))

    @property
    def interval(self) -> Array:
        """(p, 2): 95 % confidence interval of each."""
        return np.column_stack([self.values - Z * self.std, self.values + Z * self.std])

    @property
    def parameters(self) -> dict[str, float]:
        """All eight, known and identified."""
        identified = dict(zip(self.names, map(float, self.values), strict=True))
        return {name: identified.get(name, self.known.get(name, np.nan)) for name in UNITS}

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters whose 95 % interval contains 0: the record does not determine them."""
        return tuple(name for name, share in zip(self.names, self.rsd, strict=True) if Z * share > 100)

    @property
    def impossible(self) -> tuple[str, ...]:
        """Parameters whose value no pantograph can have, such as a negative mass."""
        return tuple(name for name, value in self.parameters.items() if not possible(name, value))

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        rows = zip(self.names, self.values, self.rsd, self.interval, strict=True)
        parameters = {
            name: {"value": value, "rsd": rsd, "low": low, "high": high, "unit": UNITS[name]}
            for name, value, rsd, (low, high) in rows
        }
        return {
            "method": self.method,
            "parameters": parameters,
            "condition": self.condition,
            "dependence": self.dependence,
            "undetermined": list(self.undetermined),
            "impossible": list(self.impossible),
        }


def free_names(known: Parameters) -> tuple[str, ...]:
    """The parameters left to identify."""
    return tuple(name for name in IDENTIFIED if name not in known)
