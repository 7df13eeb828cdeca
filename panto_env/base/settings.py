"""Settings from keyword arguments: a preset's name, a table, or the settings themselves."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from .errors import InputError
from .explanation import explain
from .inline import parse_inline
from .names import suggest
from .shown import shown


def _number(value: Any, kind: str) -> Any:
    """The value, unless it is text or a truth value, which pydantic would accept as a number."""
    if isinstance(value, str | bytes | bool):
        raise PydanticCustomError(f"{kind}_type", "must be a number")
    return value


def _exact(schema: Any) -> Any:
    """A schema of pydantic, or part of one, whose numbers and truth values take nothing else."""
    if isinstance(schema, list):
        return [_exact(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    inner = {key: value if key in _NO_SCHEMAS else _exact(value) for key, value in schema.items()}
    match inner.get("type"):
        case "bool":
            return inner | {"strict": True}
        case "int" | "float" as kind:
            return core_schema.no_info_before_validator_function(partial(_number, kind=kind), inner)
    return inner


_NO_SCHEMAS = ("default", "expected", "metadata", "serialization")
"""Keys of a schema that hold values."""

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Settings(BaseModel):
    """Frozen, validated data; an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The usual schema, in which text is no number and no truth value, and a truth value no number."""
        schema: CoreSchema = _exact(handler(source))
        return schema

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Itself: frozen data need no copy, and a copy of an environment should be quick."""
        return self


S = TypeVar("S", bound=Settings)


def parse(kind: type[S], value: Any, name: str, presets: Mapping[str, S] | None = None) -> S:
    """Settings from an instance, a table of its keys, or a preset: "worn", or "worn:wear_depth=1e-3,...".

    Raises InputError, naming the argument and the key, where the value is not valid.
    """
    presets = presets or {}
    if isinstance(value, kind):
        return value
    if isinstance(value, Mapping):
        return _validated(kind, value, name)
    if isinstance(value, str):
        preset, _, changes = value.partition(":")
        if preset in presets:
            return _changed(presets[preset], changes, name)
    options = [f"'{preset}'" for preset in presets]
    if presets:
        options[-1] += f" (with values, such as '{next(iter(presets))}:{next(iter(kind.model_fields))}=...')"
    options.append(f"a table with keys among {', '.join(kind.model_fields)}")
    raise InputError(f"{name} must be {' or '.join(options)}, not {shown(value)}.")


def _changed(preset: S, changes: str, name: str) -> S:
    """A preset with values from "key=value,..."."""
    try:
        given = parse_inline(changes)
    except InputError as error:
        raise InputError(f"{name} is not valid: {error}") from error
    return _validated(type(preset), preset.model_dump() | given, name) if given else preset


def _validated(kind: type[S], table: Mapping[str, Any], name: str) -> S:
    try:
        return kind.model_validate(plain(table))
    except ValidationError as error:
        raise InputError(f"{name} is not valid: {explain(error, kind)}.") from error


def parse_kind(
    kinds: Mapping[str, type[S]], value: Any, name: str, presets: Mapping[str, S] | None = None
) -> S:
    """As ``parse``, for one of several settings classes: the table's key "kind", by default the first."""
    family = tuple(kinds.values())
    if isinstance(value, family):
        return value
    chosen = value.get("kind", next(iter(kinds))) if isinstance(value, Mapping) else next(iter(kinds))
    if not (isinstance(chosen, str) and chosen in kinds):
        raise InputError(
            f"{name} is not valid: unknown kind {shown(chosen)}, {suggest(shown(chosen), list(kinds))}."
        )
    return parse(kinds[chosen], value, name, presets)


def plain(value: Any) -> Any:
    """A value with NumPy's numbers converted to Python's, in tables and lists too."""
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return value.item()
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    return value
