"""Data of a three-span catenary."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ....base.settings import Between
from ..schema import CatenaryData, Wire


class ThreeSpanData(CatenaryData):
    """One equivalent tensioned wire on springs, three spans long (paper 2, section 2.1)."""

    kind: Literal["three_span"] = "three_span"
    wire: Wire
    suspension_stiffness: Annotated[float, Between(10, 1e8, "N/m")] = Field(
        description="spring K_S at each support (N/m)"
    )
    modes: Annotated[int, Between(3, 400)] = Field(description="number of vibration modes kept")
    damping_ratio: Annotated[float, Between(0, 0.99)] = Field(description="damping ratio of each mode (-)")
