"""Tables of paper 1's identification, ours beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...base.table import Table
from ...identification import (
    EXPERIMENTS,
    FILTERED,
    FREQUENCY_SWEEP,
    IDENTIFIED,
    METHODS,
    OUTPUT_ERROR,
    UNITS,
    Identification,
    Match,
    Trials,
)
from ...identification.model import Parameters
from .published import PUBLISHED, Published, best_performance, dry_friction, expected, largest_mean_error

Fits = Mapping[str, Identification]
Row = tuple[str | float, ...]


def table1(truth: Parameters) -> Table:
    """Table 1: the model's motion under the printed motion of the plate."""
    rows: list[Row] = []
    for printed in PUBLISHED:
        for motion in expected(truth, printed):
            series = f"{motion.name} ({motion.unit})"
            amplitudes = motion.amplitude, motion.printed_amplitude
            rows.append((printed.name, series, *amplitudes, motion.offset, motion.printed_offset))
    headings = ("experiment", "data", "amplitude", "paper", "offset", "paper")
    return Table("Table 1: the model (Table 2's parameters) under the printed y_p1", headings, tuple(rows))


def table_of(identification: Identification, printed: Published, number: int) -> Table:
    """Tables 2 to 4: identified from one noisy record, beside the paper's."""
    rows: list[Row] = []
    for k, name in enumerate(IDENTIFIED):
        cells: list[str | float] = [f"{name} ({UNITS[name]})", printed.values[k], printed.rsd[k]]
        for method in METHODS:
            fit = identification.fits[method]
            cells += [float(fit.values[k]), float(fit.rsd[k])]
        rows.append(tuple(cells))
    last: list[str | float] = ["condition number", printed.condition, ""]
    for method in METHODS:
        last += [identification.fits[method].condition, ""]
    headings = ["parameter", "paper", "RSD (%)"]
    for method in METHODS:
        headings += [method, "RSD (%)"]
    return Table(
        f"Table {number}: Experiment {printed.name} (truth: Table 2's parameters; noise: own choice)",
        tuple(headings),
        (*rows, tuple(last)),
    )


def table5(driven: Mapping[str, Sequence[Match]]) -> Table:
    """Table 5: model by output error, driven by the contact force, beside the synthetic record."""
    rows: list[Row] = []
    for printed in PUBLISHED:
        for k, match in enumerate(driven[printed.name]):
            rows.append(
                (
                    printed.name,
                    match.channel,
                    match.performance,
                    printed.performance[k],
                    1e3 * match.mean_error,
                    printed.mean_error[k],
                    largest_mean_error(printed, k),
                )
            )
    headings = (
        "experiment", "data", "P_f (%)", "paper", "mean error (mm)", "paper", "most that its P_f allows",
    )  # fmt: skip
    return Table("Table 5: fitting performance and mean error", headings, tuple(rows))


def ranking(kept: Fits, medians: Mapping[str, Sequence[float]]) -> Table:
    """Condition number and RSD of the experiments, ranked."""
    rows: list[Row] = []
    for printed in PUBLISHED:
        fit = kept[printed.name].fits[FILTERED]
        both = zip(medians[printed.name], printed.rsd, strict=True)
        deviations = (f"{ours:.3g} / {theirs:.3g}" for ours, theirs in both)
        rows.append((printed.name, fit.condition, printed.condition, *deviations))
    headings = (
        "experiment",
        "condition number",
        "paper",
        *(f"RSD {name} (%), ours / paper" for name in IDENTIFIED),
    )
    return Table(
        "Ranking: condition number with offset kept, median RSD with offset free (low-passed)",
        headings,
        tuple(rows),
    )


def cure(kept: Fits, free: Fits) -> Table:
    """RSD of every parameter on a single sine and on a frequency sweep, offset kept and free."""
    rows: list[Row] = []
    for name in (EXPERIMENTS[0].name, FREQUENCY_SWEEP.name):
        for label, identification in (("kept", kept[name]), ("free", free[name])):
            for method in (FILTERED, OUTPUT_ERROR):
                fit = identification.fits.get(method)
                shown = ["no solution"] * 5 if fit is None else [f"{value:.3g}" for value in fit.rsd]
                condition = "" if fit is None else f"{fit.dependence:.3g}"
                rows.append((f"{name}, offset {label}", method, *shown, condition))
    headings = ("record", "method", *(f"RSD {name} (%)" for name in IDENTIFIED), "condition, lengths 1")
    return Table("Why k3 is unsure, and its cure: a sweep", headings, tuple(rows))


def coverage_table(names: Sequence[str], trials: Sequence[Mapping[str, Trials]], count: int) -> Table:
    """How often the 95 % intervals hold the truth."""
    rows: list[Row] = []
    for name, by_method in zip(names, trials, strict=True):
        for method in METHODS:
            shares = by_method[method].coverage
            rows.append((name, method, *(f"{share:.1f}" for share in shares)))
    headings = ("record", "method", *(f"{name} (%)" for name in IDENTIFIED))
    return Table(f"Truth inside its own 95 % interval, of {count} records", headings, tuple(rows))


def friction_table(truth: Parameters) -> Table:
    """What Table 1's force amplitudes would take."""
    rows: list[Row] = []
    for printed in PUBLISHED:
        force, *_ = expected(truth, printed)
        rows.append(
            (
                printed.name,
                force.amplitude,
                printed.force[0],
                dry_friction(truth, printed),
                best_performance(truth, printed),
                printed.performance[0],
            )
        )
    headings = (
        "experiment", "force amplitude (N)", "paper", "dry friction that would explain it (N)",
        "best P_f of y_p1 under the paper's force (%)", "paper",
    )  # fmt: skip
    return Table("Table 1's forces under Table 2's parameters", headings, tuple(rows))
