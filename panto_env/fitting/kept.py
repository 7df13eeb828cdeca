"""Where a fit is, kept in a file, so that one that was broken off goes on there."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.checksums import read_arrays, write_arrays
from ..records.record import Record
from .misfit import OWN, State

ARRAYS = ("x", "static_forces", "noise")
SUFFIX = ".fit"
"""Of the file, behind the name of the output."""


def identity_of(records: Sequence[Record], settings: dict[str, Any]) -> dict[str, Any]:
    """What a fit is of: records by their samples, and settings as plain data."""
    digest = hashlib.sha256()
    for record in records:
        for piece in record.pieces:
            for series in (piece.position, piece.force):
                digest.update(np.ascontiguousarray(series).tobytes())
    return {"records": digest.hexdigest(), "own": list(OWN), **settings}


def keep(path: Path, state: State, identity: dict[str, Any]) -> None:
    """Write where a fit is. Raises InputError where that cannot be written."""
    arrays = {name: np.ascontiguousarray(getattr(state, name)) for name in ARRAYS}
    write_arrays(path, identity | {"steps": state.steps}, arrays)


def kept(path: Path, identity: dict[str, Any]) -> State | None:
    """Where the same fit was broken off; None where no file, or another fit's, is there."""
    try:
        table, arrays = read_arrays(path)
    except (OSError, ValueError):
        return None
    steps = table.pop("steps", None)
    if table != identity or set(arrays) != set(ARRAYS) or not isinstance(steps, int):
        return None
    return State(**arrays, steps=steps)
