"""``panto list``: the catalogue and the policies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer
from pydantic import BaseModel
from rich.table import Table

from ..base.errors import InputError
from ..catalog import available, load_catenary, load_pantograph
from ..plant.catenary.schema import CatenaryData
from ..plant.pantograph.schema import PantographData
from ..policies import policy_names
from ..terminal import Json, console, print_json

Entry = CatenaryData | PantographData
LOADERS: dict[str, Callable[[str], Entry]] = {"catenary": load_catenary, "pantograph": load_pantograph}


def list_entries(
    name: Annotated[
        str | None,
        typer.Argument(help="Show all values of this entry, or TOML file, with sources."),
    ] = None,
    json: Json = False,
) -> None:
    """List lines, pantographs and policies, or every value of one entry with its source."""
    if name is None:
        _overview(json)
    else:
        _entry(name, json)


def _overview(json: bool) -> None:
    entries = {family: [LOADERS[family](name) for name in available(family)] for family in LOADERS}
    if json:
        print_json(
            {family: [entry.model_dump() for entry in listed] for family, listed in entries.items()}
            | {"policy": policy_names()}
        )
        return
    for family, listed in entries.items():
        table = Table("name", "kind", "description", title=family, title_justify="left")
        for entry in listed:
            table.add_row(entry.name, entry.kind, entry.description.split(".")[0] + ".")
        console.print(table)
    console.print("policies:", ", ".join(policy_names()))


def _entry(name: str, json: bool) -> None:
    entries: dict[str, Entry] = {}
    failures = []
    for family, load in LOADERS.items():
        try:
            entries[family] = load(name)
        except InputError as error:
            failures.append(str(error))
    if not entries:
        raise InputError(failures[0] if name.endswith(".toml") else " ".join(failures))
    if json:
        print_json({family: entry.model_dump() for family, entry in entries.items()})
        return
    for family, entry in entries.items():
        table = Table("key", "value", "meaning", "source", title=f"{family} {entry.name}")
        for key, value, meaning in _leaves(entry, ""):
            table.add_row(key, str(value), meaning, entry.sources.get(key, ""))
        console.print(entry.description)
        console.print(table)


def _leaves(entry: BaseModel, prefix: str) -> list[tuple[str, Any, str]]:
    rows: list[tuple[str, Any, str]] = []
    for key, field in type(entry).model_fields.items():
        value = getattr(entry, key)
        if isinstance(value, BaseModel):
            rows += _leaves(value, f"{prefix}{key}.")
        elif value is not None and key not in ("sources", "name", "kind", "description"):
            rows.append((prefix + key, value, field.description or ""))
    return rows
