"""Check of a controller's action: only real numbers of the right shape are accepted."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, shortly

SINGLE, DOUBLE = np.dtype(np.float32), np.dtype(np.float64)
NUMBERS = "fiub"
"""Kinds of NumPy's types that are real numbers; text and complex numbers would be cast to them."""


def checked(action: Any, shape: tuple[int, ...]) -> Array:
    """The action as an array of real numbers with this shape. Raises InputError for anything else."""
    plain = type(action) is np.ndarray and (action.dtype is SINGLE or action.dtype is DOUBLE)
    force: Array | None = action if plain else numbers(action)
    if force is None:
        raise InputError(f"The action must be numbers in -1..1 of shape {shape}, not {shortly(action)}.")
    if force.shape != shape:
        raise InputError(f"The action must have the shape {shape}, not {force.shape}.")
    return force


def not_finite(action: Array, row: int, several: bool) -> InputError:
    """The error for actions, (rows, actions), of which that of a row is not finite; several: rows."""
    whose = f" of lane {row}" if several else ""
    return InputError(f"The action{whose} must be finite, not {action[row]}; check the policy.")


def numbers(action: Any) -> Array | None:
    """The action as an array of floats; None where it is not made of real numbers, or some are masked."""
    if isinstance(action, np.ma.MaskedArray):
        return None
    try:
        given = np.asarray(action)
        return given.astype(np.float64) if given.dtype.kind in NUMBERS else None
    except Exception:  # for ragged lists, or an object that only looks like an array
        return None
