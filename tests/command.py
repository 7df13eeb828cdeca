"""The command `panto` in this process: it ends as one of its own would, without seconds of imports."""

import contextlib
import io
import signal
import subprocess
import sys
import warnings
from unittest import mock

from typer.main import get_command

from panto_env.cli import main, make_app


def whole():
    """The command `panto` with all those below it loaded, which else are when they are called."""
    group = get_command(make_app())
    for name in list(group.commands):
        group.get_command(None, name)
    return group


def panto(*arguments, cwd=None):
    """Exit status, standard output and errors of `panto` with these arguments, in a folder."""
    words = ["panto", *map(str, arguments)]
    output, errors = io.StringIO(), io.StringIO()
    handler = signal.getsignal(signal.SIGTERM)
    try:
        with (
            contextlib.chdir(cwd or "."),
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(errors),
            mock.patch.object(sys, "argv", words),
            warnings.catch_warnings(),
        ):
            main()
        status = 0
    except SystemExit as end:
        status = end.code
    finally:
        signal.signal(signal.SIGTERM, handler)
    return subprocess.CompletedProcess(words, status, output.getvalue(), errors.getvalue())
