"""Explanation of errors in a table of settings: the key, its valid values, and the given value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from .errors import InputError
from .names import nearest
from .shown import shortly

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
