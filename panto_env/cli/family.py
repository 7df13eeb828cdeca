"""``panto family``: lines drawn from a family or a section under many seeds; whether each is plausible."""

from __future__ import annotations

from typing import Annotated

import typer

from ..catalog import load_drawn
from ..terminal import Json, alert, console, counting, print_json, print_table

MOST_SEEDS = 100_000


def family(
    name: Annotated[
        str, typer.Argument(help="Family or section, of the catalogue or a TOML file.")
    ] = "high-speed",
    seeds: Annotated[int, typer.Option(min=1, max=MOST_SEEDS, help="Number of lines.")] = 100,
    first: Annotated[int, typer.Option(min=0, help="First seed.")] = 0,
    json: Json = False,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the table for a document.")] = False,
) -> None:
    """Draw lines from a family or a section, run a passive pantograph on each, and print the ranges.

    Each runs at the highest speed of its trains. Exits with 1 if a line is outside the family's or the
    section's own bands of what is plausible.
    """
    from ..analysis.family import drawn_lines, facts, table

    chosen = load_drawn(name)
    with counting("running") as progress:
        lines = drawn_lines(chosen, range(first, first + seeds), progress)
    outside = [one for one in lines if one.outside(chosen)]
    if json:
        print_json(facts(chosen, lines))
    elif markdown:
        print(table(chosen, lines).markdown)
    else:
        print_table(table(chosen, lines))
        if outside:
            seeds_of = ", ".join(str(one.seed) for one in outside[:10])
            alert(f"{len(outside)} of {len(lines)} lines are not plausible.", f"First seeds: {seeds_of}.")
        else:
            console.print(f"All {len(lines)} lines hang, run and are plausible.")
    if outside:
        raise typer.Exit(1)
