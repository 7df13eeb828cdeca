"""Functions of a number that the processor and a GPU's compiler know under different names."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload

from .dispatch import INLINED


def floor(x: Any) -> Any:
    """Largest whole number not above x, as a float: loops over lanes stay vector instructions."""
    return np.floor(x)


@overload(floor, jit_options=INLINED)
def _floor(x):  # no types: the signature must be that of the source below
    return lambda x: np.floor(x)
