"""What a file of a run must hold: its checksum shows that it is undamaged, not that it is a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, ValidationError

from ..base.arrays import Array
from ..base.settings import Between, Settings, explain
from ..plant.catenary.schema import PowerSystem

LARGEST = 1e9
"""Maximum size of a sample, in its SI unit."""
Places = tuple[Annotated[float, Between(-1e7, 1e7, "m")], ...]


class Facts(Settings):
    """Facts that figures depend on; a file holds more. Numbers that are unknown are nan or infinite."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=True)
    support_position: Places
    dropper_position: Places
    speed: Annotated[float, Between(0.1, 500, "m/s")]
    alignment: tuple[Places, float | None] | tuple[Places, float | None, list[tuple[str, float | None]]]
    time_step: Annotated[float, Between(1e-7, 1, "s")]
    nominal_force: Annotated[float, Between(-1e6, 1e6, "N")]
    target_mean: float
    reached: float
    system: PowerSystem  # of the line, as what follows
    wave_speed: float = Field(ge=1)
    free_uplift: float
    dropper_reflection: float
    support_reflection: float
    controlled: tuple[Annotated[int, Between(1, 4)], ...] = Field((1,), min_length=1)
    line_condition: tuple[dict[str, Any], ...] | None = None
    catenary: dict[str, Any]  # as designed, as what follows
    pantograph: dict[str, Any]
    aerodynamic_coefficient: Annotated[float, Between(-1, 1)] = 0.0


def check_stored(facts: Mapping[str, Any], columns: Mapping[str, Array]) -> None:
    """Raise ValueError, with a clause, for facts and columns, (n,) each, of a file that is of no run."""
    try:
        for own in ({}, *facts["followers"]):
            design = {"catenary": {}, "pantograph": {}} | (facts | own)["design"]
            table = facts["settings"] | facts["line"] | design["pantograph"] | facts | own | design
            known = Facts.model_validate(table)
    except ValidationError as error:
        raise ValueError(explain(error, Facts)) from error
    for name, column in columns.items():
        usable = column.dtype.kind == "f" and len(column) > 1
        own = column[~np.isnan(column)] if usable and "@" in name else column  # nan: not yet on the line
        if not (usable and (np.abs(own) <= LARGEST).all()):
            raise ValueError(f"column {name} does not hold finite numbers of two samples or more")
    supports, pitch = np.array(known.alignment[0]), known.alignment[1]
    if len(supports) < 2 or (np.diff(supports) <= 0).any() or pitch not in (None, supports[1]):
        raise ValueError("its supports do not stand one behind the other")
    if (np.diff(columns["position"]) <= 0).any() or columns["position"][0] < 0:
        raise ValueError("its positions do not rise with time")
