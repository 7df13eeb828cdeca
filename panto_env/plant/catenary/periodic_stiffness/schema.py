"""Data of a line of periodic stiffness."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ....base.settings import Between
from ..schema import CatenaryData


class PeriodicStiffnessData(CatenaryData):
    """A massless spring whose stiffness varies along the span (paper 3, Eqs 1-5)."""

    kind: Literal["periodic_stiffness"] = "periodic_stiffness"
    mean_stiffness: Annotated[float, Between(10, 1e8, "N/m")] = Field(description="mean stiffness k_m (N/m)")
    stiffness_variation: Annotated[float, Between(0, 0.99)] = Field(
        description="relative amplitude epsilon of the stiffness (-)"
    )
