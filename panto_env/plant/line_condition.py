"""Condition of the line: irregularity of the contact wire's height."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..settings import NonNegative, Positive, Settings

# Wavelength (m) and amplitude (m) of the height irregularity of a fair line (seen in one toy model).
IRREGULARITY = ((12.0, 0.15e-3), (5.0, 0.08e-3), (1.5, 0.03e-3))


class LineCondition(Settings):
    """What differs from the line as designed."""

    irregularity: NonNegative = Field(
        0.0, description="height irregularity, as a multiple of a fair line's, of random phases (-)"
    )
    wear_depth: NonNegative = Field(0.0, description="depth A of wear waves, A/2 (1 - cos) (m)")
    wear_wavelength: Positive = Field(0.8, description="wavelength of the wear waves (m)")

    @property
    def waves(self) -> int:
        """How many cosines it takes."""
        return len(IRREGULARITY) * (self.irregularity > 0) + (self.wear_depth > 0)


LINE_CONDITIONS = {
    "new": LineCondition(),
    "fair": LineCondition(irregularity=1.0),
    # Wear waves: the published range is 0.2-3 mm at 0.4-1.2 m.
    "worn": LineCondition(irregularity=1.0, wear_depth=0.3e-3),
}


def draw(condition: LineCondition, random: np.random.Generator) -> NDArray[np.float64]:
    """Cosines of one line in this condition, (waves, 3): amplitude (m), wavenumber (1/m), phase."""
    rows = []
    if condition.irregularity > 0:
        phases = random.uniform(0, 2 * np.pi, len(IRREGULARITY))
        for (wavelength, amplitude), phase in zip(IRREGULARITY, phases, strict=True):
            rows.append((condition.irregularity * amplitude, 2 * np.pi / wavelength, phase))
    if condition.wear_depth > 0:
        # Only the alternating part: the mean depth lowers the whole line and changes nothing.
        rows.append((condition.wear_depth / 2, 2 * np.pi / condition.wear_wavelength, np.pi))
    return np.array(rows).reshape(-1, 3)
