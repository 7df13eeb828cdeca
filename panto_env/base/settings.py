"""Keyword arguments that are data: a preset's name, a table, or the settings themselves."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from .errors import InputError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Settings(BaseModel):
    """Frozen, validated data; an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Itself: what never changes need not be copied, and a copy of an environment should be quick."""
        return self


S = TypeVar("S", bound=Settings)


def parse(kind: type[S], value: Any, name: str, presets: Mapping[str, S] | None = None) -> S:
    """Settings from an instance, a table of its keys, or the name of a preset.

    Raises InputError, naming the argument and the key, where the value is not valid.
    """
    presets = presets or {}
    if isinstance(value, kind):
        return value
    if isinstance(value, str) and value in presets:
        return presets[value]
    if isinstance(value, Mapping):
        try:
            return kind.model_validate(plain(value))
        except ValidationError as error:
            raise InputError(f"{name} is not valid: {explain(error)}.") from error
    options = [f"'{preset}'" for preset in presets]
    options.append(f"a table with keys among {', '.join(kind.model_fields)}")
    raise InputError(f"{name} must be {' or '.join(options)}, not {value!r}.")


def parse_kind(
    kinds: Mapping[str, type[S]], value: Any, name: str, presets: Mapping[str, S] | None = None
) -> S:
    """As ``parse``, where the table's key "kind" says which of several settings are meant; else the first."""
    family = tuple(kinds.values())
    if isinstance(value, family):
        return value
    chosen = value.get("kind", next(iter(kinds))) if isinstance(value, Mapping) else next(iter(kinds))
    if chosen not in kinds:
        raise InputError(
            f"{name} is not valid: unknown kind {chosen!r}, {suggest(str(chosen), list(kinds))}."
        )
    return parse(kinds[chosen], value, name, presets)


def plain(value: Any) -> Any:
    """A value with NumPy's numbers as Python's own, in tables and lists too."""
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return value.item()
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    return value


def explain(error: ValidationError) -> str:
    """One clause per problem: the key, what was expected, what was given."""
    parts = []
    for problem in error.errors():
        key, given = _key(problem), problem["input"]
        shown = "" if isinstance(given, dict | BaseModel) else f" (given: {given!r})"
        parts.append(f"key '{key}': {message(problem)}{shown}" if key else message(problem))
    return "; ".join(parts)


def sentence(error: ValidationError) -> str:
    """What is wrong with keyword arguments, in one sentence without its full stop."""
    parts = []
    for problem in error.errors():
        cause = problem.get("ctx", {}).get("error")
        if isinstance(cause, InputError):
            parts.append(str(cause).removesuffix("."))
            continue
        words = message(problem).replace("Input should be", "must be")
        parts.append(f"{_key(problem)} {words}, not {problem['input']!r}")
    return "; ".join(parts)


def message(problem: ErrorDetails) -> str:
    """What Pydantic or a validator of ours says of one problem."""
    return problem["msg"].removeprefix("Value error, ")


def _key(problem: ErrorDetails) -> str:
    """The dotted key that a problem is at."""
    return ".".join(str(part) for part in problem["loc"])


def suggest(name: str, known: list[str] | tuple[str, ...]) -> str:
    """A clause with the nearest known name, if any is near, and all of them."""
    return f"{hint(name, known)}known are {', '.join(known)}"


def hint(name: str, known: list[str] | tuple[str, ...]) -> str:
    """A question that names the nearest known name, or nothing if none is near."""
    near = nearest(name, known)
    return "" if near is None else f"did you mean '{near}'? "


def nearest(name: str, known: list[str] | tuple[str, ...]) -> str | None:
    """The known name that is nearest to a misspelt one, if any is near."""
    near = difflib.get_close_matches(name, known, n=1)
    return near[0] if near else None
