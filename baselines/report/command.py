"""The command `panto report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from panto_env.base.errors import InputError
from panto_env.base.files import PAGES, check_output
from panto_env.terminal import console


def report(
    files: Annotated[
        list[Path], typer.Argument(help="Results of `panto benchmark --output RESULT.json`, one a track.")
    ],
    output: Annotated[
        Path | None, typer.Option(help="Page to write; the first file's name with .html by default.")
    ] = None,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print each track's table for a document; write no page."),
    ] = False,
) -> None:
    """Write a page of HTML on what was measured: tables that sort, forces and spectra, every policy.

    It holds all that it needs, and opens in any browser without a network.
    """
    from .page import save
    from .result import read_result

    for file in files:
        if file.suffix.lower() != ".json":
            raise InputError(f"{file} must end in .json, as results of `panto benchmark --output` do.")
    if markdown:
        from .summary import summary

        tables = [summary(read_result(file)) for file in files]
        print("\n".join(f"*{each.title}*\n\n{each.markdown}" for each in tables))
        return
    path = files[0].with_suffix(PAGES[0]) if output is None else output
    check_output(path, PAGES)
    save([read_result(file) for file in files], path)
    console.print(f"The page is {path}.", markup=False, highlight=False, soft_wrap=True)
