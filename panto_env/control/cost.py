"""What a run takes, of the machine's memory and of time: estimated, and refused, before anything is made."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ..base import machine
from ..base.errors import InputError
from ..plant.state import SAMPLE_ROWS

COPIES = 2
"""How often a record lies in memory: as it is written, and as a trajectory."""
SHARE = 0.7
"""Of the machine's memory that records may take."""
STEP, NUMBER = 1e-6, 0.5e-9
"""Seconds that a time step takes, by itself and for each number that moves in it: of a wire, of a delay."""
LONGEST = 12 * 3600.0
"""Seconds of computing that one run may take."""
FEW_LANES = 1024
"""So many fit into any machine; of more, what they take is looked at before they are made."""
REMEDY = "take a shorter distance, fewer spans, a higher speed or a longer time step"


class Cost(NamedTuple):
    """What a run takes, or several at once."""

    steps: float  # of the plant, in the longest episode of a lane
    memory: float  # bytes, of the record
    seconds: float  # of computing, on one core

    def check(self, what: str, remedy: str = "") -> None:
        """Raise InputError where it does not fit into the machine's memory, or takes longer than ``LONGEST``.

        what: it is the record of; remedy: what else helps, beginning with ", or".
        """
        there = machine.memory()
        if self.memory > SHARE * there:
            time = f", and to compute it {in_words(self.seconds)}" if self.seconds else ""
            raise InputError(
                f"The record of {what} would take {gigabytes(self.memory)}, and this machine has "
                f"{gigabytes(there)} of memory{time}; {REMEDY}{remedy}."
            )
        if self.seconds > LONGEST:
            raise InputError(
                f"To compute {what} would take {in_words(self.seconds)}, and a run may take "
                f"{in_words(LONGEST)} at most; {REMEDY}{remedy}."
            )


def run_cost(lanes: int, steps: float, supports: int, droppers: int, moving: float, record: bool) -> Cost:
    """Cost of a run of so many time steps, with these many supports and droppers recorded, in all lanes.

    moving: numbers that move in a step, in all lanes together. record: whether one is kept, of all steps.
    """
    columns = SAMPLE_ROWS + supports + droppers
    memory = COPIES * lanes * ((steps if record else 0) + 1.0) * columns * np.dtype(float).itemsize
    return Cost(steps, memory, steps * (lanes * STEP + moving * NUMBER))


def check_record(needed: float, what: str) -> None:
    """Raise InputError unless the machine has the memory (bytes) for a record."""
    Cost(0.0, needed, 0.0).check(what)


def check_lanes(lanes: int, some: int, arrays: Iterable[Any]) -> None:
    """Raise InputError where lanes don't fit into memory; arrays: named tuples of arrays, of some lanes."""
    needed = lanes / some * sum(numbers.nbytes for each in arrays for numbers in arrays_of(each))
    there = machine.memory()
    if needed > SHARE * there:
        raise InputError(
            f"{lanes:,} lanes would take {gigabytes(needed)}, and this machine has {gigabytes(there)} of "
            "memory; take fewer."
        )


def arrays_of(fields: Any) -> Iterable[np.ndarray[Any, Any]]:
    """The arrays of a named tuple, at any depth."""
    for each in fields:
        if isinstance(each, np.ndarray):
            yield each
        elif isinstance(each, tuple):
            yield from arrays_of(each)


def gigabytes(size: float) -> str:
    """A size (bytes) with its unit."""
    return f"{size / 1e9:,.1f} GB" if size < 1e18 else f"{size / 1e9:.1e} GB"


def in_words(seconds: float) -> str:
    """About how long that is."""
    for unit, length in (("years", 365.25 * 86400), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length:
            count = seconds / length
            return f"about {count:,.0f} {unit}" if count < 1e9 else f"about {count:.1e} {unit}"
    return f"about {seconds:.0f} seconds"
