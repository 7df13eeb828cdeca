"""A command's function, called with words as a program would be."""

import typer
from typer.testing import CliRunner


def called(function, *words, columns=200):
    """Result of a command, or of a group of them, with these words."""
    app = function
    if not isinstance(function, typer.Typer):
        app = typer.Typer()
        app.command()(function)
    return CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": str(columns)})
