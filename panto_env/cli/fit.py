"""``panto fit``: what of a line explains measured forces."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from ..analysis.plots import save
from ..base.errors import InputError, suggest
from ..base.table import TABLES, write_rows
from ..catalog import load_catenary, load_pantograph
from ..fitting import fit as fits
from ..fitting.drift import FALSE
from ..fitting.drift import drift as between
from ..fitting.fitted_line import check_design, write_line, write_pantograph
from ..fitting.misfit import State
from ..fitting.stored import SUFFIX, identity_of, kept, knowledge, store, stored
from ..fitting.stored import keep as keep_state
from ..fitting.tables import (
    parts_table,
    plain,
    plot_drift,
    plot_fit,
    remarks,
    rows_of,
    summary_table,
    values_table,
)
from ..fitting.values import FREE, USUAL
from ..records.record_file import read_record
from ..terminal import (
    Json,
    Plot,
    alert,
    bars,
    console,
    into_file,
    print_json,
    print_table,
    progress_console,
    writable,
    written_last,
)
from .identify import pairs
from .records import Filtered, Heading, Mass, Unit, reading


def fit(
    files: Annotated[
        list[Path], Argument(metavar="RECORD...", help="Records, as `panto record` reads them.")
    ],
    line: Annotated[str, Option(help="Line as designed: a name in the catalogue or a TOML file.")],
    pantograph: Annotated[str, Option(help="Pantograph: a name in the catalogue or a TOML file.")],
    free: Annotated[
        str | None,
        Option(
            help="What may differ from the design, of tensions, droppers, supports, damping, pantograph and "
            "unevenness.",
            show_default="tensions,droppers,supports,damping,unevenness",
        ),
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        Option(
            help="Standard deviation of a kind of values before any record is seen, e.g. droppers=0.01 (m), "
            "tensions=0.03 (of the design's); may be repeated."
        ),
    ] = None,
    mass: Mass = None,
    filtered: Filtered = None,
    unit: Unit = None,
    column: Heading = None,
    output: Annotated[str | None, into_file("Write the fitted line to this file", (".toml",))] = None,
    pantograph_output: Annotated[
        str | None, into_file("Write the fitted pantograph to this file", (".toml",))
    ] = None,
    values: Annotated[
        str | None, into_file("Write all values with their intervals to this file", TABLES)
    ] = None,
    keep: Annotated[
        str | None,
        Option(
            help="Write the fit itself to this file (.safetensors), for `panto drift`.",
            callback=writable((".safetensors",)),
        ),
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Find what of a line explains records of the contact force: tensions, droppers, supports.

    Each value comes with its 95 % interval; what the records cannot tell is said.
    Records of several speeds tell more than as many of one. A fit that is broken off goes on where it was, if
    it is given an --output, --values or --keep.
    """
    names = USUAL if free is None else tuple(name.strip() for name in free.split(","))
    tolerances = by_kind(tolerance or [])
    given = reading(unit, column, mass, filtered)
    records = [read_record(file, **given) for file in files]
    design, riding = load_catenary(line), load_pantograph(pantograph)
    if output is not None:
        check_design(design, line, names)
    target = output or values or keep
    place = None if target is None else Path(f"{target}{SUFFIX}")
    settings: dict[str, Any] = {"free": list(names), "tolerances": tolerances, "filtered": filtered}
    settings |= {"line": design.model_dump_json(), "pantograph": riding.model_dump_json()}
    identity = identity_of(records, settings)
    begin = None if place is None else kept(place, identity)
    if begin is not None:
        progress_console.print(f"Going on from step {begin.steps} ({place}).")
    with bars("{task.description}") as progress:
        bar = progress.add_task("preparing")

        def report(state: State, gain: float) -> None:
            progress.update(bar, description=f"step {state.steps}, expected gain {gain:.3g}")
            if place is not None:
                keep_state(place, state, identity)

        def working(doing: str) -> None:
            progress.update(bar, description=doing)

        choices: dict[str, Any] = {"free": names, "tolerances": tolerances, "begin": begin}
        found = fits.fit(records, design, riding, **choices, report=report, working=working)
    every = ", ".join(file.name for file in files)
    with written_last() as later:
        if output is not None:
            later(lambda: write_line(found, line, output, every))
        if pantograph_output is not None:
            later(lambda: write_pantograph(found, pantograph, pantograph_output, every))
        if values is not None:
            later(write_rows, rows_of(found.found, found.problem.before), values)
        if keep is not None:
            later(lambda: store(knowledge(found, every), keep))
        if plot is not None:
            later(save, plot_fit(found, f"{every}: {riding.name} on {design.name}"), plot)
        if json:
            print_json(plain(found))
        else:
            summary = summary_table(found.found, found.differing, "the design")
            for table in (parts_table(found), summary, values_table(found.differing, "the design")):
                if table.rows:
                    print_table(table)
            for sentence in remarks(found):
                alert("Note:", sentence)
    if place is not None:  # only now: where a file could not be written, the steps are not lost
        place.unlink(missing_ok=True)


def by_kind(given: list[str]) -> dict[str, float]:
    """Tolerances by kind. Raises InputError for a kind that is unknown, or no positive number."""
    found = {}
    for name, text in pairs(given).items():
        if name not in FREE:
            raise InputError(f"--tolerance of unknown '{name}': {suggest(name, FREE)}.")
        try:
            value = float(text)
        except ValueError:
            value = 0.0
        if not 0 < value <= 1:
            raise InputError(f"--tolerance {name} must be a number above 0 and up to 1, not '{text}'.")
        found[name] = value
    return found


def drift(
    earlier: Annotated[Path, Argument(help="Earlier fit, from `panto fit --keep`.")],
    later: Annotated[Path, Argument(help="Later fit, of the same line as designed.")],
    tolerance: Annotated[
        list[str] | None,
        Option(
            help="Standard deviation of a kind of changes before any record is seen, e.g. droppers=0.002 "
            "(m); may be repeated. Default: half of the fits' tolerance of values."
        ),
    ] = None,
    values: Annotated[
        str | None, into_file("Write all changes with their intervals to this file", TABLES)
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Find what of a line has changed between records, from the fit to each.

    The 95 % intervals hold the uncertainty of both fits. Changes are named so that one in twenty of them is
    false.
    """
    found = between(stored(earlier), stored(later), by_kind(tolerance or []))
    named = {each.value.name for each in found.changed}
    rows = [row | {"changed": row["name"] in named} for row in rows_of(found.found)]
    with written_last() as afterwards:
        if values is not None:
            afterwards(write_rows, rows, values)
        if plot is not None:
            afterwards(save, plot_drift(found, f"Changes from {earlier.name} to {later.name}"), plot)
        if json:
            print_json({"values": rows, "notes": list(found.notes)})
            return
        print_table(summary_table(found.found, found.changed, "before"))
        if found.changed:
            print_table(values_table(found.changed, "before"))
            console.print(f"About {100 * FALSE:g} % of the changes that are named are none.")
        else:
            console.print("Nothing has changed that these records would tell.")
        for note in found.notes:
            alert("Degraded:", note)
