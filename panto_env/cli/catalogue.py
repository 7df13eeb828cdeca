"""``panto list``: lines, pantographs, policies and presets by name."""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from rich.table import Table

from ..base.errors import InputError
from ..base.table import TABLES, write_rows
from ..catalog.loader import text_of
from ..plant.catenary.flexible.dropper_table import HEADINGS, as_rows, dropper_table
from ..terminal import Json, console, print_json, print_table, writable
from .descriptions import LOADERS, POLICY, PRESETS, Description, described, everything


def list_entries(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Show all values of this line, pantograph, policy, line condition, preset of actuator or "
            "sensors, or TOML file."
        ),
    ] = None,
    toml: Annotated[
        bool,
        typer.Option("--toml", help="Print the TOML file of a line or pantograph, to start yours from."),
    ] = False,
    droppers: Annotated[
        str | None,
        typer.Option(
            help="Write the droppers of the line at rest, with force, length and stretch, to this file "
            f"({', '.join(TABLES)}).",
            callback=writable(TABLES),
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
