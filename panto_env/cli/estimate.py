"""``panto estimate``: the contact force from a record of a pantograph's motion."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from ..analysis.plots import save
from ..base.arrays import from_kmh
from ..base.errors import InputError
from ..base.settings import parse
from ..base.table import TABLES, Alarm, Sheet, Table, number, write_table
from ..catalog import load_pantograph
from ..estimation.estimate import BANDS, Estimate, Score, plot_estimate, score
from ..estimation.estimate import estimate as run
from ..estimation.estimate import tune as find
from ..estimation.innovations import nis
from ..estimation.model import EstimatorSettings
from ..estimation.motion import Motion, read_motion, rezeroed
from ..metrics.figures import LABELS, statistics
from ..metrics.low_pass import low_pass
from ..plant.pantograph.schema import PantographData
from ..terminal import Json, Plot, alert, into_file, print_json, print_table, progress_console, written_last
from .identify import pairs

TUNED = ("force_model.intensity", "frame_intensity", "displacement_noise")


def estimate(
    file: Annotated[
        Path,
        Argument(
            help="CSV: time, head, frame, and where measured head_velocity, frame_velocity, frame_force, "
            "head_force; a contact_force is compared with the estimate."
        ),
    ],
    pantograph: Annotated[
        str, Option(help="Name in the catalogue, or a TOML file, e.g. from `panto identify`.")
    ],
    speed: Annotated[
        float | None,
        Option(help="Speed of the train (km/h); required for aerodynamic uplift.", min=0, max=1000),
    ] = None,
    span: Annotated[float | None, Option(help="Length of a span (m).", min=1, max=1000)] = None,
    lift: Annotated[
        float | None,
        Option(help="Static force and aerodynamic uplift (N), if not the pantograph's.", min=0, max=100_000),
    ] = None,
    displacements: Annotated[
        bool, Option("--displacements", help="Do not use velocities, even if they were measured.")
    ] = False,
    force_model: Annotated[
        str, Option(help="random-walk, shaped or periodic, with values such as 'shaped:wavelength=5'.")
    ] = "random-walk",
    displacement_noise: Annotated[
        float | None, Option(help="White noise of a sample, rms (m).", show_default="2e-5")
    ] = None,
    velocity_noise: Annotated[
        float | None, Option(help="White noise of a sample, rms (m/s).", show_default="0.005")
    ] = None,
    lag: Annotated[
        float,
        Option(help="Time of later samples that count (s); 0 is what a train knows at once, and less exact."),
    ] = 0.05,
    free_zero: Annotated[
        bool, Option("--free-zero", help="The zero of heights is unknown: the mean force is the lift.")
    ] = False,
    tune: Annotated[
        bool, Option("--tune", help="First find noise intensities on this record by maximum likelihood.")
    ] = False,
    unit: Annotated[
        list[str] | None,
        Option(help="Unit of a column whose header has none, e.g. head=mm; may be repeated."),
    ] = None,
    output: Annotated[str | None, into_file("Write the estimate to this file", TABLES)] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Estimate the contact force from the motion of collector head and articulated frame (paper 2).

    Heights are positive upwards (m or mm, according to the header), from the position with unloaded springs.
    A record that cannot be a pantograph's is refused with the likely mistake. The mean force depends on the
    lift, and the inertia of the head on its mass: no test shows whether these are wrong.
    """
    known = load_pantograph(pantograph)
    metres = None if speed is None else from_kmh(speed)
    motion = read_motion(file, 0.0, speed=metres, span=span, units=pairs(unit or []))
    motion = dataclasses.replace(motion, lift=_lift(known, metres, lift, motion))
    if free_zero:
        motion = rezeroed(motion, known)
    only = displacements or motion.head_velocity is None or motion.frame_velocity is None
    given: dict[str, Any] = {
        "observation": "displacements" if only else "displacements and velocities",
        "force_model": force_model,
        "displacement_noise": displacement_noise,
        "velocity_noise": velocity_noise,
        "lag": lag,
    }
    given = {key: value for key, value in given.items() if value is not None}
    settings = parse(EstimatorSettings, given, "settings")
    if tune:
        names = TUNED if only else (*TUNED, "velocity_noise")
        with progress_console.status("tuning"):
            tuned = find([motion], known, settings, names)
        settings = tuned.settings
        values = ", ".join(f"{name} = {value:.4g}" for name, value in tuned.values.items())
        progress_console.print(
            f"Tuned on this record: {values}; so the size of its innovations is no test of this record, nor "
            "of another one with the same errors."
        )
        for name in tuned.at_bounds:
            alert("Warning:", f"the record does not determine {name}.", progress_console)
    found = run(motion, known, settings)
    scores = _scores(motion, found)
    with written_last() as later:
        if output is not None:
            normalised = nis(found.filtered) / found.filtered.innovations.shape[1]
            columns = {"time": found.time, "contact_force": found.force, "nis": normalised}
            units = {"time": "time (s)", "contact_force": "contact_force (N)", "nis": "nis (-)"}
            later(write_table, Sheet("estimate", columns, units), output)
        if plot is not None:
            title = f"{file.name}, {known.name}, {settings.observation}, {settings.force_model.kind}"
            later(save, plot_estimate(found, title, motion.contact_force), plot)
        if json:
            print_json(_plain(found, motion, settings, scores))
            return
        _print(found, motion, settings, scores, file.name)


def _lift(pantograph: PantographData, speed: float | None, lift: float | None, motion: Motion) -> float:
    """Lift of the pantograph (N): as given, or nominal."""
    if lift is not None:
        return lift
    if speed is None and pantograph.lifted_by_air:
        raise InputError(
            f"Pantograph '{pantograph.name}' has an aerodynamic uplift; give the speed of the train, "
            "--speed, or the whole lift, --lift."
        )
    nominal = float(pantograph.nominal_force(speed or 0.0))
    if pantograph.force == "mean":  # this is the contact force: the lowest spring needs a lift in addition
        nominal += pantograph.stiffnesses[-1] * float(motion.frame.mean())
    return nominal


def _figures(found: Estimate) -> dict[str, float]:
    """Statistics of the estimate behind EN 50317's low-pass (N), after the filter's start."""
    step = float(found.time[1] - found.time[0])
    return statistics(low_pass(found.force, step)[found.first :])


def _scores(motion: Motion, found: Estimate) -> list[Score]:
    """Comparison with the record's contact force, if any, in bands for which the record is long enough."""
    if motion.contact_force is None:
        return []
    kept, scores = slice(found.first, None), []
    for band in BANDS:
        try:
            scores.append(score(motion.contact_force[kept], found.force[kept], motion.time_step, band))
        except InputError as error:
            alert("Warning:", f"no comparison in 0 to {band:g} Hz: {error}", progress_console)
    return scores


def _plain(
    found: Estimate, motion: Motion, settings: EstimatorSettings, scores: list[Score]
) -> dict[str, Any]:
    tested = found.consistency
    return {
        **_figures(found),
        "deviation": found.deviation,
        "lift": motion.lift,
        "nis": tested.nis,
        "largest_autocorrelation": tested.whiteness.largest,
        "tests": [
            {key: getattr(test, key) for key in ("name", "value", "low", "high", "kept")}
            for test in found.verdict.tests
        ],
        "believe": found.verdict.believe,
        "reasons": found.verdict.reasons,
        "settings": settings.model_dump(),
        "scores": [vars(each) for each in scores],
    }


def _print(
    found: Estimate, motion: Motion, settings: EstimatorSettings, scores: list[Score], name: str
) -> None:
    rows = [(LABELS[key].heading, number(value), "") for key, value in _figures(found).items()]
    rows.append(("lift, which determines the mean (N)", number(motion.lift), ""))
    rows.append(("rms error by the model, all frequencies (N)", number(found.deviation), ""))
    for test in found.verdict.tests:
        rows.append((test.name, test.text if test.kept else Alarm(test.text), test.bounds))
    rows.append(("reliable", "yes" if found.verdict.believe else Alarm("no"), "all within these bounds"))
    model = f"{settings.observation}, {settings.force_model.kind}"
    print_table(Table(f"{name}: contact force, 0 to 20 Hz, from {model}", ("", "", "judged by"), rows))
    for reason in found.verdict.reasons:
        alert("Warning:", f"{reason}.")
    if scores:
        print_table(_scores_table(scores))


def _scores_table(scores: list[Score]) -> Table:
    rows = []
    for each in scores:
        forces = number(each.bias, 2), number(each.rms, 2)
        rows.append(
            (f"0 to {each.band:g} Hz", *forces, number(each.correlation, 4), number(1e3 * each.delay, 2))
        )
    headings = ("band", "bias (N)", "rms error (N)", "correlation", "delay (ms)")
    return Table("Compared with the recorded contact force", headings, rows)
