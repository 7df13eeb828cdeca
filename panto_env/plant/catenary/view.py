"""What can be seen of a line at one moment, for pictures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array


class LineView(NamedTuple):
    """A stretch of one lane's line. Arrays are empty where a line has no such thing."""

    x: Array  # (n,): places along the line (m)
    contact: Array  # (n,): height of the contact wire there (m)
    messenger: Array  # (n,): height of the messenger wire there (m), or (0,)
    supports: Array  # (supports,): where they stand (m)
    droppers: Array  # (droppers,): where they hang (m)
    slack: NDArray[np.bool_]  # (droppers,): which of them carry nothing


NONE = np.zeros(0)
NOTHING = LineView(NONE, NONE, NONE, NONE, NONE, slack=np.zeros(0, dtype=np.bool_))
"""Of a line that has neither wires nor supports."""
