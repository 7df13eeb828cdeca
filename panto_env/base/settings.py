"""Settings as data: ranges of numbers, values from text, and errors in words."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Annotated, Any, NamedTuple, Self, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, ErrorDetails, PydanticCustomError, core_schema

from .errors import InputError, nearest, shortly, shown, suggest


@dataclass(frozen=True)
class Between:
    """Annotation of a ``float`` or ``int`` that must lie from ``low`` to ``high``, both included.

    Text, truth values, nan and infinity are refused. The message names the range and the unit, so that a
    value in kN or mm is noticed.
    """

    low: float
    high: float
    unit: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """A check before the type's own: pydantic would accept text and truth values as numbers."""
        check = partial(self._checked, whole=source is int)
        return core_schema.no_info_before_validator_function(check, handler(source))

    def _checked(self, value: Any, whole: bool) -> Any:
        usable = isinstance(value, Real) and not isinstance(value, bool)
        if usable and self.low <= value <= self.high and not (whole and value != math.floor(value)):
            return int(value) if whole else float(value)
        number = "a whole number" if whole else "a number"
        unit = f" {self.unit}" if self.unit else ""
        raise PydanticCustomError("range", f"must be {number} from {self.low:,g} to {self.high:,g}{unit}")


def ranges_of(annotation: Any) -> Iterator[Between]:
    """The ranges of an annotation and of its parts, such as the numbers of a tuple."""
    for part in get_args(annotation):
        if isinstance(part, Between):
            yield part
        yield from ranges_of(part)


TRUTH = {"true": True, "false": False}
"""As TOML writes them; Python's own are literals."""
OPENING, CLOSING, QUOTES = "([{", ")]}", "'\""


def parse_inline(text: str) -> dict[str, Any]:
    """Values by name from "name=value,name=value"; a value is a Python literal, true or false, or else
    a word.

    Commas within brackets and quotes belong to a value. Raises InputError where a part has no "=", or a
    name occurs twice.
    """
    values: dict[str, Any] = {}
    for part in filter(None, map(str.strip, _parts(text))):
        key, equals, value = part.partition("=")
        name = key.strip()
        if not (equals and name):
            raise InputError(f"'{part}' must read name=value.")
        if name in values:
            raise InputError(f"'{name}' is given twice.")
        word = value.strip()
        try:
            values[name] = TRUTH[word] if word in TRUTH else ast.literal_eval(word)
        except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):  # not a literal
            values[name] = word
    return values


def _parts(text: str) -> Iterator[str]:
    """Parts between commas outside brackets and quotes."""
    depth, quote, begin = 0, "", 0
    for place, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in QUOTES:
            quote = letter
        elif letter == "," and depth <= 0:
            yield text[begin:place]
            begin = place + 1
        else:
            depth += (letter in OPENING) - (letter in CLOSING)
    yield text[begin:]


WORDS = {
    "float_parsing": "must be a number",
    "float_type": "must be a number",
    "int_parsing": "must be a whole number",
    "int_type": "must be a whole number",
    "bool_parsing": "must be true or false",
    "bool_type": "must be true or false",
    "too_short": "must not be empty",
    "model_type": "must be a table",
    "dict_type": "must be a table",
    "string_type": "must be a text",
}
"""Words by pydantic's name of an error; for others pydantic's own words are used."""

MOST = 8
"""Maximum number of wrong keys that are explained; the others are counted."""


class Complaint(NamedTuple):
    """An error at one key."""

    key: str  # dotted, lists counted from 1; "" for the table as a whole
    words: str  # "must be ...", or a clause of its own
    given: str  # the given value, "" where it does not help
    clause: bool  # whether the words stand alone


def explain(error: ValidationError, kind: type[BaseModel]) -> str:
    """One clause per wrong key of a table of ``kind``; of many only the first ones, and their number."""
    clauses = []
    found = complaints(error, kind)
    for key, words, given, clause in filter(None, found):
        place = "" if not key else f"key '{key}': " if clause else f"key '{key}' "
        clauses.append(f"{place}{words}{f' (given: {given})' if given else ''}")
    more = len(found) - len(clauses)
    return "; ".join(clauses) + (f"; and {more} more keys are wrong" if more > 0 else "")


def sentence(error: ValidationError, kind: type[BaseModel]) -> str:
    """Errors in keyword arguments, the first ones of many, as one sentence without its full stop."""
    clauses = []
    for key, words, given, clause in filter(None, complaints(error, kind)):
        clauses.append(words if clause else f"{key} {words}{f', not {given}' if given else ''}")
    return "; ".join(clauses)


def complaints(error: ValidationError, kind: type[BaseModel]) -> list[Complaint | None]:
    """One complaint per key; errors of the alternatives of a union are joined.

    None for keys beyond the first ``MOST``: a file may hold thousands, and the nearest known name takes time.
    """
    found: dict[str, Complaint | None] = {}
    for problem in error.errors():
        if problem["type"] == "too_short" and len(problem["input"]) and len(error.errors()) > 1:
            continue  # wrong entries are not counted, but explained by their own errors
        key = ".".join(map(str, _place(problem, kind)[0]))
        before = found.get(key)
        if before is None and len(found) >= MOST:
            found[key] = None
            continue
        one = _complaint(problem, kind)
        if before is not None:
            one = before._replace(words=f"{before.words} or {one.words.removeprefix('must be ')}")
        found[key] = one
    return list(found.values())


def comma_hint(ours: int, theirs: int) -> str:
    """Advice where one of two lists that go together is twice as long as the other, else nothing."""
    double = max(ours, theirs) == 2 * min(ours, theirs) > 0
    return " (decimals need a point: a comma begins a new value)" if double else ""


def dotted(place: Iterable[int | str]) -> str:
    """Keys and places in lists as one name, such as "masses.1" for the first of the masses."""
    return ".".join(str(part + 1 if isinstance(part, int) else part) for part in place)


def _complaint(problem: ErrorDetails, kind: type[BaseModel]) -> Complaint:
    place, fields = _place(problem, kind)
    key, given = dotted(place), shortly(problem["input"])
    match problem["type"]:
        case "missing":
            field = fields.get(str(place[-1]))  # None where a list is too short
            words = f": {field.description or _table_of(field)}" if field is not None else ""
            return Complaint(key, f"is missing{words}", "", False)
        case "extra_forbidden":
            known = [name for name in fields if name != "sources"]
            near = nearest(str(place[-1]), known)
            words = f"did you mean {near}" if near else f"known are {', '.join(known)}"
            return Complaint(key, f"is not known: {words}", "", False)
        case "value_error":
            words = problem["msg"].removeprefix("Value error, ").removesuffix(".")
            cause = problem.get("ctx", {}).get("error")
            whole = isinstance(cause, InputError) or not words.startswith("must ")
            return Complaint(key, words, "" if whole else given, whole)
        case "tuple_type":
            return Complaint(key, f"must be a list, such as [{given}]", "", False)
        case "too_long":
            return Complaint(key, f"must hold at most {problem['ctx']['max_length']} values", "", False)
        case "too_short" if problem["ctx"]["min_length"] > 1:
            return Complaint(key, f"must hold at least {problem['ctx']['min_length']} values", given, False)
        case other:
            words = WORDS.get(other, problem["msg"].replace("Input should be", "must be"))
            return Complaint(key, words, given, False)


def _place(problem: ErrorDetails, kind: type[BaseModel]) -> tuple[list[int | str], dict[str, FieldInfo]]:
    """The keys and indices that lead to a problem, and the fields of the table that holds it.

    The names of a union's alternatives, which pydantic inserts, are left out.
    """
    place: list[int | str] = []
    fields: dict[str, FieldInfo] = kind.model_fields
    inner: type[BaseModel] | None = kind
    last = len(problem["loc"]) - 1
    for number, part in enumerate(problem["loc"]):
        if isinstance(part, int):
            place.append(part)
            continue
        if inner is not None:
            fields, inner = inner.model_fields, None
        if part in fields:
            place.append(part)
            inner = next(_tables_in(fields[part].annotation), None)
        elif number == last and problem["type"] == "extra_forbidden":
            place.append(part)
    return place, fields


def _tables_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _tables_in(part)


def _table_of(field: FieldInfo) -> str:
    table = next(_tables_in(field.annotation), None)
    return "a value" if table is None else f"a table of {', '.join(table.model_fields)}"


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
            try:
                given = parse_inline(changes)
            except InputError as error:
                raise InputError(f"{name} is not valid: {error}") from error
            own = presets[preset]
            return _validated(type(own), own.model_dump() | given, name) if given else own
    options = [f"'{preset}'" for preset in presets]
    if presets:
        options[-1] += f" (with values, such as '{next(iter(presets))}:{next(iter(kind.model_fields))}=...')"
    options.append(f"a table with keys among {', '.join(kind.model_fields)}")
    raise InputError(f"{name} must be {' or '.join(options)}, not {shown(value)}.")


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
