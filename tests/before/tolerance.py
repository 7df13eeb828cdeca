"""Cases whose numbers may differ a little between two versions, and by how much."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping
from typing import Any

import numpy as np

CASES = ("*PantographStiffness-v0*", "*periodic-stiffness*", "pass, stiffness: *", "*paper3-parameters")
"""Cases of the massless line, whose lanes once went through a step together, in vectors: their sums and
products may be rounded otherwise. All other cases must have the same bits."""
TOLERANCES = {np.dtype(np.float64): 1e-12, np.dtype(np.float32): 2e-7}
"""Largest difference of two numbers, relative to the largest number of their part. In float32, as of
observations, it is about one unit in the last place."""


def within_tolerance(case: str) -> bool:
    """Whether the numbers of a case may differ within the tolerance."""
    return any(fnmatch.fnmatch(case, pattern) for pattern in CASES)


def join(case: str, part: str) -> str:
    """Name of a part's numbers among those of all cases."""
    return f"{case}|{part}"


def differences(
    case: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, tuple[float, bool]]:
    """Largest relative difference of the numbers in each part of a case, and whether it is tolerated."""
    found = {}
    for key in (each for each in before if each.startswith(join(case, ""))):
        old, new = before[key], after.get(key)
        if new is None or old.shape != new.shape or old.dtype != new.dtype:
            found[key.partition("|")[2]] = np.inf, False
            continue
        same = (old == new) | (np.isnan(old) & np.isnan(new))  # infinite ones too
        apart = np.abs(np.subtract(old, new, out=np.zeros_like(old), where=~same))
        size = np.max(np.abs(old[np.isfinite(old)]), initial=0.0)
        largest = float(np.max(apart, initial=0.0) / (size or 1.0)) if not np.isnan(apart).any() else np.inf
        found[key.partition("|")[2]] = largest, largest <= TOLERANCES[old.dtype]
    return found
