"""Cosine and sine of whole turns as plain arithmetic: the same bits on every machine."""

from __future__ import annotations

import math

from ..backend import inlined

# Taylor's series about 0 over a quarter turn either way: the first term left out is 1e-17.
_TURN = 2 * math.pi
SINE = tuple((-1) ** k * _TURN ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(11))


@inlined
def sine_of_turns(turns):
    """sin(2 pi turns), within 1e-15 for |turns| below a million."""
    # The nearest half turn is subtracted; odd ones change the sign.
    halves = int(math.floor(2.0 * turns + 0.5))  # noqa: RUF046  # on a GPU floor gives a float
    rest = turns - 0.5 * halves
    square = rest * rest
    total = SINE[10]
    for k in range(9, -1, -1):
        total = total * square + SINE[k]
    return (1.0 - 2.0 * (halves & 1)) * rest * total


@inlined
def cosine_of_turns(turns):
    """cos(2 pi turns), within 1e-15 for |turns| below a million."""
    return sine_of_turns(turns + 0.25)
