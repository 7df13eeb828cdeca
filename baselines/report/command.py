"""The command `panto report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from panto_env.analysis.options import DroppersFile, FiguresFile
from panto_env.base.errors import InputError, harmless
from panto_env.base.files import PAGES, check_output
from panto_env.terminal import announce_overwriting, console


def report(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Runs of `panto simulate --output RUN.parquet`, or results of `panto benchmark --output "
            "RESULT.json`, one per track."
        ),
    ],
    output: Annotated[
        Path | None, typer.Option(help="Page to write; the first file's name with .html by default.")
    ] = None,
    figures: FiguresFile = None,
    droppers: DroppersFile = None,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print each track's table for a document; write no page."),
    ] = False,
) -> None:
    """Write an HTML page: a report of runs for engineers, or a comparison of policies from benchmark results.

    The page is self-contained, opens in any browser without a network, and can be printed.
    """
    from .page import save
    from .result import read_result

    kinds = {file.suffix.lower() for file in files}
    if kinds == {".parquet"} and not markdown:
        _of_runs(files, output, figures, droppers)
        return
    if kinds != {".json"}:
        odd = next((file for file in files if file.suffix.lower() != ".json"), files[0])
        raise InputError(
            f"{odd}: give either runs (.parquet) or results of the benchmark (.json), not both"
            f"{'; --markdown takes results of the benchmark' if markdown else ''}."
        )
    if figures is not None or droppers is not None:
        raise InputError(
            "--figures and --droppers are for runs (.parquet); the passes of a benchmark are written by "
            "`panto benchmark --output`."
        )
    if markdown:
        from .summary import summary

        tables = [summary(read_result(file)) for file in files]
        print(harmless("\n".join(f"*{each.title}*\n\n{each.markdown}" for each in tables)))
        return
    path = files[0].with_suffix(PAGES[0]) if output is None else output
    check_output(path, PAGES)
    announce_overwriting(path)
    save([read_result(file) for file in files], path)
    console.print(f"The page is {path}.", highlight=False, soft_wrap=True)


def _of_runs(files: list[Path], output: Path | None, figures: str | None, droppers: str | None) -> None:
    from panto_env import Trajectory, report
    from panto_env.metrics.run_tables import save_droppers, save_figures

    path = files[0].with_suffix(PAGES[0]) if output is None else output
    check_output(path, PAGES)
    announce_overwriting(path)
    report.save(files, path)
    console.print(f"The report is {path}.", highlight=False, soft_wrap=True)
    runs = [Trajectory.load(file) for file in files] if figures or droppers else []
    if figures is not None:
        save_figures(runs, figures)
    if droppers is not None:
        save_droppers(runs, droppers)
