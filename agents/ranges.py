"""How many of anything a training may have, and what its numbers may be."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

MOST_KEPT = 50_000_000
"""Steps of environments that may be kept in memory: about 10 GB."""
MOST_STEPS = 1_000_000_000
"""Of a training, and of anything that is counted in it: some days, on the fastest machines."""
Count = Annotated[int, Field(gt=0, le=MOST_STEPS, strict=True)]
MOST_UNITS, MOST_LAYERS = 4096, 16
"""Of a network: wider and deeper ones take minutes a step, and learn nothing here that small ones don't."""
Units = Annotated[int, Field(gt=0, le=MOST_UNITS, strict=True)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
