"""``panto diagnose``: an overhead line's defects from the contact force."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from ..analysis.plots import save
from ..base.errors import InputError
from ..diagnosis import diagnose as judge
from ..diagnosis import diagnose_records
from ..diagnosis.diagnosis import findings_table, plot_diagnosis, verdict
from ..diagnosis.features import FALSE_ALARMS
from ..fitting.stored import stored
from ..metrics.trajectory import Trajectory
from ..records.record_file import read_record
from ..terminal import Json, Plot, alert, console, print_json, print_table, progress_console, written_last
from .records import Filtered, Heading, Mass, Unit, reading

LEAST_FALSE_ALARMS, MOST_FALSE_ALARMS = 1e-6, 20.0
"""False alarms per km: healthy passes say nothing of rarer ones, and with more, about one per span, a
threshold has no meaning."""


def diagnose(
    run: Annotated[
        Path,
        Argument(
            help="Run to be diagnosed, from `panto simulate --output`; with --fit, a record of a train."
        ),
    ],
    more: Annotated[list[Path] | None, Argument(metavar="", hidden=True)] = None,
    healthy: Annotated[
        list[Path] | None,
        Option(
            metavar="RUN...",
            help="Healthy runs over the same line at the same speed, three or more; better ten or more.",
        ),
    ] = None,
    fit: Annotated[
        Path | None,
        Option(
            help="Instead of healthy runs: what a fit to earlier records knows of the healthy line, from "
            "`panto fit --keep`."
        ),
    ] = None,
    again: Annotated[
        list[Path] | None, Option(help="A further run over the diagnosed line, for a mean; may be repeated.")
    ] = None,
    false_alarms: Annotated[
        float | None, Option(help="False alarms per km that set the threshold. Default: 0.1.")
    ] = None,
    pantograph: Annotated[
        str | None,
        Option(
            help="Pantograph that the estimator assumes: a name of the catalogue or a TOML file. Default: "
            "the run's, as designed."
        ),
    ] = None,
    mass: Mass = None,
    filtered: Filtered = None,
    unit: Unit = None,
    column: Heading = None,
    seed: Annotated[int, Option(help="Seed of the sensors' noise.")] = 0,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Find out whether a line is healthy, and if not, the places and kinds of its defects.

    The force is compared with that of healthy runs, place by place, from the tenth span on. It is not the
    simulated force, but the one that an estimator on the train finds, up to 20 Hz, from noisy displacements
    of collector head and frame, and from the pantograph as designed.

    With --fit, the force of a record is compared with that of runs simulated on the fitted line.
    """
    if (healthy is None) == (fit is None):
        raise InputError(
            "Give either the healthy runs, panto diagnose RUN --healthy RUN RUN RUN, or a fit, "
            "panto diagnose RECORD --fit FIT."
        )
    if fit is not None and (pantograph or more):
        raise InputError(
            "With --fit, the pantograph is the fit's and further records are given with --again; leave out "
            "--pantograph and further arguments."
        )
    if fit is None and (mass is not None or filtered is not None or unit or column):
        raise InputError(
            "--mass, --filtered, --unit and --column are of records, which are diagnosed with --fit; leave "
            "them out."
        )
    rate = FALSE_ALARMS if false_alarms is None else false_alarms
    if not LEAST_FALSE_ALARMS <= rate <= MOST_FALSE_ALARMS:
        raise InputError(
            f"--false-alarms must lie between {LEAST_FALSE_ALARMS:g} and {MOST_FALSE_ALARMS:g} per km, not "
            f"{rate:g}."
        )
    if seed < 0:
        raise InputError(f"--seed must be a whole number from 0 up, not {seed}.")
    with progress_console.status("reading and diagnosing"):
        files = (run, *(again or []))
        if fit is not None:
            given = reading(unit, column, mass, filtered)
            records = [read_record(file, **given) for file in files]
            found = diagnose_records(records, stored(fit), false_alarms=rate, seed=seed)
            title = f"{run.name}, held against the line fitted in {fit.name}"
        else:
            whole = (*(healthy or ()), *(more or ()))
            runs, reference = ([Trajectory.load(path) for path in paths] for paths in (files, whole))
            found = judge(runs, reference, false_alarms=rate, seed=seed, pantograph=pantograph)
            place = f"{runs[0].catenary} at {runs[0].speed_kmh:.4g} km/h"
            title = f"{run.name}: {place}, {len(reference)} healthy runs"
    with written_last() as later:
        if plot is not None:
            later(save, plot_diagnosis(found, title), plot)
        if json:
            findings: list[dict[str, Any]] = [vars(finding) for finding in found.findings]
            facts = {name: getattr(found, name) for name in ("healthy", "changed", "level", "begin", "end")}
            facts |= {"threshold": found.evidence.threshold, "false_alarms": found.false_alarms}
            print_json(facts | {"notes": found.notes, "findings": findings})
            return
        for sentence in verdict(found):
            console.print(sentence, soft_wrap=True)
        if found.findings:
            print_table(findings_table(found))
        for note in found.notes:
            alert("Degraded:", note)
