"""The command `panto replay`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from panto_env.base.table import Table
from panto_env.terminal import Json, alert, counting, print_json, print_table

if TYPE_CHECKING:
    from .replay import Replayed


def replay(
    result: Annotated[
        Path,
        typer.Argument(help="JSON of `panto benchmark --output`, with its actions beside it."),
    ],
    policy: Annotated[list[str] | None, typer.Option(help="Policy of the result; repeatable.")] = None,
    tolerance: Annotated[
        float, typer.Option(min=0, help="Relative difference that is allowed; 0 means bit for bit.")
    ] = 0.0,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.", min=1)] = None,
    json: Json = False,
) -> None:
    """Play a result's passes again from the actions that it keeps, and compare all figures.

    No policy runs. Ends with status 1 where a figure differs by more than the tolerance. On another kind of
    processor figures differ in their last digits: give a tolerance there.
    """
    from .replay import replay as play

    with counting("passes") as progress:
        played = play(result, policy or (), workers, progress)
    if json:
        rows = [{**each.row, "difference": each.difference} for each in played.rows]
        print_json({"follows": played.follows, "rows": rows})
    else:
        print_table(_table(result, list(played.rows)))
    apart = [each for each in played.rows if each.difference > tolerance]
    if apart or played.follows is False:
        what = f"{len(apart)} of {len(played.rows)} rows do" if apart else "its cells or standings do"
        alert("No:", f"{what} not follow from the actions.")
        raise typer.Exit(1)


def _table(result: Path, rows: list[Replayed]) -> Table:
    """One line per policy."""
    groups: dict[str, list[float]] = {}
    for each in rows:
        groups.setdefault(each.row["policy"], []).append(each.difference)
    lines = tuple(
        (policy, str(len(found)), str(found.count(0.0)), f"{max(found):.2g}")
        for policy, found in groups.items()
    )
    headings = ("policy", "passes", "bit for bit", "maximum relative difference")
    return Table(f"{result.name}, played again", headings, lines)
