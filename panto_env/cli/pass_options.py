"""Options of the commands that run passes along a line."""

from __future__ import annotations

from typing import Annotated

import typer

from ..base.errors import InputError

Catenary = Annotated[str, typer.Option(help="Line: a catalogue name or TOML file.")]
Pantograph = Annotated[str, typer.Option(help="Pantograph, likewise.")]
Spans = Annotated[str | None, typer.Option(help="Spans that the figures cover, first-last, as 5-6.")]
Distance = Annotated[float | None, typer.Option(help="How far to run (m).")]
ActuatorName = Annotated[str, typer.Option(help="Actuator: ideal or realistic.")]
SensorsName = Annotated[str, typer.Option(help="Sensors: ideal or realistic.")]
LineConditionName = Annotated[str, typer.Option(help="Line: new, fair or worn.")]
Seed = Annotated[int, typer.Option(help="Seed of irregularity and noise.")]
Bilateral = Annotated[bool, typer.Option("--bilateral", help="Let the contact pull, as paper 3 does.")]


def parse_spans(text: str | None) -> tuple[int, int] | None:
    """Spans from "5-6". Raises InputError where the text is not two whole numbers."""
    if text is None:
        return None
    first, dash, last = text.partition("-")
    if not (dash and first.strip().isdigit() and last.strip().isdigit()):
        raise InputError(f"--spans must read first-last, as 5-6, not '{text}'.")
    return int(first), int(last)
