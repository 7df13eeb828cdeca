"""From a catalogue name or a TOML file to a validated entry."""

from __future__ import annotations

import reprlib
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Union

from pydantic import Field, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from ..base.errors import InputError
from ..base.files import read_toml
from ..base.settings import Settings, nearest
from ..plant.catenary import CATENARIES, CatenaryData
from ..plant.pantograph.schema import PantographData

FOLDERS = {
    "catenary": Path(__file__).parent / "catenaries",
    "pantograph": Path(__file__).parent / "pantographs",
}
_KINDS: dict[int | str, type[Settings]] = {name: kind.schema for name, kind in CATENARIES.items()}
_CATENARY: TypeAdapter[Any] = TypeAdapter(
    Annotated[Union[tuple(_KINDS.values())], Field(discriminator="kind")]  # type: ignore[arg-type] # noqa: UP007
)
_PANTOGRAPH: TypeAdapter[Any] = TypeAdapter(PantographData)
_UNION_PARTS = {"constrained-float", "literal['rigid']"}  # how pydantic names alternatives
_WORDS = {
    "float_parsing": "must be a number",
    "float_type": "must be a number",
    "tuple_type": "must be a list of numbers",
    "too_short": "must hold at least one number",
    "model_type": "must be a table",
    "string_type": "must be a text",
}


def available(family: str) -> tuple[str, ...]:
    """Names in the catalogue; ``family`` is "catenary" or "pantograph"."""
    return tuple(sorted(path.stem for path in FOLDERS[family].glob("*.toml")))


def load_catenary(source: str | Path | CatenaryData) -> CatenaryData:
    """Line of a catalogue name, of a TOML file, or an entry already loaded.

    Raises InputError, naming the file and the key, where it cannot be read or is not valid.
    """
    return source if isinstance(source, CatenaryData) else _load("catenary", source, _CATENARY)


def load_pantograph(source: str | Path | PantographData) -> PantographData:
    """Pantograph of a catalogue name, of a TOML file, or an entry already loaded.

    Raises InputError, naming the file and the key, where it cannot be read or is not valid.
    """
    if isinstance(source, PantographData):
        return source
    entry: PantographData = _load("pantograph", source, _PANTOGRAPH)
    return entry


def _load(family: str, source: str | Path, adapter: TypeAdapter[Any]) -> Any:
    path = _find(family, source)
    return _read(path, path.stat().st_mtime_ns, adapter)


def _find(family: str, source: str | Path) -> Path:
    if not isinstance(source, str | Path):
        raise InputError(
            f"A {family} must be a catalogue name, a TOML file or a catalogue entry, "
            f"not {type(source).__name__}."
        )
    text = str(source)
    if isinstance(source, str) and text in available(family):
        return FOLDERS[family] / f"{text}.toml"
    if text.endswith(".toml"):
        path = Path(text)
        if path.is_file():
            return path
        raise InputError(f"The {family} file {text} does not exist; give the path of a TOML file.")
    near = nearest(text, available(family))
    hint = f", did you mean '{near}'" if near else ""
    raise InputError(
        f"Unknown {family} '{text}'{hint}: known are {', '.join(available(family))}; "
        "or give the path of a .toml file."
    )


@cache
def _read(path: Path, _modified: int, adapter: TypeAdapter[Any]) -> Any:
    table = read_toml(path)
    sources: dict[str, str] = {}
    try:
        values = _split(table, "", sources)
        return adapter.validate_python({"name": path.stem, **values, "sources": sources})
    except ValidationError as error:
        raise InputError(f"{path} is not a valid entry: {_explain(error)}.") from error
    except _TableError as error:
        raise InputError(f"{path} is not a valid entry: {error}.") from error


class _TableError(Exception):
    """A table that is meant to give a value with its source, but does not."""


def _split(table: dict[str, Any], prefix: str, sources: dict[str, str]) -> dict[str, Any]:
    """Values alone; ``{ value = ..., source = ... }`` leaves its source in ``sources``."""
    values: dict[str, Any] = {}
    for key, item in table.items():
        place = f"{prefix}{key}"
        if isinstance(item, dict) and not item.keys().isdisjoint({"value", "source"}):
            if "value" not in item or not set(item) <= {"value", "source"}:
                raise _TableError(
                    f"key '{place}' must hold 'value' and, where wanted, 'source', and nothing "
                    f"else (given: {', '.join(map(repr, item))})"
                )
            sources[place] = str(item.get("source", "not given"))
            values[key] = item["value"]
        elif isinstance(item, dict):
            values[key] = _split(item, f"{place}.", sources)
        else:
            values[key] = item
    return values


def _explain(error: ValidationError) -> str:
    """Which keys are wrong, what each must be and what was given."""
    problems = error.errors()
    # A wrong kind makes every other key look wrong: say the cause alone.
    of_kind = [p for p in problems if p["type"].startswith("union_tag") or p["loc"] == ("kind",)]
    tagged = error.title != PantographData.__name__  # the place in a line begins with its kind
    said: dict[str, str] = {}
    for problem in of_kind or problems:
        loc = [part for part in problem["loc"] if part not in _UNION_PARTS]
        family = _KINDS[loc.pop(0)] if loc and tagged else PantographData
        key = ".".join(map(str, loc))
        words = _complaint(problem, loc, family)
        if key in said:  # the alternatives of a union complain one by one
            words = f"{said[key].partition(' (given: ')[0]} or {words.removeprefix('must be ')}"
        said[key] = words
    return "; ".join(f"key '{key}' {words}" if key else words for key, words in said.items())


def _complaint(problem: ErrorDetails, loc: list[int | str], family: type[Settings]) -> str:
    """What is wrong at the place ``loc`` of an entry."""
    kinds = ", ".join(map(repr, _KINDS))
    match problem["type"]:
        case "missing":
            field = _fields(family, loc)[str(loc[-1])]
            return f"is missing: {field.description or _table_of(field)}"
        case "extra_forbidden":
            known = [name for name in _fields(family, loc) if name != "sources"]
            near = nearest(str(loc[-1]), known)
            hint = f"did you mean '{near}'" if near else f"known are {', '.join(known)}"
            return f"is not known: {hint}"
        case "union_tag_not_found":
            return f"key 'kind' is missing: one of {kinds}"
        case "union_tag_invalid":
            return f"key 'kind' must be one of {kinds} (given: {problem['input']['kind']!r})"
        case "value_error":
            message = problem["msg"].removeprefix("Value error, ")
            return f"is not consistent: {message}" if loc else message
        case kind:
            words = _WORDS.get(kind, problem["msg"].replace("Input should be", "must be"))
            return f"{words} (given: {reprlib.repr(problem['input'])})"


def _fields(family: type[Settings], loc: list[int | str]) -> dict[str, FieldInfo]:
    """The keys of the table that holds the key at ``loc``."""
    table: Any = family
    for part in loc[:-1]:
        table = table.model_fields[part].annotation
    fields: dict[str, FieldInfo] = table.model_fields
    return fields


def _table_of(field: FieldInfo) -> str:
    table: Any = field.annotation
    return f"a table of {', '.join(table.model_fields)}"
