"""Shape of a line at one moment, for pictures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array


class LineView(NamedTuple):
    """Part of one lane's line. Arrays are empty for what a line does not have."""

    x: Array  # (n,): positions along the line (m)
    contact: Array  # (n,): height of the contact wire there (m)
    messenger: Array  # (n,): height of the messenger wire there (m), or (0,)
    supports: Array  # (supports,): positions (m)
    droppers: Array  # (droppers,): positions (m)
    tops: Array  # (droppers,): height of their upper ends (m)
    bottoms: Array  # (droppers,): height of their lower ends (m)
    further: tuple[tuple[Array, Array], ...]  # positions and heights (m) of stitch wires and a second pair
    slack: NDArray[np.bool_]  # (droppers,): whether each dropper is slack


NONE = np.zeros(0)
NOTHING = LineView(NONE, NONE, NONE, NONE, NONE, NONE, NONE, (), slack=np.zeros(0, dtype=np.bool_))
"""View of a line that has neither wires nor supports."""
