"""Estimated memory and computing time of a run; too large a run is refused before it begins."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ..base import machine
from ..base.errors import InputError
from ..plant.state import SAMPLE_ROWS

COPIES = 2
"""Copies of a record in memory: the arrays of the run, and the trajectory."""
SHARE = 0.7
"""Maximum share of the machine's memory for records."""
STEP, NUMBER = 1e-6, 0.5e-9
"""Computing time (s) of a time step, and for each number of the state (of a wire, of a delay line)."""
LONGEST = 12 * 3600.0
"""Maximum computing time of a run (s)."""
FEW_LANES = 1024
"""Number of lanes that fit into any machine; the memory of more is checked before they are created."""
REMEDY = "take a shorter distance, fewer spans, a higher speed or a longer time step"


class Cost(NamedTuple):
    """Cost of a run, or of several at once."""

    steps: float  # of the plant, in the longest episode of a lane
    memory: float  # bytes, of the record
    seconds: float  # of computing, on one core

    def check(self, what: str, remedy: str = "") -> None:
        """Raise InputError where the cost exceeds the machine's memory, or the time ``LONGEST``.

        what: name of the run for the message; remedy: an additional way out, beginning with ", or".
        """
        there = machine.memory()
        if self.memory > SHARE * there:
            time = f", and to compute it {in_words(self.seconds)}" if self.seconds else ""
            raise InputError(
                f"The record of {what} would take {gigabytes(self.memory)}, but this machine has "
                f"{gigabytes(there)} of memory{time}; {REMEDY}{remedy}."
            )
        if self.seconds > LONGEST:
            raise InputError(
                f"To compute {what} would take {in_words(self.seconds)}, but the maximum for a run is "
                f"{in_words(LONGEST)}; {REMEDY}{remedy}."
            )


def run_cost(lanes: int, steps: float, supports: int, droppers: int, moving: float, record: bool) -> Cost:
    """Cost of a run in all lanes.

    steps: time steps. supports, droppers: numbers of those recorded. moving: numbers in the state of all
    lanes together. record: whether all steps are recorded.
    """
    columns = SAMPLE_ROWS + supports + droppers
    memory = COPIES * lanes * ((steps if record else 0) + 1.0) * columns * np.dtype(float).itemsize
    return Cost(steps, memory, steps * (lanes * STEP + moving * NUMBER))


def check_record(needed: float, what: str) -> None:
    """Raise InputError unless the machine has the memory (bytes) for a record."""
    Cost(0.0, needed, 0.0).check(what)


def check_lanes(lanes: int, some: int, arrays: Iterable[Any]) -> None:
    """Raise InputError where lanes do not fit into memory; arrays: named tuples of the arrays of ``some``."""
    needed = lanes / some * sum(numbers.nbytes for each in arrays for numbers in arrays_of(each))
    there = machine.memory()
    if needed > SHARE * there:
        raise InputError(
            f"{lanes:,} lanes would take {gigabytes(needed)}, but this machine has {gigabytes(there)} of "
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
    """An approximate duration with its unit, from years to seconds."""
    for unit, length in (("years", 365.25 * 86400), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length:
            count = seconds / length
            return f"about {count:,.0f} {unit}" if count < 1e9 else f"about {count:.1e} {unit}"
    return f"about {seconds:.0f} seconds"
