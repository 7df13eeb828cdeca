"""Check of a controller's action: only real numbers of the right shape are accepted."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from functools import wraps
from typing import Any, Concatenate, ParamSpec

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, nearest, shortly
from .settings import RunSettings, fields

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


P = ParamSpec("P")


def takes(
    kind: Callable[P, RunSettings], others: Collection[str] = (), taker: str = ""
) -> Callable[[Callable[[Any, dict[str, Any]], None]], Callable[Concatenate[Any, P], None]]:
    """Decorator that gives an ``__init__`` the keyword arguments of a class of settings.

    The decorated function receives the given arguments by name. An unknown one raises TypeError.
    """
    settings: type[RunSettings] = kind  # type: ignore[assignment]

    def decorate(initialise: Callable[[Any, dict[str, Any]], None]) -> Callable[Concatenate[Any, P], None]:
        @wraps(initialise)
        def with_keywords(self: Any, /, *arguments: Any, **given: Any) -> None:
            if arguments:
                raise TypeError(f"{type(self).__name__}() takes arguments by name, such as catenary='re250'")
            for name in given.keys() & others:
                raise TypeError(f"{type(self).__name__}() has no argument '{name}', which {taker} takes")
            check_arguments(given, settings, type(self).__name__)
            initialise(self, given)

        own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
        with_keywords.__signature__ = inspect.Signature([own, *parameters(settings)])  # type: ignore[attr-defined]
        return with_keywords

    return decorate


def parameters(kind: type[RunSettings] = RunSettings) -> list[inspect.Parameter]:
    """The settings as keyword-only parameters of a signature."""
    return [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=field.get_default())
        for name, field in fields(kind).items()
    ]


def check_arguments(given: Mapping[str, Any], kind: type[RunSettings], function: str) -> None:
    """Raise TypeError for a name that is not a setting, as Python does for an unknown argument."""
    for name in given:
        if name not in kind.model_fields:
            near = nearest(name, list(kind.model_fields))
            hint = f"; did you mean {near}?" if near else f"; known are {', '.join(fields(kind))}"
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'{hint}")


def table(kind: type[RunSettings] = RunSettings) -> str:
    """The settings as a Markdown table for a docstring."""
    rows = ["| Argument | Default | Meaning |", "|---|---|---|"]
    for name, field in fields(kind).items():
        rows.append(f"| `{name}` | `{field.get_default()!r}` | {field.description} |")
    return "\n".join(rows)
