"""A fitted line or pantograph as a TOML file: the design's text with other values, its comments kept."""

from __future__ import annotations

import re
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..base.errors import InputError
from ..base.files import check_output, write_text
from ..catalog.loader import file_of, parse_catenary, parse_pantograph
from ..catalog.values import in_toml
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import CatenaryData
from .fit import INTERVAL, Fit, Found
from .values import CHAIN, damping_of


def with_value(text: str, key: str, value: Any, source: str, name: str) -> str:
    """The text with another value, and source, of a key such as "spans" or "damping.alpha".

    name: of the file, for messages. Raises InputError where the key has no line of its own.
    """
    section, _, last = key.rpartition(".")
    begin, end = _section(text, section)
    entry = in_toml(last, value, source)
    line = re.compile(rf"^[ \t]*{re.escape(last)}[ \t]*=.*$", re.MULTILINE)
    changed, count = line.subn(lambda _: entry, text[begin:end])
    made = text[:begin] + changed + text[end:]
    if count != 1 or _read(made).get(key) != value:
        where = f", in a table [{section}]" if section else ""
        raise InputError(f"{key} of {name} cannot be replaced: write {last} in a line of its own{where}.")
    return made


def with_table(
    text: str, section: str, values: Mapping[str, Any], sources: Mapping[str, str], name: str
) -> str:
    """The text with a table at its end, instead of the one of that name if there is one.

    name: of the file, for messages. Raises InputError where what is there is no table of its own.
    """
    begin, end = _section(text, section)
    if begin < len(text):
        text = text[: text.rfind("\n", 0, begin) + 1] + text[end:]
    rest = _read(text)
    lines = [in_toml(key, value, sources[key]) for key, value in values.items()]
    made = "\n".join([text.rstrip(), "", f"[{section}]", *lines]) + "\n"
    if _read(made) != rest | {f"{section}.{key}": value for key, value in values.items()}:
        raise InputError(f"{section} of {name} cannot be replaced: write it as a table [{section}].")
    return made


def _section(text: str, section: str) -> tuple[int, int]:
    """Where the lines of a table begin and end; of none, those before the first table."""
    headers = [(match.start(), match.end(), match[1].strip()) for match in _HEADER.finditer(text)]
    begin = 0 if not section else next((end for _, end, name in headers if name == section), len(text))
    return begin, next((start for start, _, _ in headers if start >= begin), len(text))


_HEADER = re.compile(r"^[ \t]*\[{1,2}[ \t]*([A-Za-z_][^\[\],\n]*)\]{1,2}[ \t]*(?:#.*)?$", re.MULTILINE)
"""Of a table, and not a row of numbers in a list."""


def _read(text: str) -> dict[str, Any]:
    """Values by dotted keys; none where the text is no TOML."""
    try:
        return dict(_flat(tomllib.loads(text), ""))
    except tomllib.TOMLDecodeError:
        return {}


def _flat(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, item in table.items():
        if isinstance(item, dict) and "value" not in item:
            yield from _flat(item, f"{prefix}{key}.")
        else:
            yield prefix + key, item["value"] if isinstance(item, dict) else item


SUFFIXES = (".toml",)


def check_design(line: CatenaryData, base: str | Path, free: Sequence[str]) -> None:
    """Refuse a design in whose text fitted values could not be written, before hours are spent on them.

    line: the design; base: as of ``write_line``; free: kinds of values. Raises InputError with what to
    change.
    """
    text = file_of(base).read_text(encoding="utf-8-sig")
    if isinstance(line, FlexibleCatenaryData) and "damping" in free:
        for name, value in line.damping:
            if value > 0:
                text = with_value(text, f"damping.{name}", value, "", str(base))
    with_table(text, "as_found", {}, {}, str(base))


def write_line(fit: Fit, base: str | Path, path: str | Path, records: str) -> None:
    """Write the line with what was found, for ``panto simulate --catenary``, whole or not at all.

    base: the design, a name of the catalogue or a TOML file, whose text is kept. The table ``as_found`` holds
    by how much droppers, supports and tensions differ: together the most likely values, also where the
    records hardly determine one alone, which sources count. records: their names, for the sources. Raises
    InputError for another suffix, for a design whose values cannot be replaced, for values that no line may
    have, or where it cannot be written.
    """
    check_output(path, SUFFIXES)
    text = file_of(base).read_text(encoding="utf-8-sig")
    design = fit.problem.values.design
    for each in fit.of_kind("damping"):
        if each.identifiable:
            name = each.value.index[0]
            value = damping_of(design.catenary, name, each.difference)
            text = with_value(text, f"damping.{name}", value, source([each], records), str(base))
    values, sources = as_found(fit, records)
    needed = design.first_span + design.spans
    if not design.catenary.ends and needed > design.catenary.spans:
        text = with_value(text, "spans", needed, f"as long as {records}", str(base))
    text = with_table(text, "as_found", values, sources, str(base))
    _write(path, text, "line", parse_catenary)


def write_pantograph(fit: Fit, base: str | Path, path: str | Path, records: str) -> None:
    """Write the pantograph with its fitted values, as ``write_line`` does."""
    check_output(path, SUFFIXES)
    text = file_of(base, "pantograph").read_text(encoding="utf-8-sig")
    design = fit.problem.values.design.pantograph
    every = [each for each in fit.of_kind("pantograph") if each.identifiable]
    for name in CHAIN:
        if found := {each.value.index[1]: each for each in every if each.value.index[0] == name}:
            values = list(getattr(design, name))
            for k, each in found.items():
                values[k] *= 1 + each.difference
            numbers = ", ".join(str(k + 1) for k in found)
            words = f"number {numbers} {source(list(found.values()), records)}"
            text = with_value(text, name, values, words, str(base))
    _write(path, text, "pantograph", parse_pantograph)


def as_found(fit: Fit, records: str) -> tuple[dict[str, Any], dict[str, str]]:
    """A line condition of the most likely values, and the source of each of its keys."""
    design = fit.problem.values.design
    line = design.catenary
    known = {} if line.as_found is None else line.as_found.model_dump(mode="json", exclude_defaults=True)
    sources = {key: line.sources.get(f"as_found.{key}", "not given") for key in known}
    keys = ("miscut_droppers", "raised_supports")
    rows = ({tuple(place): wrong for *place, wrong in known.get(key, ())} for key in keys)
    cut, raised = (defaultdict[tuple[int, ...], float](float, own) for own in rows)
    # All of them, also those that the records hardly determine: droppers were found together with these.
    found = {kind: fit.of_kind(kind) for kind in ("droppers", "supports", "tensions")}
    for each in found["droppers"]:
        cut[design.place(each.value.index[0])] += each.difference
    for each in found["supports"]:
        raised[(each.value.index[0] + 1 + design.first_span,)] += each.difference
    values: dict[str, Any] = dict(known)
    for key, kind, places in zip(keys, ("droppers", "supports"), (cut, raised), strict=True):
        if found[kind]:
            # To a micrometre. What stands before the line's first support has no place in its file.
            rounded = ([*place, round(wrong, 6)] for place, wrong in sorted(places.items()) if place[0] >= 1)
            values[key] = [row for row in rounded if row[-1]]
            sources[key] = source(found[kind], records)
    for each in found["tensions"]:
        key = f"lost_{('contact', 'messenger')[each.value.index[0]]}_tension"
        values[key] = round(1 - (1 - known.get(key, 0.0)) * (1 + each.difference), 6)
        sources[key] = source([each], records)
    return values, sources


def source(found: list[Found], records: str) -> str:
    """Source of values that were fitted, with the size of their 95 % intervals."""
    sizes = sorted(INTERVAL * each.value.scale * each.deviation for each in found)
    size = f"{sizes[0]:.2g}" if len(sizes) == 1 else f"{sizes[0]:.2g} to {sizes[-1]:.2g}"
    silent = sum(not each.identifiable for each in found)
    more = f"; {silent} of {len(found)} hardly told by the records" if silent else ""
    return f"fitted to {records}; 95 % intervals of ±{size} {found[0].value.unit}{more}"


def _write(path: str | Path, text: str, what: str, parse: Callable[[dict[str, Any], Path], Any]) -> None:
    try:
        parse(tomllib.loads(text), Path(path))
    except InputError as error:
        raise InputError(
            f"The fit found values that no {what} may have, so none is written: {error} Check the line, the "
            "pantograph and the places of the records."
        ) from error
    write_text(path, text)
