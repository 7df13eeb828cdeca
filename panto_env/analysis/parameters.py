"""Parameters by dotted names, as in the TOML files, for example ``pantograph.masses.1``, the first mass."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any, TypeVar

from pydantic import ValidationError

from ..base.errors import InputError, hint
from ..base.settings import Settings, complaints, explain, ranges_of
from ..catalog import load_pantograph
from ..control.settings import run_settings
from ..plant.catenary import CatenaryData, check_line
from ..plant.catenary.flexible.parts import Droppers, Span
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.spans import Spacing, droppers_of
from ..plant.pantograph.schema import PantographData

S = TypeVar("S", bound=Settings)
RULES = ("spacing", "pre_sag")  # of droppers, in the place of their positions and sags


def parameter_names(entry: Settings, family: str) -> list[str]:
    """Dotted names, ``family`` first, of all values of an entry that are or can be numbers."""
    names = []
    for key, field in type(entry).model_fields.items():
        value = getattr(entry, key)
        if isinstance(value, Settings) and key != "published":  # on which nothing depends
            names += parameter_names(value, f"{family}.{key}")
            if isinstance(value, Droppers):  # also by the rule that lays them out
                names += [f"{family}.{key}.{rule}" for rule in RULES]
        elif isinstance(value, tuple):
            names += _places(value, f"{family}.{key}")
        elif _is_number(value) or any(ranges_of(field.rebuild_annotation())):  # "rigid" or None now
            names.append(f"{family}.{key}")
    return names


def check_name(name: str, entry: Settings) -> None:
    """Raise InputError, with a suggestion, unless an entry has a parameter of this dotted name."""
    family = name.partition(".")[0]
    known = parameter_names(entry, family)
    if name in known:
        return
    owner = getattr(entry, "name", None)
    # Only the first place of each list is shown: droppers alone would fill the line.
    shown = [name for name in known if not name[-1].isdigit() or name.endswith(".1")]
    raise InputError(
        f"Unknown parameter '{name}'{f' of {owner}' if owner else ''}: {hint(name, known)}"
        f"known are {', '.join(shown)}"
        f"{' (lists count from 1)' if shown != known else ''}."
    )


def parameter_label(name: str, entry: Any) -> str:
    """Label of a parameter with its unit, for example "pantograph: masses, head first, 1st (kg)"."""
    family, *path = name.split(".")
    words = [family.replace("_", " ")]
    while path:
        key = path.pop(0)
        rules = Spacing.model_fields if isinstance(entry, Droppers) else {}
        text = (type(entry).model_fields | rules)[key].description or key
        entry = getattr(entry, key, None)
        if isinstance(entry, Settings):
            words.append(key.replace("_", " "))
        else:
            break
    unit = text[text.rfind(" (") :] if text.endswith(")") else ""
    places = [_ordinal(int(place)) for place in path]
    return ": ".join((*words, ", ".join((text.removesuffix(unit), *places)))) + unit


def change(entry: S, name: str, value: float) -> S:
    """The entry with another value of the parameter ``name``, whose first part names the family.

    Raises InputError where the entry has no such parameter, or cannot have the value.
    """
    check_name(name, entry)
    path = name.split(".")[1:]
    try:
        by_rule = path[0] == "droppers" and path[1] in RULES  # by which a line's droppers are placed
        if by_rule and isinstance(entry, FlexibleCatenaryData):
            table = entry.model_dump(exclude_none=True)
            table["droppers"] = droppers_of(table, {path[1]: value}, entry.span_length)
        else:
            table = _put(entry.model_dump(), path, value)
        return _checked(entry, table, {path[0]})
    except ValidationError as error:
        found = complaints(error, type(entry))
        words = (c.words if c.clause or name.endswith(c.key) else f"{c.key} {c.words}" for c in found if c)
        raise InputError(f"{name} cannot be {value:g}: {'; '.join(words)}.") from error
    except InputError as error:
        raise InputError(f"{name} cannot be {value:g}: {error}") from error


def change_together(entry: S, values: Mapping[str, float]) -> S:
    """The entry with other values of several parameters, which its schema validates together.

    Raises InputError as ``change`` does.
    """
    table = entry.model_dump()
    for name, value in values.items():
        check_name(name, entry)
        table = _put(table, name.split(".")[1:], value)
    try:
        return _checked(entry, table, {name.split(".")[1] for name in values})
    except ValidationError as error:
        raise InputError(f"These values do not go together: {explain(error, type(entry))}.") from error
    except InputError as error:
        raise InputError(f"These values do not go together: {error}") from error


def _checked(entry: S, table: Mapping[str, Any], keys: AbstractSet[str]) -> S:
    """An entry of the same class with the values of a table, in which these keys have changed.

    Raises InputError where it cannot exist, or where a value of a line is one that all its spans replace.
    """
    if isinstance(entry, FlexibleCatenaryData) and "span_length" in keys and "droppers" not in keys:
        own = entry.model_dump(exclude_none=True)
        table = {**table, "droppers": droppers_of(own, {}, table["span_length"])}
    changed = type(entry).model_validate(table)
    if isinstance(entry, FlexibleCatenaryData) and entry.sequence and changed != entry:
        assert isinstance(changed, FlexibleCatenaryData)
        if changed.layout() == entry.layout() and keys <= Span.model_fields.keys():
            raise InputError(
                f"Each span in the sequence of line '{entry.name}' has values of its own in the place of "
                f"{', '.join(sorted(keys))}, so nothing would change; change them in its file."
            )
    if isinstance(changed, CatenaryData):
        check_line(changed)
    return changed


def _places(values: tuple[Any, ...], prefix: str) -> Iterator[str]:
    for k, value in enumerate(values, start=1):
        if isinstance(value, tuple):
            yield from _places(value, f"{prefix}.{k}")
        elif _is_number(value):
            yield f"{prefix}.{k}"


def _ordinal(number: int) -> str:
    ending = "th" if number // 10 % 10 == 1 else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _put(data: Any, path: list[str], value: float) -> Any:
    """A copy of nested tables and tuples with another value at the end of the path."""
    if not path:
        return value
    key, *rest = path
    if isinstance(data, dict):
        return data | {key: _put(data.get(key), rest, value)}
    place = int(key) - 1
    return (*data[:place], _put(data[place], rest, value), *data[place + 1 :])


DISTANCES = "distances"


def is_distance(name: str) -> bool:
    """Whether a parameter is a distance of a pantograph behind the first."""
    return name.partition(".")[0] == DISTANCES


def riding(settings: Mapping[str, Any]) -> tuple[Any, ...]:
    """Pantographs of a train as they are given; none where there is only one."""
    several = settings.get("pantographs") or ()
    return tuple(several) if isinstance(several, list | tuple) else (several,)


def with_distances(settings: Mapping[str, Any], parameters: Mapping[str, Sequence[float]]) -> dict[str, Any]:
    """Settings in which each distance that is swept, and not given, has its first value.

    Raises InputError for a distance that the train does not have, or that is both given and swept.
    """
    swept = {name: values for name, values in parameters.items() if is_distance(name)}
    followers = len(riding(settings)) - 1
    places = {name: place(name, followers) for name in swept}
    if len({*places.values()}) < len(places):
        raise InputError(f"{' and '.join(places)} are the same distance; sweep it once.")
    if not swept or not all(swept.values()):  # a sweep without values is refused elsewhere
        return dict(settings)
    if settings.get(DISTANCES):
        if len(swept) == followers:
            raise InputError("The distances are swept already; give none besides.")
        return dict(settings)
    if len(swept) < followers:
        names = " or ".join(places)
        raise InputError(f"Only {names} is swept; give all distances of this train as a setting, too.")
    first = {places[name]: values[0] for name, values in swept.items()}
    return {**settings, DISTANCES: [first[k] for k in range(len(first))]}


def place(name: str, followers: int) -> int:
    """Index among the distances of a parameter, "distances" where there is one, else "distances.2".

    followers: number of pantographs behind the first. Raises InputError where the train has no such distance.
    """
    if followers < 1:
        raise InputError(
            f"{name} needs a train of several pantographs; name each of them, the first in front "
            "(--pantograph several times, or pantographs)."
        )
    known = [f"{DISTANCES}.{k + 1}" for k in range(followers)]
    if name == DISTANCES and followers == 1:
        return 0
    if name not in known:
        has = DISTANCES if followers == 1 else ", ".join(known)
        raise InputError(
            f"Unknown parameter '{name}': the distances behind the first pantograph of this train are {has}."
        )
    return known.index(name)


def placed(settings: Mapping[str, Any], values: Mapping[str, float]) -> tuple[float, ...]:
    """Distances of a train (m) with swept values in their places. InputError where they do not increase."""
    several, given = riding(settings), settings[DISTANCES]
    distances = list(given) if isinstance(given, list | tuple) else [given]
    for name in filter(is_distance, values):
        distances[place(name, len(several) - 1)] = values[name]
    return run_settings({"pantographs": several, DISTANCES: distances}).distances


def changed_train(settings: Mapping[str, Any], name: str, pantograph: PantographData) -> dict[str, Any]:
    """Settings of a train whose pantographs are another one, which a swept value of ``pantograph.`` makes.

    Empty for a single pantograph. Raises InputError where the train has pantographs that differ.
    """
    several = riding(settings)
    if not several:
        return {}
    own = [load_pantograph(each) for each in several]
    if any(each != own[0] for each in own):
        raise InputError(
            f"{name} changes all pantographs of a train, which must be the same for that, not "
            f"{' and '.join(each.name for each in own)}."
        )
    return {"pantographs": [pantograph] * len(own)}
