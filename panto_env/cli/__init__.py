"""The command ``panto``."""

from __future__ import annotations

import io
import os
import signal
import sys
import warnings
from contextlib import suppress
from types import FrameType
from typing import Annotated, Any, TextIO

import typer
from typer import Abort, Option

from ..base.checksums import __version__
from ..base.errors import AccuracyWarning, InputError, PlugInWarning, UnusualWarning, one_line
from ..terminal import NARROW, console, say
from .group import PlugInGroup, give_options_once

UsageError: Any = typer.BadParameter.__base__
"""Click's class, which older releases of Typer import and newer ones include."""


def main() -> None:
    """Run the command. Invalid input ends it with one line on standard error and exit status 2.

    SIGTERM ends it like an interrupt from the keyboard, with all clean-up.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # where an encoding lacks Greek letters
    warnings.showwarning = _show_warning
    sys.exit(_run())


def _run() -> int:
    """Exit status of the command."""
    stopped: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        """Turn the first SIGTERM into an interrupt; a second one kills."""
        signal.signal(number, signal.SIG_DFL)
        stopped.append(number)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    try:
        status: int | None = make_app()(standalone_mode=False)  # otherwise Typer draws a box around errors
        print(end="", flush=True)  # output that cannot be written fails here, not at the exit
    except InputError as error:
        return _refuse(str(error))
    except UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":  # not an error: its message is the help
            error.show()
            return int(error.exit_code)
        command = "panto" if error.ctx is None else error.ctx.command_path
        return _refuse(f"{error.format_message().rstrip('.')}; see `{command} --help`.")
    except Abort:
        status = 1
    except OSError as error:  # standard output is full, or nobody reads it on
        with suppress(OSError):  # otherwise the exit would fail too
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1 if isinstance(error, BrokenPipeError) else _refuse(f"{error}.")
    if stopped:
        say("Stopped by SIGTERM before it was done.")
        status = 128 + signal.SIGTERM
    return status or 0


def _refuse(sentence: str) -> int:
    say(one_line(sentence))
    return 2


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Write our own warnings without the place in our sources, which does not help the user."""
    if issubclass(category, AccuracyWarning | PlugInWarning | UnusualWarning):
        say(f"warning: {message}")
    elif sys.stderr is not None:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))


def make_app() -> typer.Typer:
    """The command with all its sub-commands; it finds those of installed packages when they are called."""
    from . import catalogue, diagnose, estimate, fit, identify, lines, records, simulate, studies, sweep

    app = typer.Typer(
        name="panto",
        cls=PlugInGroup,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        help="Pantograph-catenary simulation, control and learning.",
        context_settings={"help_option_names": ["-h", "--help"]},
        # Typer's tables cut words in a narrow terminal; plain help folds them.
        rich_markup_mode="rich" if console.width >= NARROW else None,
    )
    app.callback()(_about)
    app.command("list")(catalogue.list_entries)
    commands: list[Any] = [simulate.simulate, simulate.film, simulate.app, sweep.sweep, sweep.design]
    commands += [sweep.permissible_speed, lines.family, lines.line, studies.validate, studies.speed]
    commands += [studies.reproduce, studies.rig, identify.identify, estimate.estimate, fit.fit, fit.drift]
    for command in (*commands, diagnose.diagnose, records.record, records.compare):
        app.command()(command)
    give_options_once(app)
    return app


def _show_version(requested: bool) -> None:
    if requested:
        print(f"panto-env {__version__}")
        raise typer.Exit


def _about(
    version: Annotated[
        bool, Option("--version", is_eager=True, callback=_show_version, help="Print the version.")
    ] = False,
) -> None:
    """Pantograph-catenary simulation, control and learning."""
