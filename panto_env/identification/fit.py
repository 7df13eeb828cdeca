"""The parameters that a method identified from a record, and how certain they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Array
from .model import IDENTIFIED, UNITS, Parameters, possible

CONFIDENCE = 0.95
Z = 1.959963984540054  # of the normal distribution, two-sided, at CONFIDENCE


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
        parameters = {
            name: {"value": value, "rsd": rsd, "low": low, "high": high, "unit": UNITS[name]}
            for name, value, rsd, (low, high) in zip(
                self.names, self.values, self.rsd, self.interval, strict=True
            )
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
