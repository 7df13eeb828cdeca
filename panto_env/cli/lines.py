"""``panto line``: a line at rest, from the catalogue, a TOML file, or a table of its masts."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from ..analysis.line_check import (
    check,
    drawn_lines,
    elasticity_table,
    facts,
    span_tables,
    spans_at_rest,
    table,
    table_at_rest,
)
from ..analysis.line_plan import line_plan
from ..analysis.options import print_criteria
from ..analysis.plots import plot_line, save
from ..base.errors import InputError
from ..base.files import write_text
from ..base.settings import parse
from ..catalog import load_catenary, load_drawn
from ..catalog.loader import drawn_kind, parse_catenary
from ..catalog.masts import line_from_masts
from ..control.lines import line_of_seed
from ..plant.catenary.flexible.as_run import as_run, as_run_tables
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.static import dropper_table
from ..plant.catenary.single import SingleData
from ..plant.line_condition import LINE_CONDITIONS, NEW, LineCondition, together
from ..terminal import Json, Plot, alert, console, counting, into_file, print_json, print_table, written_last
from .identify import given
from .records import Heading, Unit


def show_single(chosen: SingleData, line_condition: str, plot: str | None, json: bool) -> None:
    """Print a single wire or a rail at rest. Raises InputError for what only other lines have at rest."""
    if plot is not None or line_condition != "new":
        option = "--plot" if plot is not None else "--line-condition"
        raise InputError(
            f"Line '{chosen.name}' is a single wire or rail, of which only a table at rest is shown; leave "
            f"out {option}."
        )
    found = spans_at_rest(chosen)
    if json:
        spans = [each._asdict() for each in found]
        print_json({"line": chosen.model_dump(mode="json"), "spans": spans})
    else:
        print_table(table_at_rest(chosen, found))


def line(
    name: Annotated[
        str,
        Argument(
            help="Line: a name of the catalogue, a TOML file, or what to draw one from, such as "
            "section:main-line."
        ),
    ],
    masts: Annotated[
        str | None,
        Option(
            help="CSV file with a row per mast: position or span (m); mast, a name; contact_height, "
            "messenger_height or encumbrance (m); type, a name in span_types; stagger, radius, cant. All "
            "else is the line's."
        ),
    ] = None,
    unit: Unit = None,
    column: Heading = None,
    seed: Annotated[int, Option(min=0, help="Seed with which a line is drawn.")] = 0,
    speed: Annotated[
        float | None, Option(min=1, max=1000, help="Speed for the limits of gradients (km/h).")
    ] = None,
    force: Annotated[float, Option(min=1, max=1000, help="Force for the elasticity (N).")] = 100.0,
    line_condition: Annotated[
        str, Option(help="Condition, e.g. new:temperature=20, to show tensions, sag and droppers as run.")
    ] = "new",
    output: Annotated[
        str | None, into_file("Write the line between the masts to this TOML file", (".toml",))
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Show a line at rest: spans, droppers, gradients, elasticity and plan; make one from a table of masts.

    A line with stagger is seen from above too: radial forces, and where a wind (--line-condition
    new:side_wind=25) blows the contact wire. Exits with 1 if a limit is broken.
    """
    if output is not None and masts is None:
        raise InputError("Give --masts with --output: a line without them is in its TOML file already.")
    text = None if masts is None else line_from_masts(name, masts, *given(unit, column))
    chosen: Any
    if masts is not None and text is not None:
        table = {"name": Path(output or masts).stem} | tomllib.loads(text)
        chosen = parse_catenary(table, Path(masts))
    elif drawn_kind(name):
        chosen, *_ = line_of_seed(load_drawn(name), seed)
    else:
        chosen = load_catenary(name)
    if isinstance(chosen, SingleData):
        show_single(chosen, line_condition, plot, json)
        return
    if not isinstance(chosen, FlexibleCatenaryData):
        raise InputError(f"Line '{chosen.name}' has no spans with droppers to show; name a flexible line.")
    found = check(chosen, force)
    own = parse(LineCondition, line_condition, "line_condition", LINE_CONDITIONS)
    condition = together(chosen.as_found or NEW, own)
    above = line_plan(chosen, condition)
    run = None if condition == NEW else as_run(chosen, condition, force)
    criteria = found.criteria(speed) + (above.criteria() if above else [])
    broken = [each for each in criteria if each.kept is False]
    with written_last() as later:
        if output is not None and text is not None:
            later(write_text, output, text)
        if plot is not None:
            later(save, plot_line(found, above), plot)
        if json:
            print_json(
                {
                    "line": chosen.model_dump(mode="json"),
                    "spans": [each._asdict() for each in found.spans],
                    "droppers": [each._asdict() for each in found.droppers],
                    "criteria": [each.as_dict() for each in criteria],
                    "plan": above and above.as_dict(),
                    "as_run": run and run.rows | {"droppers": [each._asdict() for each in run.droppers]},
                }
            )
        else:
            other, alignment = as_run_tables(chosen, run) if run else [], chosen.alignment()
            named = alignment.span_name
            seen = above.tables(lambda number: alignment.support_name(number, number + 1)) if above else []
            for each in (
                *span_tables(found.spans, named),
                dropper_table(found.droppers, named),
                *seen,
                *other,
            ):
                print_table(each)
            print_criteria(criteria, f"Line {chosen.name} at rest")
            if chosen.sequence:
                console.print(
                    "Elasticity is left out in the first and the last span, where anchors hold the wires."
                )
            else:
                print_table(elasticity_table([found]))
            if run and not other and not (above and any(above.loads)):
                console.print("This condition changes no tension along the line: it is run as designed.")
            supports, given_at = len(alignment.supports), sum(m.stagger is not None for m in chosen.masts)
            if above is None and given_at:
                console.print("The line is not seen from above: not every mast has a stagger.")
            elif above and (masts is not None or chosen.masts) and given_at < supports:
                console.print(
                    f"{supports - given_at} of {supports} masts have no stagger, and theirs is assumed: "
                    "that of the line's plan, in turn."
                )
            for limit in broken:
                alert(f"{limit.name} is not kept.")
    if broken:
        raise typer.Exit(1)


def family(
    name: Annotated[str, Argument(help="Family or section, of the catalogue or a TOML file.")] = "high-speed",
    seeds: Annotated[int, Option(min=1, max=100_000, help="Number of lines.")] = 100,
    first: Annotated[int, Option(min=0, help="First seed.")] = 0,
    json: Json = False,
    markdown: Annotated[bool, Option("--markdown", help="Print the table for a document.")] = False,
) -> None:
    """Draw lines from a family or a section, run a passive pantograph on each, and print the ranges.

    Each runs at the highest speed of its trains. Exits with 1 if a line is outside the family's or the
    section's own bands of what is plausible.
    """
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
