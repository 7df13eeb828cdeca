"""Types of numeric arrays in signatures; shapes are given in docstrings and comments."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
Index = NDArray[np.integer[Any]]
Lanes = int | Index
"""Numbers of lanes: one, or an array of them."""
