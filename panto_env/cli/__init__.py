"""The command ``panto``."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points

from ..base.errors import InputError

COMMANDS = "panto_env.commands"
"""Entry-point group of sub-commands that other packages bring."""


def main() -> None:
    """Run the command. Bad input ends it with one line on standard error and exit status 2."""
    import typer

    from . import catalogue, identify, reproduce, simulate, speed, sweep, validate

    app = typer.Typer(
        name="panto",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        help="Pantograph-catenary simulation, control and learning.",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_version)
    app.command("list")(catalogue.list_entries)
    app.command()(simulate.simulate)
    app.command()(sweep.sweep)
    app.command()(validate.validate)
    app.command()(identify.identify)
    app.command()(speed.speed)
    app.command()(reproduce.reproduce)
    for point in sorted(entry_points(group=COMMANDS), key=lambda point: point.name):
        app.command(point.name)(point.load())
    try:
        app()
    except InputError as error:
        print(f"panto: {error}", file=sys.stderr)
        sys.exit(2)


def _version() -> None:
    """Pantograph-catenary simulation, control and learning."""
