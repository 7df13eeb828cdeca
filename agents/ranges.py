"""Limits of a training's counts, and ranges of its numbers."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

MOST_KEPT = 50_000_000
"""Maximum number of environment steps kept in memory: about 10 GB."""
MOST_STEPS = 1_000_000_000
"""Maximum of a training's steps, and of any other count: some days on the fastest machines."""
Count = Annotated[int, Field(gt=0, le=MOST_STEPS, strict=True)]
MOST_UNITS, MOST_LAYERS = 4096, 16
"""Maximum width and depth of a network: larger ones take minutes per step and learn no more here."""
Units = Annotated[int, Field(gt=0, le=MOST_UNITS, strict=True)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
