"""What the record of a run takes of the machine's memory, asked before it is made."""

from __future__ import annotations

import numpy as np

from ..base import machine
from ..base.errors import InputError
from ..plant.state import CONTACTS, SAMPLE_ROWS

COPIES = 2
"""How often a record lies in memory: as it is written, and as a trajectory."""
SHARE = 0.7
"""Of the machine's memory that records may take."""


def record_size(lanes: int, steps: int, supports: int, droppers: int) -> int:
    """Bytes that a record of so many time steps takes, with these many supports and droppers recorded."""
    columns = CONTACTS * SAMPLE_ROWS + supports + droppers
    return COPIES * lanes * (steps + 1) * columns * np.dtype(float).itemsize


def check_memory(needed: float, what: str, remedy: str = "") -> None:
    """Raise InputError unless the machine has the memory (bytes) for the record of a run, or of several.

    remedy: what else helps, beginning with ", or".
    """
    there = machine.memory()
    if needed > SHARE * there:
        raise InputError(
            f"The record of {what} would take {needed / 1e9:,.1f} GB, and this machine has "
            f"{there / 1e9:,.1f} GB of memory; take a shorter distance, fewer spans, a higher speed or a "
            f"longer time step{remedy}."
        )
