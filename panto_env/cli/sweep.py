"""``panto sweep``, ``permissible-speed`` and ``design``: many passes, over parameters, speeds and designs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from typer import Argument, Option

from ..analysis.options import Seed, Spans, parse_spans, with_settings
from ..analysis.parameters import with_distances
from ..analysis.plots import save
from ..analysis.pool import MOST_PASSES
from ..analysis.sweep import SPEED, labels
from ..analysis.sweep import save as save_rows
from ..analysis.sweep import sweep as run
from ..analysis.sweep_plots import pantographs_of, plot_sweep
from ..base.checksums import __version__
from ..base.errors import InputError
from ..base.files import PAGES, make_folder
from ..base.table import TABLES, number
from ..catalog import load_catenary
from ..cluster import RayAddress
from ..control.record import plain
from ..control.settings import run_settings
from ..metrics.figures import LABELS, NUMBER
from ..studies.design import check as designs_of
from ..studies.design.search import best_of, read_design, search
from ..studies.permissible import USUAL, Scan, scan
from ..studies.permissible.scan import VERIFIED_FROM
from ..studies.permissible.study import NOTES, answers_table, plot_scan, reasons, write_page
from ..terminal import Json, Plot, bars, console, counting, into_file, print_json, print_table, written_last

COLUMNS = ("mean", "std", "max", "min", "contact_loss", "max_uplift")
"""Figures that the table shows."""


@with_settings(left_out=("observation",))
def sweep(
    settings: dict[str, Any],
    parameters: Annotated[
        list[str],
        Argument(
            metavar="NAME=VALUES...",
            help="One to three parameters by dotted name, e.g. pantograph.masses.1, "
            "catenary.contact_wire.tension, catenary.droppers.spacing, actuator.lag, policy.gain, speed_kmh "
            "or distances (of a train's second pantograph; distances.1, ... of several behind the first); "
            "values as start:stop:count or 1,2,3. `panto list NAME` shows the names of an entry.",
        ),
    ],
    policy: Annotated[
        list[str] | None, Option(help="Policy: a name, name:key=value,... or a model file; may be repeated.")
    ] = None,
    spans: Spans = None,
    seed: Seed = 0,
    workers: Annotated[int | None, Option(help="Number of threads; by default one per core.")] = None,
    output: Annotated[str | None, into_file("Save the table to this file", TABLES)] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Run all combinations of values of one to three parameters, and print figures and verdicts."""
    values = _parse(parameters)
    several = sum(len({*each}) > 1 for each in values.values())
    if plot is not None and several > 2:  # before hours of passes
        raise InputError("A plot shows one or two parameters with several values; leave out --plot.")
    if SPEED in settings and SPEED in values:
        raise InputError("The speed is swept already; leave out --speed.")
    line_spans = settings.pop("spans", None)
    with counting("passes") as progress:
        rows = run(
            values,
            policies=policy or (None,),
            spans=parse_spans(spans),
            line_spans=line_spans,
            seed=seed,
            workers=workers,
            progress=progress,
            **settings,
        )
    with written_last() as later:
        if output is not None:
            later(partial(save_rows, **settings), rows, output)
        if plot is not None:
            later(save, plot_sweep(rows, list(values), labels(list(values), **settings)), plot)
        if json:
            used = plain(run_settings(with_distances(settings | {"spans": line_spans}, values)))
            facts = {"version": __version__, "seed": seed, "settings": used, "spans": parse_spans(spans)}
            print_json(facts | {"rows": rows})
            return
        _print(rows, list(values))


def _parse(parameters: Sequence[str]) -> dict[str, list[float]]:
    """Values by name from NAME=VALUES. Raises InputError where they cannot be read."""
    found: dict[str, list[float]] = {}
    for text in parameters:
        name, equals, values = text.partition("=")
        if not (equals and name and values):
            raise InputError(f"'{text}' must read NAME=VALUES, such as catenary.mean_stiffness=3000:5000:5.")
        if name in found:
            raise InputError(f"{name} is given twice; put all of its values in one list.")
        found[name] = parse_values(name, values)
    return found


def parse_values(name: str, text: str) -> list[float]:
    """Values from "start:stop:count", both ends included, or from "1,2,3". InputError for anything else."""
    try:
        if ":" not in text:
            return [float(value) for value in text.split(",")]
        start, stop, count = text.split(":")
        first, last, steps = float(start), float(stop), int(count) - 1
        if steps < 1:
            raise ValueError
    except ValueError as error:
        raise InputError(
            f"The values of {name} must be start:stop:count with a count from 2 up, or numbers with "
            f"commas between, not '{text}'."
        ) from error
    if steps >= MOST_PASSES:  # before they are created
        raise InputError(f"{name} has {steps + 1:,} values; the maximum is {MOST_PASSES:,} passes.")
    return [first + (last - first) * k / steps for k in range(steps + 1)]


def _print(rows: list[dict[str, Any]], parameters: list[str]) -> None:
    first = rows[0]
    at = "" if "speed_kmh" in parameters else f" at {first['speed_kmh']:g} km/h"
    spans = " or ".join(sorted({row["spans"] for row in rows} - {""})) or "none"
    table = Table(title=f"{pantographs_of(rows)} on {first['catenary']}{at}, spans {spans}")
    for name in (*parameters, "policy"):
        heading = re.sub("[._]", "\\g<0>\n", name) if len(name) > 12 else name  # dotted names are long
        table.add_column(heading, overflow="fold", justify="left" if name == "policy" else "right")
    if NUMBER in first:
        table.add_column("pantograph", justify="right")
    shown = [key for key in COLUMNS if any(isfinite(row[key]) for row in rows)]
    for key in shown:
        table.add_column(LABELS[key].column, justify="right")
    droppers = any(isfinite(row["dropper_force"]) for row in rows)
    for heading in ("dropper\nmax (N)", "slack\n(of time)") if droppers else ():
        table.add_column(heading, justify="right")
    table.add_column("requirements")
    for row in rows:
        cells = [number(LABELS[key].scale * row[key], 2) for key in shown]
        if droppers:
            share = "–" if row["terminated"] else f"{row['slack_droppers']} ({number(row['slack'], 1)} %)"
            cells += [number(row["dropper_force"], 0), share]
        policy = f"{row['policy']}, ended early" if row["terminated"] else row["policy"]
        whose = [f"{row[NUMBER]}"] if NUMBER in row else []
        table.add_row(*(f"{row[name]:g}" for name in parameters), policy, *whose, *cells, row["requirements"])
    console.print(table)


MOST_SPEEDS = 1000
"""Maximum number of speeds of a scan."""


@with_settings(left_out=("observation", "catenary", "speed_kmh", "speed_profile"), defaults=False)
def permissible_speed(
    settings: dict[str, Any],
    line: Annotated[str, Argument(help="Line: a name of the catalogue or a TOML file.")],
    policy: Annotated[
        list[str] | None,
        Option(
            help="Policy: a name, name:key=value,... or a model file; may be repeated. passive always runs."
        ),
    ] = None,
    speeds: Annotated[
        str,
        Option(help="Speeds as first:last:step (km/h), all of which are run: forbidden ones come in bands."),
    ] = "200:350:10",
    seeds: Annotated[int, Option(min=1, help="Number of lines as built, with a drifting speed each.")] = 8,
    verify: Annotated[
        bool, Option("--verify", help="Scan again with other seeds at half the step; the lower limit counts.")
    ] = False,
    workers: Annotated[int | None, Option(help="Processes; one per core by default.", min=1)] = None,
    ray: RayAddress = None,
    plot: Plot = None,
    html: Annotated[str | None, into_file("Write a page of it to this file", PAGES)] = None,
    json: Json = False,
) -> None:
    """Scan speeds for those at which a train keeps all requirements, without control and with.

    Lines are as built, actuator and sensors realistic, and the mean force is the standard's, unless the
    options say otherwise. Each pass is run once more with an actuator that fails half-way.
    """
    values = parse_speeds(speeds)
    data = load_catenary(line)
    given: dict[str, Any] = {"catenary": line, "workers": workers, "ray": ray} | settings
    with counting("lines and speeds") as progress:
        found = scan(values, policy or (), seeds=range(seeds), progress=progress, **given)
    again: Scan | None = None
    if verify:
        half = sorted({*values, *((a + b) / 2 for a, b in pairwise(values))})
        others = range(VERIFIED_FROM, VERIFIED_FROM + seeds)
        with counting("lines and speeds, other seeds") as progress:
            again = scan(half, policy or (), seeds=others, progress=progress, **given)
    used = USUAL | settings | {"seeds": seeds}
    with written_last() as later:
        if plot is not None:
            later(save, plot_scan(found, data), plot)
        if html is not None:
            later(write_page, found, again, data, used, html)
        if json:
            facts = plain(run_settings(USUAL | settings | {"catenary": line, "speed_kmh": values[0]}))
            verification = {} if again is None else {"verification": again.as_dict()}
            print_json({"version": __version__, "settings": facts} | found.as_dict() | verification)
            return
        print_table(answers_table(found, again))
        for sentence in reasons(found):
            console.print(sentence)
        for note in NOTES:
            console.print(note, style="dim")


def parse_speeds(text: str) -> list[float]:
    """Speeds (km/h) from first:last:step. Raises InputError for anything else."""
    try:
        first, last, step = (float(each) for each in text.split(":"))
        if not (0 < first <= last and step > 0):
            raise ValueError
    except ValueError as error:
        raise InputError(f"--speeds must read first:last:step, such as 200:400:5, not '{text}'.") from error
    count = int((last - first) / step + 1e-9) + 1
    if count > MOST_SPEEDS:
        raise InputError(f"--speeds has {count:,} speeds; the maximum is {MOST_SPEEDS}, take a larger step.")
    return [first + k * step for k in range(count)]


def design(
    study: Annotated[str, Argument(help="TOML file: what is searched, at which speeds; docs/design.md.")],
    output: Annotated[
        Path, Option(help="Folder of what was tried, which a search that was broken off goes on from.")
    ] = Path("runs/design"),
    designs: Annotated[
        int | None, Option(min=1, help="Number of designs, in the place of the file's.")
    ] = None,
    workers: Annotated[int | None, Option(min=1, help="Threads; one per core by default.")] = None,
    json: Json = False,
) -> None:
    """Search for values of a line or a pantograph that keep all requirements, and check what was found."""
    make_folder(output)  # before hours of work
    wanted = read_design(study)
    if designs is not None:
        wanted = wanted.model_copy(update={"designs": designs})
    columns = BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.fields[note]}")
    with bars("designs", *columns) as progress:
        bar = progress.add_task("designs", total=wanted.designs, note="")

        def told(done: int, total: int, note: str) -> None:
            progress.update(bar, completed=done, total=total, note=note)

        found = search(wanted, output, workers=workers, progress=told)
    candidates, best = designs_of.candidates_of(wanted, found), best_of(wanted, found)
    checked = designs_of.check(wanted, candidates)
    files = designs_of.write(wanted, found, checked, candidates, output)
    if json:
        trials = [{"values": trial.params, "objectives": trial.values} for trial in best]
        rows = [each._asdict() for each in checked]
        print_json({"designs": len(found.trials), "best": trials, "checked": rows})
        return
    print_table(designs_of.values_table(wanted, candidates))
    print_table(designs_of.checked_table(checked))
    print_table(designs_of.tornado_table(wanted, best[0].params))
    console.print(f"Written: {', '.join(map(str, files))}; `panto line` shows the line's droppers.")
