"""How well a model's displacements match the recorded ones (paper 1, Eqs 9 and 10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .model import Parameters
from .record import Record
from .response import contact_force, rest_on_plate, under_force, under_plate


@dataclass(frozen=True)
class Match:
    """One displacement of the model beside the recorded one."""

    channel: str
    driven_by: str  # "force" or "plate"
    recorded: Array  # (n,): m, or N for the force
    modelled: Array  # (n,): likewise

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
    """The model driven by the recorded plate, and by the recorded contact force where that is possible.

    The force drives only a model whose parameters are all above 0; the paper validates so. The model
    starts at rest, so the first second is the start's, not the model's.
    """
    initial = rest_on_plate(parameters, float(record.plate[0]))
    states = under_plate(parameters, record.plate, record.time_step, initial)
    found = [
        Match("y_p2", "plate", record.head, states[:, 0]),
        Match("y_p3", "plate", record.support, states[:, 1]),
    ]
    if record.force is None:
        return found
    force = contact_force(parameters, record.plate, states, record.time_step)
    found.append(Match("force", "plate", record.force, force))
    try:
        driven = under_force(parameters, record.force, record.time_step)
    except InputError:
        return found
    for k, (name, shown) in enumerate(
        (("y_p1", record.plate), ("y_p2", record.head), ("y_p3", record.support))
    ):
        found.append(Match(name, "force", shown, driven[:, k]))
    return found
