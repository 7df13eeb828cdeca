"""Arithmetic that the compiler is to understand: on the processor and on a GPU."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload

from .dispatch import INLINED

NOT_NEGATIVE = 0xFFFFFFF
"""Mask that tells the compiler that an index is not negative, so that it need not wrap around."""


def floor(x: Any) -> Any:
    """Largest whole number not above x, as a float: loops over lanes stay vector instructions."""
    return np.floor(x)


@overload(floor, jit_options=INLINED)
def _floor(x):  # no types: the signature must be that of the source below
    return lambda x: np.floor(x)
