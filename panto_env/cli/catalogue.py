"""Descriptions of everything with a name: lines, pantographs, policies, presets of settings."""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel
from rich.table import Table
from typer import Argument, Option

from ..base.errors import InputError, suggest
from ..base.files import finite, read_toml
from ..base.table import TABLES, write_rows
from ..catalog import available, load_catenary, load_family, load_pantograph, load_section
from ..catalog.drawn_lines import DrawnLines
from ..catalog.loader import SCHEMAS, text_of
from ..catalog.values import by_value, values_of
from ..plant.actuators import ACTUATOR_PRESETS
from ..plant.catenary.flexible.static import (
    HEADINGS,
    RestingDropper,
    as_rows,
    dropper_table,
    droppers_at_rest,
)
from ..plant.catenary.schema import CatenaryData
from ..plant.line_condition import LINE_CONDITIONS
from ..plant.pantograph.schema import PantographData
from ..plant.sensors import SENSOR_PRESETS
from ..policies import maker_of, parameters_of, policy_names
from ..terminal import Json, console, into_file, print_json, print_table

Entry = CatenaryData | PantographData | DrawnLines
LOADERS: Mapping[str, Callable[[str], Entry]] = {
    "catenary": load_catenary,
    "pantograph": load_pantograph,
    "family": load_family,
    "section": load_section,
}
PRESETS: Mapping[str, Mapping[str, BaseModel]] = {
    "line_condition": LINE_CONDITIONS,
    "actuator": ACTUATOR_PRESETS,
    "sensors": SENSOR_PRESETS,
}
"""Presets by setting."""
POLICY = "policy"


class Description(NamedTuple):
    """Description of one line, pantograph, policy or preset."""

    family: str
    name: str
    text: str  # paragraphs
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    data: Any  # the same content for JSON
    droppers: Sequence[RestingDropper] = ()  # of a span of a line


def everything() -> dict[str, list[Description]]:
    """Descriptions of everything with a name, by family."""
    found = {
        family: [_entry(family, load(each)) for each in available(family)] for family, load in LOADERS.items()
    }
    found[POLICY] = [_policy_or_why_not(name) for name in policy_names()]
    return found | {
        family: [_preset(family, each) for each in presets] for family, presets in PRESETS.items()
    }


def described(name: str) -> list[Description]:
    """Descriptions of everything with this name, or of a TOML file. Raises InputError for an unknown name."""
    if name.endswith(".toml"):
        family = _family_of(name)
        return [_entry(family, LOADERS[family](name))]
    found = [_entry(family, load(name)) for family, load in LOADERS.items() if name in available(family)]
    found += [_policy(name)] if name in policy_names() else []
    found += [_preset(family, name) for family, presets in PRESETS.items() if name in presets]
    if not found:
        known = [*(each for family in LOADERS for each in available(family)), *policy_names()]
        known += [each for presets in PRESETS.values() for each in presets]
        raise InputError(
            f"Unknown name '{name}': {suggest(name, list(dict.fromkeys(known)))}; or a TOML file."
        )
    return found


def _family_of(path: str) -> str:
    """Family of a TOML file, by its kind; that of lines where the kind is missing or unknown."""
    kind = read_toml(path).get("kind")
    return next((family for family, schemas in SCHEMAS.items() if kind in schemas), next(iter(LOADERS)))


def _entry(family: str, entry: Entry) -> Description:
    rows = [(each.key, str(each.value), each.meaning, each.source) for each in values_of(entry)]
    headings = ("key", "value", "meaning", "source")
    droppers = droppers_at_rest(entry)
    data = by_value(entry) | ({"droppers_at_rest": as_rows(droppers)} if droppers else {})
    return Description(family, entry.name, entry.description, headings, rows, data, droppers)


def _policy_or_why_not(name: str) -> Description:
    """Description of a policy; for a plug-in that can't be loaded the reason."""
    try:
        return _policy(name)
    except InputError as error:
        data = {"name": name, "description": str(error), "parameters": {}}
        return Description(POLICY, name, str(error), (), (), data)


def _policy(name: str) -> Description:
    maker = maker_of(name)
    own = inspect.isclass(maker) and maker.__init__ is not object.__init__
    text = "\n\n".join(filter(None, map(inspect.getdoc, [maker, *([maker.__init__] if own else [])])))
    known = parameters_of(maker).items()
    defaults = {key: None if each.default is each.empty else each.default for key, each in known}
    rows = [(key, repr(value)) for key, value in defaults.items()]
    plain = {key: value if _fit_for_json(value) else repr(value) for key, value in defaults.items()}
    data = {"name": name, "description": text, "parameters": plain}
    return Description(POLICY, name, text, ("parameter", "default"), rows, data)


def _fit_for_json(value: Any) -> bool:
    try:
        return bool(json.dumps(finite(value)))
    except (TypeError, ValueError, RecursionError):
        return False


def _preset(family: str, name: str) -> Description:
    preset = PRESETS[family][name]
    usual = type(preset)()
    rows = [
        (key, str(getattr(preset, key)), str(getattr(usual, key)), field.description or "")
        for key, field in type(preset).model_fields.items()
    ]
    others = ", ".join(PRESETS[family])
    option = f"--{family.replace('_', '-')}"
    first = next(key for key, value in usual if isinstance(value, float))
    text = f"A preset of {option}; presets are {others}. With your own values: {option} {name}:{first}=..."
    text += f"\n\n{inspect.getdoc(type(preset))}"
    return Description(
        family, name, text, ("key", "value", "usually", "meaning"), rows, preset.model_dump(mode="json")
    )


def list_entries(
    name: Annotated[
        str | None,
        Argument(
            help="Show all values of this line, pantograph, policy, line condition, preset of actuator or "
            "sensors, or TOML file."
        ),
    ] = None,
    toml: Annotated[
        bool, Option("--toml", help="Print the TOML file of a line or pantograph, to start yours from.")
    ] = False,
    droppers: Annotated[
        str | None,
        into_file(
            "Write the droppers of the line at rest, with force, length and stretch, to this file", TABLES
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List lines, pantographs, policies and presets, or all values of one with their source or default.

    Of a line with droppers, also their force, length and stretch at rest.
    """
    if toml:
        if name is None:
            raise InputError("Give the name of a line or a pantograph: panto list en50318-2002 --toml.")
        sys.stdout.write(text_of(name))
        return
    if name is not None:
        found = described(name)
        if droppers is not None:
            _write_droppers(found, name, droppers)
        if json:
            print_json({each.family: each.data for each in found})
        else:
            for each in found:
                _print(each)
        return
    if droppers is not None:
        raise InputError("Give the name of a line: panto list en50318-2002 --droppers droppers.csv.")
    families = everything()
    if json:
        print_json(
            {family: [each.data for each in families[family]] for family in LOADERS}
            | {family: {each.name: each.data for each in families[family]} for family in (POLICY, *PRESETS)}
        )
        return
    for family in LOADERS:
        table = _table(family, "name", "kind", "description")
        for each in families[family]:
            table.add_row(each.name, each.data["kind"], each.text)
        console.print(table)
    table = _table(POLICY, "name", "parameters", "description")
    for each in families[POLICY]:
        given = "\n".join(f"{parameter}={default}" for parameter, default in each.rows)
        table.add_row(each.name, given, each.text.partition("\n\n")[0].replace("\n", " "))
    console.print(table)
    for family in PRESETS:
        table = _table(family, "name", "values")
        for each in families[family]:
            changed = [f"{key}={value}" for key, value, usual, _ in each.rows if value != usual]
            kind = each.data.get("kind")
            if kind != families[family][0].data.get("kind"):
                changed.insert(0, f"kind={kind}")
            table.add_row(each.name, ", ".join(changed) or "none")
        console.print(table)
    console.print("All values of one: panto list NAME. With your own values: NAME:key=value,...")


def _print(each: Description) -> None:
    console.print(f"{each.family} {each.name}", style="bold")
    console.print(each.text)
    if each.rows:
        table = Table(*each.headings)
        for row in each.rows:
            table.add_row(*row)
        console.print(table)
    if each.droppers:
        print_table(dropper_table(each.droppers))


def _write_droppers(found: list[Description], name: str, path: str) -> None:
    rows = [row for each in found for row in as_rows(each.droppers)]
    if not rows:
        raise InputError(f"'{name}' is not a line with droppers, so there is no table of them.")
    write_rows(rows, path, HEADINGS)


def _table(family: str, *headings: str) -> Table:
    return Table(*headings, title=family, title_justify="left", show_lines=True)
