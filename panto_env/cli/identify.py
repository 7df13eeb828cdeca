"""``panto identify``: a pantograph's parameters from a record of a rig."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

from typer import Argument, Option

from .. import identification
from ..analysis.plots import save
from ..base.errors import InputError
from ..identification import METHODS, Identification, Match
from ..identification.performance import (
    SUFFIXES,
    check_possible,
    matches_table,
    parameters_table,
    plot_matches,
)
from ..terminal import Json, Plot, alert, print_json, print_table, progress_console, writable, written_last

T = TypeVar("T")
Given = tuple[dict[str, str], dict[str, str]]
"""Units and headings by column."""


class Method(StrEnum):
    """The methods by short names."""

    printed = "equation-error"
    filtered = "low-passed"
    output = "output-error"


def identify(
    file: Annotated[Path, Argument(help="CSV: time, y_p1, y_p2, y_p3, and force where measured.")],
    more: Annotated[list[str] | None, Argument(metavar="[NAME=VALUE]...", hidden=True)] = None,
    measured: Annotated[
        list[str] | None,
        Option(
            help="Known values in SI units: k1T=32992 m2=5 k2=14544, in one option or several. Any other "
            "parameter may also be given, and is then not identified."
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        Option(help="Unit of a column whose header has none, e.g. y_p1=mm; may be repeated."),
    ] = None,
    band: Annotated[
        float | None, Option(help="Maximum frequency of the excitation (Hz), by default found.")
    ] = None,
    free_offset: Annotated[
        bool, Option("--free-offset", help="Use only changes: the zero of the displacements is unknown.")
    ] = False,
    method: Annotated[Method, Option(help="Method whose parameters are used.")] = Method.output,
    static_force: Annotated[
        float | None, Option(help="Lifting force to be written (N), by default the mean force.")
    ] = None,
    output: Annotated[
        str | None,
        Option(
            help="Write the pantograph to this file (.toml), if the model explains the record.",
            callback=writable(SUFFIXES),
        ),
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Identify a two-mass pantograph from a record of a rig, as paper 1 does, and by output error.

    y_p1 is the plate, y_p2 the pan head, y_p3 the articulated frame. They are measured from the rest position
    of the unloaded pantograph, positive in the direction in which the plate pushes the head (down, under a
    wire); a pushing force is positive. A record whose sampling, sizes or signs cannot be a rig's is refused
    with the likely mistake; values that no pantograph can have are marked; a pantograph is written only where
    the model explains the recorded motion.
    """
    full_name = dict(zip(Method, identification.METHODS, strict=True))[method]
    known = {name: _value(name, text) for name, text in pairs([*(measured or []), *(more or [])]).items()}
    record = identification.read_record(file, pairs(unit or []))
    with progress_console.status("identifying"):
        identified = identification.identify(record, known, band=band, free_offset=free_offset)
    chosen = identified.fits.get(full_name)
    if chosen is None and (output is not None or plot is not None or not identified.fits):
        raise InputError(f"{full_name.capitalize()}: {identified.failures[full_name]}")
    if output is not None and chosen is not None:
        check_possible(chosen)
    matches: list[Match] = []
    if chosen is not None:
        try:
            matches = identification.matches(record, chosen.parameters)
        except InputError as error:
            if plot is not None or output is not None:
                raise
            identified.failures[f"the model by {chosen.method}"] = str(error)
    with written_last() as later:
        if output is not None and chosen is not None:
            force, source = static_force, "own choice: --static-force"
            if force is None and record.force is not None:
                force, source = float(record.force.mean()), f"mean contact force of {file.name}"
            if force is None:
                raise InputError(
                    "The record has no force; give the lifting force of the pantograph: --static-force N."
                )
            own: dict[str, Any] = {"static_force": force, "force_source": source, "record": file.name}
            later(partial(identification.write_pantograph, matches=matches, **own), chosen, output)
        if plot is not None and chosen is not None:
            title = f"{file.name}, model by {chosen.method}"
            first, last = float(record.time[0]), float(record.time[-1])
            later(save, plot_matches(record.time, matches, title, first, last), plot)
        if json:
            fits = {name: fit.as_dict() for name, fit in _by_short_name(identified.fits).items()}
            facts = {"band": identified.band, "fits": fits, "failures": _by_short_name(identified.failures)}
            facts["doubts"] = list(identified.doubts)
            print_json(facts | {"method": method.value, "matches": [match.as_dict() for match in matches]})
            return
        _print(identified, matches, full_name)


def pairs(texts: list[str]) -> dict[str, str]:
    """Values by name from "a=1", "a=1 b=2" or "a=1,b=2"."""
    pairs: dict[str, str] = {}
    for part in re.split(r"[\s,]+", " ".join(texts).strip()):
        if not part:
            continue
        name, equals, text = part.partition("=")
        if not (name and equals and text):
            raise InputError(f"'{part}' must read name=value, such as k1T=32992 or y_p1=mm.")
        if name in pairs:
            raise InputError(f"{name} is given twice, as {pairs[name]} and as {text}.")
        pairs[name] = text
    return pairs


def given(unit: list[str] | None, column: list[str] | None) -> Given:
    """Units, and headings from "force=F (N)" each, by column. Raises InputError for other texts."""
    headings = dict(text.partition("=")[::2] for text in column or [])
    if not all(name and heading for name, heading in headings.items()):
        raise InputError("--column must read NAME=HEADING, such as force_1=F_zw1.")
    return pairs(unit or []), headings


def _value(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"Measured parameter {name} must be a number, not '{text}'.") from error


def _by_short_name(by_method: Mapping[str, T]) -> dict[str, T]:
    """Values by short names of methods, from values by full names; other keys are left out."""
    return {
        short.value: by_method[full] for short, full in zip(Method, METHODS, strict=True) if full in by_method
    }


def _print(identified: Identification, matches: list[Match], method: str) -> None:
    print_table(parameters_table(_by_short_name(identified.fits), identified.band))
    for fit in identified.fits.values():
        if fit.undetermined:
            alert(
                "Warning:",
                f"{fit.method}: {', '.join(fit.undetermined)} not determined, the "
                f"95 % interval holds 0 (condition number {fit.condition:.4g}); excite more frequencies, "
                "or record longer.",
            )
        if fit.impossible:
            shown = ", ".join(f"{name} = {fit.parameters[name]:.4g}" for name in fit.impossible)
            alert("Warning:", f"{fit.method}: {shown}: no pantograph has that.")
    for name, reason in identified.failures.items():
        alert("Warning:", f"{name}: {reason}")
    for doubt in identified.doubts:
        alert("Warning:", f"{doubt}.")
    if matches:
        print_table(matches_table(matches, method))
