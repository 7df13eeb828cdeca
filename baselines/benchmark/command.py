"""The command `panto benchmark`."""

from __future__ import annotations

import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from panto_env.analysis.options import with_settings
from panto_env.base.files import PAGES
from panto_env.cluster import RayAddress
from panto_env.terminal import (
    Force,
    Json,
    Plot,
    console,
    counting,
    print_json,
    refuse_overwriting,
    writable,
    written_last,
)

from ..line import OPTIONS
from .run import SUFFIXES, run

if TYPE_CHECKING:
    from .settings import BenchmarkSettings

PLACE = (*OPTIONS, "pantographs")
"""Options that say what runs on which line: they replace the lines of a file."""
DRAW = "draw"
"""Salt that stands for one drawn at random."""


@with_settings(only=(*OPTIONS, "actuator", "sensors", "line_condition", "control_interval"), defaults=False)
def benchmark(
    given: dict[str, Any],
    policies: Annotated[
        list[str] | None,
        typer.Argument(help="Names, with parameters (p:gain=0.5) or without, or model files."),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="TOML file, or a name such as benchmark; other options take precedence over it."),
    ] = None,
    speed: Annotated[list[float] | None, typer.Option(help="Speed (km/h) on every line; repeatable.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Number of seeds.")] = None,
    salt: Annotated[
        str | None,
        typer.Option(
            help="Make new test seeds from this text, which the result holds with its SHA-256, or from one "
            "drawn at random: 'draw'."
        ),
    ] = None,
    trusted: Annotated[
        bool,
        typer.Option(
            "--trusted", help="Run installed policies in the process of the plant: faster by little."
        ),
    ] = False,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.")] = None,
    ray: RayAddress = None,
    output: Annotated[
        str | None,
        typer.Option(
            help="File to write: everything as .json, or the passes as .csv, .xlsx or .parquet.",
            callback=writable(SUFFIXES, announced=False),
        ),
    ] = None,
    force: Force = False,
    plot: Plot = None,
    html: Annotated[
        str | None,
        typer.Option(help="Page to write, as `panto report` does.", callback=writable(PAGES)),
    ] = None,
    json: Json = False,
) -> None:
    """Compare policies on the same lines, at the same speeds, under the same seeds.

    Ranks them by the change of σ from a passive pantograph at the same mean force. A policy that moves the
    mean force by more than 1.5 % in a cell or in a third of all passes, or by more than 5 % in any pass, is
    shown but not ranked.
    The plot shows the contact force on every line at its highest speed, and σ over speed.
    """
    from panto_env.analysis.plots import save

    from ..report.page import save as save_page
    from ..report.result import parse_result
    from .plot import plot as draw
    from .report import tables
    from .seeds import salt_hash

    line = {name: given.pop(name, None) for name in PLACE}
    settings = _settings(
        config,
        line=line | {"speeds_kmh": speed or None},
        policies=policies or None,
        trainings={} if policies else None,
        seeds=seeds,
        salt=secrets.token_hex(16) if salt == DRAW else salt,
        trusted=trusted or None,
        **given,
    )
    if output is not None:
        refuse_overwriting(output, force)
    with counting("passes") as progress:
        outcome = run(settings, workers, progress, ray)
    with written_last() as later:
        if output is not None:
            later(outcome.save, output)
        if plot is not None:
            later(save, draw(outcome), plot)
        if html is not None:
            later(save_page, [parse_result(outcome.as_dict(), "the outcome")], html)
        if json:
            print_json(outcome.as_dict())
            return
        console.print(tables(outcome))
        if settings.salt is not None:
            words = f"Seeds are made from the salt '{settings.salt}', SHA-256 {salt_hash(settings.salt)}."
            console.print(words, soft_wrap=True)


def _settings(config: Path | None, line: dict[str, Any], **given: Any) -> BenchmarkSettings:
    """Settings of the file, or the defaults, changed by what was given on the command line.

    A catenary or pantograph replaces all of the file's lines; speeds apply to every line.
    """
    from panto_env.base.settings import parse

    from .settings import BenchmarkSettings, load_benchmark

    base = BenchmarkSettings() if config is None else load_benchmark(config)
    line_changes = _without_none(line)
    table = base.model_dump() | _without_none(given)
    if line_changes.keys() & set(PLACE):
        table["lines"] = [line_changes]
    else:
        table["lines"] = [old | line_changes for old in table["lines"]]
    return parse(BenchmarkSettings, table, "the benchmark")


def _without_none(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
