"""How well a model's displacements match the recorded ones (paper 1, Eqs 9 and 10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .model import HEAD, PLATE, SUPPORT, Parameters, matrices
from .record import Record
from .response import contact_force, fitted_response, force_matrices


@dataclass(frozen=True)
class Match:
    """One displacement of the model beside the recorded one."""

    channel: str
    driven_by: str  # "force" or "plate"
    recorded: Array  # (n,): m, or N for the force
    modelled: Array  # (n,): likewise

    def as_dict(self) -> dict[str, str | float]:
        """What was compared and how well it matches, without the series."""
        return {
            "channel": self.channel,
            "driven_by": self.driven_by,
            "performance": self.performance,
            "mean_error": self.mean_error,
            "squared_error": self.squared_error,
        }

    @property
    def performance(self) -> float:
        """Fitting performance P_f (%), Eq. 9."""
        spread = np.linalg.norm(self.recorded - self.recorded.mean())
        return float(100 * (1 - np.linalg.norm(self.modelled - self.recorded) / spread))

    @property
    def mean_error(self) -> float:
        """Mean of the absolute error, our reading of Table 5's mean error (m or N)."""
        return float(np.abs(self.modelled - self.recorded).mean())

    @property
    def squared_error(self) -> float:
        """Sum of squared errors, Eq. 10 (m^2 or N^2)."""
        return float(np.sum((self.modelled - self.recorded) ** 2))


def matches(record: Record, parameters: Parameters) -> list[Match]:
    """The model driven by the recorded plate and, where it was recorded, by the contact force.

    The paper validates by the force. The state at the first sample, which nobody measures, is the one
    that matches best. Raises InputError where the model is not stable.
    """
    step = record.time_step
    recorded = np.column_stack([record.head, record.support])
    states = fitted_response(*matrices(parameters), record.plate, step, [HEAD, SUPPORT], recorded)
    under_plate = [
        Match("y_p2", "plate", record.head, states[:, HEAD]),
        Match("y_p3", "plate", record.support, states[:, SUPPORT]),
    ]
    if record.force is None:
        return under_plate
    force = contact_force(parameters, record.plate, states, step)
    under_plate.append(Match("force", "plate", record.force, force))
    if parameters["c1T"] > 0:
        return under_plate + force_matches(record, parameters)
    return under_plate


def force_matches(record: Record, parameters: Parameters) -> list[Match]:
    """y_p1, y_p2 and y_p3 of the model driven by the recorded contact force, as in paper 1's Table 5.

    Raises InputError where no force was recorded, c1T is not above 0, or the model is not stable.
    """
    if record.force is None:
        raise InputError("The record has no contact force to drive the model with.")
    recorded = np.column_stack([record.head, record.support, record.plate])
    a, b = force_matrices(parameters)
    states = fitted_response(a, b, record.force, record.time_step, [HEAD, SUPPORT, PLATE], recorded)
    return [
        Match("y_p1", "force", record.plate, states[:, PLATE]),
        Match("y_p2", "force", record.head, states[:, HEAD]),
        Match("y_p3", "force", record.support, states[:, SUPPORT]),
    ]
