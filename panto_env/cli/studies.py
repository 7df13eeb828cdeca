"""``panto validate``: the table of EN 50318:2002, and the convergence of figures."""

from __future__ import annotations

import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich import table as rich_table
from rich.markup import escape
from rich.text import Text
from typer import Argument, Option

from .. import studies
from ..analysis.options import Seed, Spans, parse_spans, print_criteria, with_settings
from ..analysis.plots import save
from ..base.checksums import with_checksum
from ..base.errors import InputError
from ..base.files import finite, make_folder
from ..base.table import Table, number
from ..catalog import load_catenary, load_pantograph
from ..rig import report
from ..rig.computer import compare, load_rig
from ..rig.report import plot_pairs
from ..studies.en50318 import own_standard, study
from ..studies.en50318.reference import plot_reference
from ..studies.throughput import study as measured
from ..studies.throughput import tables as shown
from ..studies.throughput.tables import plot_speed
from ..terminal import (
    ALARM,
    Json,
    Plot,
    alert,
    announce_overwriting,
    bars,
    console,
    print_json,
    print_table,
    progress_console,
    written_last,
)


def validate(
    convergence: Annotated[
        bool, Option("--convergence", help="Print the convergence of figures with grid and step.")
    ] = False,
    window: Annotated[
        bool, Option("--window", help="Print how travelling windows compare with whole lines.")
    ] = False,
    wear: Annotated[
        bool, Option("--wear", help="Print the effect of the time step on figures of a worn line.")
    ] = False,
    conditions: Annotated[
        bool,
        Option("--conditions", help="Print figures in each named condition of a line, on several lines."),
    ] = False,
    lines: Annotated[
        bool,
        Option(
            "--lines",
            help="Print the errors of the default grid and step on every line of the catalogue and on twenty "
            "drawn ones, at all speeds (ten minutes).",
        ),
    ] = False,
    start: Annotated[
        bool, Option("--start", help="Print the effect of a run's start on σ, by evaluated spans.")
    ] = False,
    brief: Annotated[
        bool,
        Option("--brief", help="Print one line: whether all figures of the standard's table are inside."),
    ] = False,
    standard: Annotated[
        Path | None,
        Option(
            help="TOML file with lines, tests and accepted ranges of a standard that you own, to be compared "
            "instead; docs/own-standard.md."
        ),
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Check the flexible catenary against EN 50318:2002; exit with 1 if any figure lies outside."""
    if standard is not None:
        if brief or plot is not None or any((convergence, window, wear, conditions, lines, start)):
            raise InputError("--standard prints one table; of the other options it takes --json alone.")
        _compare(standard, json)
        return
    with progress_console.status("validating") as status:
        validation = study.run(
            status.update,
            with_convergence=convergence,
            with_windows=window,
            with_wear=wear,
            with_conditions=conditions,
            with_lines=lines,
            with_start=start,
            with_kinds=not brief,
        )
    with written_last() as later:
        if plot is not None:
            later(save, plot_reference(validation.runs), plot)
        if json:
            print_json(validation.as_dict())
        else:
            checks, *others = validation.tables
            if not brief:
                print_table(checks)
                console.print(
                    "The catalogue entry en50318-2002 explains the choice of open values: "
                    "`panto list en50318-2002`."
                )
                for run, criteria in zip(validation.runs, validation.compliance, strict=True):
                    print_criteria(criteria, f"Requirements at {run.speed_kmh:g} km/h, {run.line.system}")
            for table in others:
                print_table(table)
            inside = f"EN 50318:2002, {len(validation.checks)} figures at two speeds: all inside."
            _print_verdict(validation.passed, inside if brief else ALL_INSIDE)
    if not validation.passed:
        raise typer.Exit(1)


ALL_INSIDE = "All figures inside."


def _print_verdict(passed: bool, inside: str = ALL_INSIDE) -> None:
    if passed:
        console.print(inside)
    else:
        alert("Not all figures are inside.")


def _compare(path: Path, json: bool) -> None:
    form = own_standard.read_standard(path)
    with progress_console.status("comparing") as status:
        compared = own_standard.compare(form, lambda name: status.update(f"comparing {escape(name)}"))
    if json:
        print_json(compared.as_dict())
    else:
        print_table(compared.table)
        _print_verdict(compared.passed)
    if not compared.passed:
        raise typer.Exit(1)


def reproduce(
    name: Annotated[str, Argument(help="A study, or all.")] = "all",
    output: Annotated[Path, Option(help="Folder for figures (PNG) and numbers (JSON).")] = Path(
        "runs/reproduce"
    ),
    json: Json = False,
) -> None:
    """Reproduce results of papers and of others: print ours next to theirs, write figures and all numbers."""
    names = studies.STUDIES if name == "all" else (name,)
    chosen = {name: studies.find_study(name) for name in names}
    for name in chosen:  # now: a study takes minutes
        make_folder(output / name)
        studies.check_writable(output / name)
        announce_overwriting(output / name / studies.NUMBERS)
    found: dict[str, Any] = {}
    failed: list[InputError] = []
    with bars() as progress:
        for study, run in chosen.items():
            bar = progress.add_task(study, total=1.0)

            def report(what: str, share: float, bar: Any = bar, study: str = study) -> None:
                progress.update(bar, completed=share, description=f"{study}: {what}")

            outcome = run(report)
            progress.remove_task(bar)
            found[study] = outcome.as_dict()
            if not json:
                _print(outcome)
            try:
                files = studies.write(outcome, output / study)
            except InputError as error:  # results are printed nevertheless, and the other studies continue
                failed.append(error)
                continue
            if not json:
                written = [f"{len(files) - 1 - len(outcome.rows)} figures"]
                written += [f"{name}.csv" for name in outcome.rows]
                console.print(f"{', '.join(written)} and {studies.NUMBERS} are in {output / study}.\n")
    if json:
        print_json(found)
    if failed:
        raise failed[0]


def _print(outcome: studies.Outcome) -> None:
    for each in outcome.tables:
        print_table(each)
    table = rich_table.Table(title=outcome.title)
    for heading in ("quantity", "unit", "ours", "paper", "agrees within", "note"):
        table.add_column(heading, justify="right" if heading in ("ours", "agrees within") else "left")
    for comparison in outcome.comparisons:
        ours = f"{comparison.ours:.4g}"
        table.add_row(
            comparison.quantity,
            comparison.unit,
            ours if comparison.agrees else Text(f"{ours} differs", ALARM),
            comparison.paper if isinstance(comparison.paper, str) else f"{comparison.paper:.4g}",
            f"{number(comparison.low, 3)} to {number(comparison.high, 3)}",
            comparison.note,
        )
    console.print(table)
    if outcome.verdict:
        console.print(outcome.verdict)


def speed(
    results: Annotated[
        list[Path] | None,
        Argument(help="Results stored with --json, to print next to each other instead of measuring."),
    ] = None,
    repeats: Annotated[int, Option(min=1, max=1000, help="Repeats; their median counts.")] = 9,
    device: Annotated[
        str | None,
        Option(help='Measure the vector environments on this device instead: "cuda", or "cpu" to try it.'),
    ] = None,
    plot: Plot = None,
    json: Json = False,
    markdown: Annotated[
        bool, Option("--markdown", help="Print the tables for README.md, then those for docs/speed.md.")
    ] = False,
) -> None:
    """Measure the speed of each plant relative to real time on one core, and environment steps per second.

    They are compared with Gymnasium's own Pendulum and native CartPole, and with the limits of the machine;
    then follows the cost by spans, modes, grid, lanes and cores. With several stored results, details are
    those of the first one.
    """
    if json and markdown:
        raise InputError("Give one of --json and --markdown, not both.")
    if device is not None:
        if results or plot is not None or markdown:
            raise InputError(
                "--device measures anew and prints one table; leave out results, --plot and --markdown."
            )
        from ..studies.throughput import device as lanes  # needs PyTorch

        with progress_console.status("measuring") as status:
            of_lanes = lanes.run(device, repeats, report=lambda what: status.update(f"measuring {what}"))
        if json:
            print_json(of_lanes)
        else:
            print_table(_plain(lanes.table(of_lanes)))
        return

    if results:
        found = [measured.read(path) for path in results]
    else:
        with progress_console.status("measuring") as status:
            found = [measured.run(repeats, report=lambda what: status.update(f"measuring {what}"))]
    result = found[0]
    with written_last() as later:
        if plot is not None:
            later(save, plot_speed(result), plot)
        if json:
            print_json(with_checksum(finite(result)))
        elif markdown:
            sys.stdout.write("\n".join(shown.markdown(found)))
        else:
            console.print("\n".join(shown.machines(found)))
            for part in (shown.summary(found), *shown.details(result)):
                if isinstance(part, str):
                    console.print(part)
                else:
                    print_table(_plain(part))


def _plain(table: Table) -> Table:
    """The table without the backticks of Markdown."""
    rows = [tuple(cell.replace("`", "") for cell in row) for row in table.cells]
    return replace(table, rows=rows)


RIGS = ("rig", "rig-flexible")
PANTOGRAPH, SPEED_KMH = "own-two-mass", 250.0
REFERENCE = "en50318-2002"
"""Line with which a rig is compared if its own line has no droppers: paper 2's finite elements were of it."""


@with_settings(only=("pantograph", "speed_kmh", "actuator", "sensors"), defaults=False)
def rig(
    settings: dict[str, Any],
    rigs: Annotated[
        list[str] | None,
        Argument(help=f"Rigs, of the catalogue or as TOML files. [default: {' '.join(RIGS)}]"),
    ] = None,
    reference: Annotated[
        str | None,
        Option(
            help="Line with which the rig is compared; by default its computed line if that has droppers, "
            f"else {REFERENCE}."
        ),
    ] = None,
    policy: Annotated[str | None, Option(help="Policy, on the rig and on the line.")] = None,
    stability: Annotated[
        bool,
        Option(
            "--stability", help="Find the delay and lag at which each loop gets unstable; about 20 s per rig."
        ),
    ] = False,
    clock: Annotated[
        float, Option(min=0, max=3600, help="Run each rig's computer in real time for this time (s).")
    ] = 0.0,
    spans: Spans = None,
    seed: Seed = 0,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Run a pantograph on a rig and on the line itself, and print how well the rig follows the line.

    By default that is pantograph own-two-mass at 250 km/h, as in paper 2.
    """
    chosen, facts, tables, pairs = parse_spans(spans), [], [], []
    pantograph = load_pantograph(settings.pop("pantograph", PANTOGRAPH))
    speed_kmh = settings.pop("speed_kmh", SPEED_KMH)
    loaded = [load_rig(name) for name in rigs or RIGS]
    with progress_console.status("running") as status:
        for data in loaded:
            status.update(f"running {escape(data.name)}")
            own = data.line if data.line.kind == "flexible" else REFERENCE
            line = load_catenary(own if reference is None else reference)
            pair = compare(data, line, pantograph, speed_kmh, chosen, policy=policy, seed=seed, **settings)
            pairs.append(pair)
            facts.append(report.pair_facts(pair))
            tables.append(report.pair_table(pair))
            if stability:
                status.update(f"stability of {escape(data.name)}")
                found = report.stability(data, pantograph, speed_kmh)
                facts[-1]["stability"] = asdict(found)
                tables.append(report.stability_table(data, found))
            if clock:
                status.update(f"{escape(data.name)} against the clock")
                timing = report.clocked(data, pantograph, speed_kmh, clock)
                facts[-1]["clock"] = report.timing_facts(timing)
                tables.append(report.timing_table(data.name, timing))
    with written_last() as later:
        if plot is not None:
            later(save, plot_pairs(pairs), plot)
        if json:
            print_json(facts)
            return
        console.print(f"{pantograph.name} at {speed_kmh:g} km/h, policy {policy or 'passive'}")
        for table in tables:
            print_table(table)
        for pair in pairs:
            console.print(report.followed_sentence(pair), soft_wrap=True)
