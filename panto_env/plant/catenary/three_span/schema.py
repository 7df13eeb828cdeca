"""What a three-span catenary is made of."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ....base.settings import Positive
from ..schema import CatenaryData, Wire


class ThreeSpanData(CatenaryData):
    """One equivalent tensioned wire on springs, three spans long (paper 2, section 2.1)."""

    kind: Literal["three_span"] = "three_span"
    wire: Wire
    suspension_stiffness: Positive = Field(description="spring K_S at each support (N/m)")
    modes: int = Field(ge=3, le=400, description="number of vibration modes kept")
    damping_ratio: Annotated[float, Field(ge=0, lt=1)] = Field(
        description="share of critical damping of each mode (-)"
    )
