"""Loading of a catalogue entry or a TOML file, with validation."""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError

from ..base.checksums import remembered
from ..base.errors import InputError, UnusualWarning, nearest, shown, suggest
from ..base.files import read_toml
from ..base.settings import Settings, explain
from ..plant.catenary import CATENARIES, CatenaryData, check_line
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import LOWEST_TENSION
from ..plant.pantograph.schema import PantographData, check_at_rest
from .drawn_lines import DRAWN, DrawnLines
from .family import LineFamily
from .section import LineSection
from .values import Ranges, ranges_of, remarks

E = TypeVar("E", CatenaryData, PantographData)

Lines = CatenaryData | tuple[CatenaryData, ...] | LineFamily | LineSection
"""A line, lines to choose from, or a family or a section to draw from."""
_PLURALS = {
    "catenary": "catenaries",
    "pantograph": "pantographs",
    "family": "families",
    "section": "sections",
}
FOLDERS = {family: Path(__file__).parent / plural for family, plural in _PLURALS.items()}
SCHEMAS: dict[str, Mapping[str, type[Settings]]] = {
    "catenary": {name: kind.schema for name, kind in CATENARIES.items()},
    "pantograph": {"pantograph": PantographData},
    "family": {"family": LineFamily},
    "section": {"section": LineSection},
}
"""Schemas of each part of the catalogue by the value of ``kind``."""


@cache
def available(family: str) -> tuple[str, ...]:
    """Names in the catalogue; ``family`` is "catenary", "pantograph", "family" (of lines) or "section"."""
    return tuple(sorted(path.stem for path in FOLDERS[family].glob("*.toml")))


def load_catenary(source: str | Path | Mapping[str, Any] | CatenaryData) -> CatenaryData:
    """Line from a catalogue name, a TOML file, a table as ``line`` takes it, or an entry already loaded.

    Raises InputError, naming the file and the key, where it cannot be read or is not valid. Warns of values
    far from the catalogue's.
    """
    if drawn := drawn_kind(source):
        raise InputError(f"One line is needed here, not the {drawn[0]} '{source}' to draw from; name a line.")
    if isinstance(source, Mapping):
        return line(source)
    return _checked(source if isinstance(source, CatenaryData) else _load("catenary", source), source)


def load_pantograph(source: str | Path | Mapping[str, Any] | PantographData) -> PantographData:
    """Pantograph from a catalogue name, a TOML file, a table, or an entry already loaded, as lines are.

    Raises InputError, naming the file and the key, where it cannot be read or is not valid. Warns of values
    far from the catalogue's.
    """
    if isinstance(source, Mapping):
        return pantograph(source)
    return _checked(source if isinstance(source, PantographData) else _load("pantograph", source), source)


def line(
    table: Mapping[str, Any], like: str | Path | CatenaryData | None = None, name: str | None = None
) -> CatenaryData:
    """A line in memory, from a table such as a TOML file has, or from changes of another line.

    table: values, plain or with their sources, in tables or by dotted names: ``{"contact_wire.tension":
    27e3}``; droppers by ``spacing`` take the place of those by ``positions``, and the other way round. like:
    name, file or entry of the line whose values all others are. name: of the line, in tables and plots.
    Raises InputError, and warns, as ``load_catenary`` does.
    """
    return parse_catenary(*_changed("catenary", table, like, name))


def pantograph(
    table: Mapping[str, Any], like: str | Path | PantographData | None = None, name: str | None = None
) -> PantographData:
    """A pantograph in memory, as ``line`` makes lines; ``{"masses.1": 9.0}`` changes the first mass alone."""
    return parse_pantograph(*_changed("pantograph", table, like, name))


def _changed(
    family: str, table: Mapping[str, Any], like: Any, name: str | None
) -> tuple[dict[str, Any], Path]:
    """Table of a new entry and the path that names it."""
    nested: dict[str, Any] = {}
    for key, value in table.items():
        nested = _merged(nested, _nested(str(key), value), in_turn=())
    like, base = nested.pop("like", like), dict[str, Any]()
    if isinstance(like, Settings):
        base = like.model_dump(mode="json", exclude_none=True, exclude_unset=True, exclude={"sources"})
        base["kind"] = getattr(like, "kind", family)
    elif like is not None:
        base = read_toml(file_of(like, family))
    usual = f"like {getattr(like, 'name', Path(str(like)).stem)}" if like is not None else f"own {family}"
    base.pop("name", None)
    named = {"name": name or nested.pop("name", usual)}
    return _merged(base, nested | named), Path(named["name"])


def _nested(key: str, value: Any) -> dict[str, Any]:
    """The tables that a dotted name stands for."""
    first, _, others = key.partition(".")
    return {first: _nested(others, value) if others else value}


IN_TURN = (
    ({"spacing", "first", "pre_sag"}, {"positions", "sag"}),
    ({"stiffness"}, {"axial_stiffness"}),
    ({"stiffness"}, {"length", "clamp_mass"}),  # of a steady arm
    ({"sequence"}, {"spans"}),
    ({"uplift_over_speed"}, {"aerodynamic_coefficient", "aerodynamic_linear"}),
    ({"ratio", "frequencies"}, {"alpha", "beta"}),
    ({"span_lengths"}, {"spans"}),
)
"""Keys that exclude each other: where one is given, those of the other kind are no longer what they were."""


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any], in_turn: Any = IN_TURN) -> dict[str, Any]:
    """A table with the values of another one in the place of its own, table by table.

    in_turn: keys that exclude each other, as ``IN_TURN``; none within one table, which may not have both.
    """
    found = dict(base)
    for some, others in in_turn:
        for given, dropped in ((some, others), (others, some)):
            if given & changes.keys() and not dropped & changes.keys():
                found = {key: value for key, value in found.items() if key not in dropped}
    for key, value in changes.items():
        if _numbered(value) and key in found and not _numbered(found[key]):
            found[key] = _with_elements(key, found[key], value)
            continue
        tables = isinstance(value, Mapping) and isinstance(found.get(key), Mapping) and "value" not in value
        found[key] = _merged(found[key], value, in_turn) if tables else value
    return found


def _numbered(value: Any) -> bool:
    """Whether it holds elements of a list by their numbers."""
    return isinstance(value, Mapping) and bool(value) and all(str(number).isdigit() for number in value)


def _with_elements(key: str, given: Any, changes: Mapping[str, Any]) -> list[Any]:
    """A list with other elements, which count from 1. Raises InputError for one that it doesn't have."""
    whole = given["value"] if isinstance(given, Mapping) and "value" in given else given
    if not isinstance(whole, list | tuple):
        raise InputError(f"'{key}' is no list of the entry that is changed, so it has no element by number.")
    found = list(whole)
    for number, value in changes.items():
        if not 1 <= int(number) <= len(found):
            raise InputError(f"'{key}' has elements 1 to {len(found)}, not {number}; they count from 1.")
        found[int(number) - 1] = value
    return found


def load_family(source: str | Path | LineFamily) -> LineFamily:
    """Family of lines from a catalogue name, a TOML file, or a family that is already loaded.

    Raises InputError, naming the file and the key, where it cannot be read, is not valid, or has no lines.
    Warns of values of an example line that are far from the catalogue's.
    """
    return source if isinstance(source, LineFamily) else _load_drawn("family", source)


def load_section(source: str | Path | LineSection) -> LineSection:
    """Section to draw from, from a catalogue name, a TOML file, or one already loaded; as ``load_family``."""
    return source if isinstance(source, LineSection) else _load_drawn("section", source)


def load_drawn(source: Any) -> LineFamily | LineSection:
    """A family or a section, by its name or TOML file with or without its kind before it, or already loaded.

    Raises InputError as ``load_family`` does.
    """
    if isinstance(source, LineFamily | LineSection):
        return source
    kind, name = drawn_kind(source) or (_kind_of(source), source)
    return load_section(name) if kind == "section" else load_family(name)


def load_lines(source: Any) -> Lines:
    """A line, a list of lines, or a family or a section by its kind, a colon and its name or TOML file.

    Raises InputError as ``load_catenary`` and ``load_family`` do, and for an empty list.
    """
    if isinstance(source, LineFamily | LineSection):
        return source
    if isinstance(source, list | tuple):
        if not source:
            raise InputError("A list of lines must have one line or more.")
        return tuple(load_catenary(each) for each in source)
    return load_drawn(source) if drawn_kind(source) else load_catenary(source)


def drawn_kind(source: Any) -> tuple[str, str] | None:
    """Kind and name, or file, of "family:name" or "section:name"; None for anything else."""
    kind, colon, name = source.partition(":") if isinstance(source, str) else ("", "", "")
    return (kind, name) if colon and kind in DRAWN else None


def _kind_of(source: Any) -> str:
    """Kind of a family or a section without it: the file's, or where the catalogue has its name."""
    if str(source).endswith(".toml"):
        return str(read_toml(source).get("kind"))
    return next((kind for kind in DRAWN if source in available(kind)), DRAWN[0])


def text_of(name: str) -> str:
    """Text of the TOML file of a line, pantograph, family or section of the catalogue, as a start for yours.

    Raises InputError where the catalogue does not have this name.
    """
    for family in FOLDERS:
        if name in available(family):
            return (FOLDERS[family] / f"{name}.toml").read_text(encoding="utf-8")
    known = [each for family in FOLDERS for each in available(family)]
    raise InputError(
        f"No line, pantograph, family or section of the catalogue is called '{name}': {suggest(name, known)}."
    )


def unusual(entry: CatenaryData | PantographData) -> list[str]:
    """A sentence for each value that is as far from the catalogue's as a wrong unit or sign makes it."""
    line = getattr(entry, "line", None)  # of a rig
    return remarks(entry, _ranges(entry.kind)) + (unusual(line) if isinstance(line, CatenaryData) else [])


@cache
def _ranges(kind: str) -> Ranges:
    entries = (_load(family, name) for family in ("catenary", "pantograph") for name in available(family))
    return ranges_of(entry for entry in entries if entry.kind == kind)


def _checked(entry: E, source: Any) -> E:
    """The entry, with a warning for each unusual value; those of the catalogue itself are not looked at."""
    if not (isinstance(source, str) and source == entry.name):
        for sentence in unusual(entry):
            warnings.warn(sentence, UnusualWarning, stacklevel=3)
    return entry


def _load_drawn(kind: str, source: Any) -> Any:
    found = _load(kind, source)
    if source != found.name:
        _checked(found.draw(np.random.default_rng(0))[0], source)
    return found


def _load(family: str, source: str | Path) -> Any:
    path = file_of(source, family)
    return _read(family, path, path.stat().st_mtime_ns)


def file_of(source: str | Path, family: str = "catenary") -> Path:
    """TOML file of a line by its name in the catalogue or its path, or of another part of the catalogue.

    Raises InputError where there is none.
    """
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
        if os.path.isfile(path):  # which accepts any name
            return path
        raise InputError(f"The {family} file {text} does not exist; give the path of a TOML file.")
    near = nearest(text, available(family))
    hint = f", did you mean {near}" if near else ""
    raise InputError(
        f"Unknown {family} '{text}'{hint}: known are {', '.join(available(family))}; "
        "or give the path of a .toml file."
    )


def parse_catenary(table: Mapping[str, Any], path: Path) -> CatenaryData:
    """Line from the table of a TOML file that need not be written yet; path: for its name and messages.

    Raises InputError, and warns, as ``load_catenary`` does.
    """
    line: CatenaryData = _checked(_entry("catenary", table, path), path)
    return line


def parse_pantograph(table: Mapping[str, Any], path: Path) -> PantographData:
    """Pantograph from the table of a TOML file, as ``parse_catenary`` does for lines."""
    pantograph: PantographData = _checked(_entry("pantograph", table, path), path)
    return pantograph


@cache
def _read(family: str, path: Path, _modified: int) -> Any:
    return _entry(family, read_toml(path), path)


def _entry(family: str, given: Mapping[str, Any], path: Path) -> Any:
    sources: dict[str, str] = {}
    try:
        table = {"name": path.stem, **_split(given, "", sources), "sources": sources}
        schema = _schema(family, table)
        if "line" in schema.model_fields and isinstance(table.get("line"), str):
            table["line"] = _load("catenary", table["line"])  # a rig may name its computed line
        if "base" in schema.model_fields and isinstance(table.get("base"), str):
            table["base"] = _base(table["base"])
        entry = schema.model_validate(table)
    except ValidationError as error:
        single = _hint_of_single(table) if schema is FlexibleCatenaryData else ""
        raise InputError(f"{path} is not a valid entry: {explain(error, schema)}{single}.") from error
    except _TableError as error:
        raise InputError(f"{path} is not a valid entry: {error}.") from error
    try:
        if isinstance(entry, CatenaryData):
            check_line(entry)
        elif isinstance(entry, DrawnLines) and path.parent != FOLDERS[family]:
            entry.draw(np.random.default_rng(0))  # seconds; those of the catalogue are known to have lines
        elif isinstance(entry, PantographData):
            check_at_rest(entry)
    except InputError as error:
        raise InputError(f"{path} is not a valid entry: {error}") from error
    return entry


def _hint_of_single(table: Mapping[str, Any]) -> str:
    """What to do where a flexible line lacks a messenger, droppers or tension, as a tram's or a rail does."""
    wire = table.get("contact_wire")
    tension = wire.get("tension") if isinstance(wire, Mapping) else None
    slack = isinstance(tension, int | float) and tension < LOWEST_TENSION
    if slack or not {"messenger_wire", "droppers"} <= table.keys():
        return '; a wire without messenger and droppers, or a rail without tension, is of kind "single"'
    return ""


def _base(source: str) -> Any:
    """The line, or the family of lines, whose wires a section has."""
    kind, name = drawn_kind(source) or ("catenary", source)
    try:
        base = _load(kind, name)
    except InputError as error:
        raise _TableError(f"key 'base' names no line: {str(error).rstrip('.')}") from error
    if not isinstance(base, FlexibleCatenaryData | LineFamily):
        raise _TableError(f"key 'base' must be a flexible line or a family of them (given: {shown(source)})")
    return base


def _schema(family: str, table: Mapping[str, Any]) -> type[Settings]:
    """The schema of the table's kind, checked first: a wrong schema would make all other keys look wrong."""
    schemas = SCHEMAS[family]
    kinds = f"{'one of ' if len(schemas) > 1 else ''}{', '.join(map(repr, schemas))}"
    if len(schemas) == 1 and "kind" not in table:
        return next(iter(schemas.values()))
    if "kind" not in table:
        raise _TableError(f"key 'kind' is missing: {kinds}")
    kind = table["kind"]
    if family in ("catenary", *DRAWN) and kind in DRAWN and kind != family:
        what = "a family of lines" if kind == "family" else "a section to draw from"
        raise _TableError(f"it is {what}, so give it with '{kind}:' before its path")
    if not isinstance(kind, str) or kind not in schemas:
        raise _TableError(f"key 'kind' must be {kinds} (given: {shown(kind)})")
    return schemas[kind]


class _TableError(Exception):
    """An error in a table: an unknown kind, or a table of value and source with other keys."""


def _split(table: Mapping[str, Any], prefix: str, sources: dict[str, str]) -> dict[str, Any]:
    """Values without sources; the sources in ``{ value = ..., source = ... }`` go to ``sources``."""
    values: dict[str, Any] = {}
    for key, item in table.items():
        place = f"{prefix}{key}"
        if isinstance(item, dict) and not item.keys().isdisjoint({"value", "source"}):
            if "value" not in item or not set(item) <= {"value", "source"}:
                raise _TableError(
                    f"key '{place}' must hold 'value' and optionally 'source', and nothing "
                    f"else (given: {', '.join(map(repr, item))})"
                )
            sources[place] = str(item.get("source", "not given"))
            values[key] = item["value"]
        elif isinstance(item, dict):
            values[key] = _split(item, f"{place}.", sources)
        else:
            values[key] = item
    return values


WORDS = ("name", "description", "sources", "published")
"""Keys that say nothing of the values."""


@remembered
def content_of(entry: CatenaryData | PantographData) -> str:
    """SHA-256 of a line's or a pantograph's values, in hexadecimal.

    Values at their defaults are left out, so that a key that is added later changes nothing.
    """
    # By its own class, not a base's; a rig holds a line.
    values = _without_words(entry.model_dump(mode="json", exclude_defaults=True, serialize_as_any=True))
    return hashlib.sha256(json.dumps([type(entry).__name__, values], sort_keys=True).encode()).hexdigest()


def content_unless_catalogue(entry: CatenaryData | PantographData) -> str | None:
    """``content_of`` an entry, or None where the catalogue has it by its name, with the same values."""
    found = content_of(entry)
    return None if _content_in_catalogue(entry, entry.name) == found else found


def is_entry(entry: CatenaryData | PantographData, name: str, content: str | None) -> bool:
    """Whether a line or a pantograph is the one stored by its name and ``content_unless_catalogue``."""
    known = _content_in_catalogue(entry, name) if content is None else content
    return known == content_of(entry)  # None where it was a file's: there is nothing to know its values by


def _content_in_catalogue(entry: CatenaryData | PantographData, name: str) -> str | None:
    """``content_of`` the catalogue's entry of a name, of the kind of ``entry``; None where it has none."""
    family = "catenary" if isinstance(entry, CatenaryData) else "pantograph"
    return content_of(_load(family, name)) if name in available(family) else None


def _without_words(values: Any) -> Any:
    if isinstance(values, dict):
        return {key: _without_words(value) for key, value in values.items() if key not in WORDS}
    return values
