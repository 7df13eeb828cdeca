"""``panto identify``: a pantograph's parameters from a record of a rig."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from ..base.errors import InputError
from ..terminal import Json, Plot, console, number, print_json, progress_console


class Method(StrEnum):
    """The methods by short names."""

    printed = "equation-error"
    filtered = "low-passed"
    output = "output-error"


def identify(
    file: Annotated[Path, typer.Argument(help="CSV: time, y_p1, y_p2, y_p3, and force where measured.")],
    more: Annotated[list[str] | None, typer.Argument(metavar="[NAME=VALUE]...", hidden=True)] = None,
    measured: Annotated[
        list[str] | None,
        typer.Option(
            help="Known values in SI units: k1T=32992 m2=5 k2=14544, in one option or several. Any other "
            "parameter may be given too and is then not identified."
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(help="Unit of a column whose header has none, as y_p1=mm; may be repeated."),
    ] = None,
    band: Annotated[
        float | None, typer.Option(help="Highest frequency of the excitation (Hz), else found.")
    ] = None,
    free_offset: Annotated[
        bool,
        typer.Option("--free-offset", help="Only motion counts: the zero of the displacements is not known."),
    ] = False,
    method: Annotated[Method, typer.Option(help="Whose parameters are plotted and written.")] = Method.output,
    static_force: Annotated[
        float | None, typer.Option(help="Lifting force of the pantograph written (N), else the mean force.")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="Write the pantograph to this TOML file.")] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Identify a two-mass pantograph from a record of a rig, as paper 1 does, and by output error."""
    from .. import identification as ident

    names = dict(zip(Method, ident.METHODS, strict=True))
    known = {name: _value(name, text) for name, text in _pairs([*(measured or []), *(more or [])])}
    if plot is not None:
        from ..analysis.plots import check_plot

        check_plot(plot)
    record = ident.read_record(file, dict(_pairs(unit or [])))
    with progress_console.status("identifying"):
        found = ident.identify(record, known, band=band, free_offset=free_offset)
    chosen = found.fits.get(names[method])
    if chosen is None and (output is not None or plot is not None or not found.fits):
        raise InputError(f"{names[method].capitalize()}: {found.failures[names[method]]}")
    checked: list[Any] = []
    if chosen is not None:
        try:
            checked = ident.matches(record, chosen.parameters)
        except InputError as error:
            if plot is not None:
                raise
            found.failures[f"the model by {chosen.method}"] = str(error)
    if output is not None and chosen is not None:
        force, source = _static_force(static_force, record.force, file)
        ident.write_pantograph(chosen, output, record=file.name, static_force=force, force_source=source)
    if plot is not None and chosen is not None:
        from ..analysis.plots import save
        from ..identification.plots import plot_matches

        time = record.time
        title = f"{file.name}, model by {chosen.method}"
        save(plot_matches(time, checked, title, float(time[0]), float(time[-1])), plot)
    if json:
        print_json(_told(found, checked, method))
        return
    _print(found, checked, names[method])


def _pairs(texts: list[str]) -> list[tuple[str, str]]:
    """Names and values from "a=1", "a=1 b=2" or "a=1,b=2"."""
    pairs = []
    for part in re.split(r"[\s,]+", " ".join(texts).strip()):
        if not part:
            continue
        name, equals, text = part.partition("=")
        if not (name and equals and text):
            raise InputError(f"'{part}' must read name=value, as k1T=32992 or y_p1=mm.")
        pairs.append((name, text))
    return pairs


def _value(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"Measured parameter {name} must be a number, not '{text}'.") from error


def _static_force(given: float | None, force: Any, file: Path) -> tuple[float, str]:
    if given is not None:
        return given, "own choice: --static-force"
    if force is None:
        raise InputError(
            "The record has no force; give the lifting force of the pantograph: --static-force N."
        )
    return float(force.mean()), f"mean contact force of {file.name}"


def _told(found: Any, checked: list[Any], method: Method) -> dict[str, Any]:
    return {
        "band": found.band,
        "fits": {short.value: fit.as_dict() for short, fit in _by_short_name(found.fits)},
        "failures": {short.value: text for short, text in _by_short_name(found.failures)},
        "method": method.value,
        "matches": [
            {
                "channel": match.channel,
                "driven_by": match.driven_by,
                "performance": match.performance,
                "mean_error": match.mean_error,
                "squared_error": match.squared_error,
            }
            for match in checked
        ],
    }


def _by_short_name(by_method: dict[str, Any]) -> list[tuple[Method, Any]]:
    """What is kept by a method's full name, by its short one."""
    from ..identification import METHODS

    return [(short, by_method[m]) for short, m in zip(Method, METHODS, strict=True) if m in by_method]


def _print(found: Any, checked: list[Any], chosen: str) -> None:
    from ..identification import UNITS

    table = Table(
        title=f"Identified, ± 95 %, relative standard deviation; excitation up to {found.band:.4g} Hz"
    )
    table.add_column("")
    for short, _ in _by_short_name(found.fits):
        table.add_column(short.value, justify="right")
    names = next(iter(found.fits.values())).names
    for k, name in enumerate(names):
        cells = []
        for fit in found.fits.values():
            half = (fit.interval[k, 1] - fit.interval[k, 0]) / 2
            cells.append(f"{fit.values[k]:.5g} ± {half:.2g}\nRSD {fit.rsd[k]:.3g} %")
        table.add_row(f"{name} ({UNITS[name]})", *cells)
    table.add_row("condition number", *(f"{fit.condition:.5g}" for fit in found.fits.values()))
    console.print(table)
    for fit in found.fits.values():
        if fit.undetermined:
            console.print(
                f"[bold red]Warning:[/] {fit.method}: {', '.join(fit.undetermined)} not determined, the "
                f"95 % interval holds 0 (condition number {fit.condition:.4g}); excite more frequencies, "
                "or record longer."
            )
    for method, text in found.failures.items():
        console.print(f"[bold red]Warning:[/] {method}: {text}")
    if not checked:
        return
    table = Table(title=f"Model by {chosen} beside the record")
    for heading in ("series", "driven by", "fitting performance (%)", "mean error"):
        table.add_column(heading)
    for match in checked:
        force = match.channel == "force"
        error = f"{match.mean_error:.3g} N" if force else f"{1e3 * match.mean_error:.3g} mm"
        table.add_row(match.channel, match.driven_by, number(match.performance), error)
    console.print(table)
