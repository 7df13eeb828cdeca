"""``panto validate``: the table of EN 50318:2002, and how the figures converge."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from ..metrics.labels import LABELS
from ..studies.en50318 import study as validation
from ..terminal import Json, Plot, console, number, print_json, progress_console


def validate(
    convergence: Annotated[
        bool, typer.Option("--convergence", help="Print how the figures converge in grid and step.")
    ] = False,
    window: Annotated[
        bool, typer.Option("--window", help="Print how travelling windows compare with a whole line.")
    ] = False,
    wear: Annotated[
        bool, typer.Option("--wear", help="Print what the time step does to figures on a worn line.")
    ] = False,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Check the flexible catenary against EN 50318:2002; exit with 1 if any figure lies outside."""
    if plot is not None:
        from ..analysis import plots as figures

        figures.check_picture(plot)
    runs = validation.reference_runs()
    checks = validation.check(runs)
    if plot is not None:
        labels = [f"{run.speed_kmh:g} km/h" for run in runs]
        title = "Reference model of EN 50318:2002, spans 5 and 6"
        figures.save(figures.plot_forces(runs, labels, validation.SPANS, title), plot)
    table = _convergence() if convergence else []
    windows = _windows() if window else []
    worn = _worn() if wear else []
    passed = all(check.inside for check in checks)
    if json:
        rows = [vars(check) | {"inside": check.inside} for check in checks]
        told = {"passed": passed, "checks": rows, "convergence": table}
        told |= {"windows": [vars(each) for each in windows]}
        print_json(told | {"wear": [vars(each) for each in worn]})
    else:
        _print_checks(checks)
        if convergence:
            _print_convergence(table)
        if window:
            _print_windows(windows)
        if wear:
            _print_wear(worn)
        console.print("All figures inside." if passed else "[bold red]Not all figures are inside.")
    if not passed:
        raise typer.Exit(1)


def _print_checks(checks: list[validation.Check]) -> None:
    table = Table(title="EN 50318:2002 reference model, spans 5 and 6, low-passed at 20 Hz")
    table.add_column("figure")
    for speed in validation.SPEEDS_KMH:
        table.add_column(f"{speed:g} km/h", justify="right")
        table.add_column("accepted", justify="right")
    for name in validation.ACCEPTED:
        cells = [LABELS[name].heading]
        for item in (check for check in checks if check.figure == name):
            value = number(item.value, 2)
            cells.append(value if item.inside else f"[bold red]{value} outside[/]")
            low, high = number(item.lowest, 0), number(item.highest, 0)
            cells.append(low if low == high else f"{low} to {high}")
        table.add_row(*cells)
    console.print(table)
    console.print(
        "The catalogue entry en50318-2002 says which open values were chosen, and how: "
        "`panto list en50318-2002`."
    )


def _convergence() -> list[dict[str, Any]]:
    rows = []
    for numerics in validation.DISCRETISATIONS:
        keys = validation.in_use(numerics).model_dump()
        with progress_console.status(str(numerics)):
            runs = validation.reference_runs(validation.CONVERGENCE_SPEEDS_KMH, **keys)
        for run in runs:
            figures = run.summary(validation.SPANS).as_dict()
            rows.append(keys | {"speed_kmh": run.speed_kmh} | figures)
    return rows


def _print_convergence(rows: list[dict[str, Any]]) -> None:
    table = Table(title="Convergence; σ relative to the first row of its speed")
    for heading in ("km/h", "grid\n(m)", "step\n(ms)", "window\n(spans)", "precision", "F_m\n(N)", "σ\n(N)"):
        table.add_column(heading, justify="right")
    for heading in ("σ\n(%)", "max\n(N)", "min\n(N)", "uplift\n(mm)"):
        table.add_column(heading, justify="right")
    for speed in validation.CONVERGENCE_SPEEDS_KMH:
        own = [row for row in rows if row["speed_kmh"] == speed]
        for row in own:
            relative = 100 * (row["std"] / own[0]["std"] - 1)
            values = (row["mean"], row["std"], relative, row["max"], row["min"], 1e3 * row["max_uplift"])
            table.add_row(
                f"{speed:g}",
                f"{row['spacing']:.3g}",
                f"{1e3 * row['time_step']:g}",
                str(row["window"] or "all"),
                row["precision"],
                *(number(value, 2) for value in values),
            )
        table.add_section()
    console.print(table)


def _windows() -> list[validation.WindowCheck]:
    checks = []
    for catenary, pantograph in validation.WINDOW_LINES:
        for speed in validation.WINDOW_SPEEDS_KMH:
            with progress_console.status(f"windows on {catenary} at {speed:g} km/h"):
                checks += validation.check_windows(catenary, pantograph, speed)
    return checks


def _print_windows(checks: list[validation.WindowCheck]) -> None:
    first, last = validation.WINDOW_RANGE
    table = Table(
        title=f"Travelling windows beside a whole line of {validation.WINDOW_SPANS} spans, "
        f"spans {first} to {last}"
    )
    table.add_column("line")
    for heading in ("km/h", "window\n(spans)", "σ\n(%)", "max\n(%)", "min\n(% of F_m)", "uplift\n(%)"):
        table.add_column(heading, justify="right")
    table.add_column("force, rms\ndifference (N)", justify="right")
    for check in checks:
        values = (check.std, check.max, check.min, check.uplift)
        shown = (f"{value:+.2f}" for value in values)
        speed, window = f"{check.speed_kmh:g}", str(check.window)
        table.add_row(
            check.catenary,
            speed,
            window,
            *shown,
            number(check.rms),
            end_section=check.window == validation.WINDOWS[-1],
        )
    console.print(table)


def _worn() -> list[validation.WearCheck]:
    checks = []
    for condition in validation.WEAR:
        for numerics in validation.WEAR_DISCRETISATIONS:
            with progress_console.status(f"{condition}, {numerics}"):
                checks.append(validation.check_wear(condition, numerics))
    return checks


def _print_wear(checks: list[validation.WearCheck]) -> None:
    first, last = validation.WEAR_SPANS
    table = Table(
        title=f"Worn line of EN 50318:2002 at {validation.WEAR_SPEED_KMH:g} km/h, spans {first} to {last}; "
        f"mean ± standard deviation over {validation.WEAR_SEEDS} seeds"
    )
    for heading in ("wave\n(m)", "depth\n(mm)", "grid\n(m)", "step\n(ms)", "steps\na wave"):
        table.add_column(heading, justify="right")
    for heading in ("σ\n(N)", "max\n(N)", "min\n(N)", "raw max\n(N)", "CL\n(%)"):
        table.add_column(heading, justify="right")
    for check in checks:
        forces = (check.std, check.max, check.min, check.raw_max)
        table.add_row(
            f"{check.wavelength:g}",
            f"{1e3 * check.depth:g}",
            f"{check.spacing:.3g}",
            f"{1e3 * check.time_step:g}",
            f"{check.steps:.1f}",
            *(f"{mean:.1f} ± {spread:.1f}" for mean, spread in forces),
            "{:.2f} ± {:.2f}".format(*check.contact_loss),
        )
    console.print(table)
