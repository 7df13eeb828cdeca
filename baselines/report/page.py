"""A self-contained HTML page; the same results give the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from panto_env.analysis.options import DroppersFile, FiguresFile
from panto_env.base.errors import InputError
from panto_env.base.files import PAGES, check_output, write_whole
from panto_env.report.page import page_template
from panto_env.terminal import announce_overwriting, console

from ..benchmark.report import LEGEND
from ..benchmark.run import Result, read_result
from .charts import BOTTOM, GAP, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from .tables import BAR, signed, summary
from .track import track


def page(results: Sequence[Result]) -> str:
    """HTML of the page for one or several tracks.

    All text from a result is escaped, names of policies too: a result may come from anyone.
    """
    template = page_template("panto_baselines.report", signed=signed)
    return template.render(
        tracks=[track(result) for result in results],
        legend=LEGEND,
        box={
            "width": WIDTH,
            "height": HEIGHT,
            "left": LEFT,
            "right": WIDTH - RIGHT,
            "top": TOP,
            "bottom": HEIGHT - BOTTOM,
            "gap": GAP,
        },
        bar=BAR,
    )


def save(results: Sequence[Result], path: str | Path) -> None:
    """Write the page, whole or not at all. Raises InputError for a file name without a page's suffix."""
    check_output(path, PAGES)
    with write_whole(path) as temporary:
        temporary.write_text(page(results), encoding="utf-8")


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
    kinds = {file.suffix.lower() for file in files}
    of_runs = kinds == {".parquet"} and not markdown
    if kinds != {".json"} and not of_runs:
        odd = next((file for file in files if file.suffix.lower() != ".json"), files[0])
        raise InputError(
            f"{odd}: give either runs (.parquet) or results of the benchmark (.json), not both"
            f"{'; --markdown takes results of the benchmark' if markdown else ''}."
        )
    if not of_runs and (figures is not None or droppers is not None):
        raise InputError(
            "--figures and --droppers are for runs (.parquet); the passes of a benchmark are written by "
            "`panto benchmark --output`."
        )
    if markdown:
        tables = [summary(read_result(file)) for file in files]
        print("\n".join(f"*{each.title}*\n\n{each.markdown}" for each in tables))
        return
    path = files[0].with_suffix(PAGES[0]) if output is None else output
    check_output(path, PAGES)
    announce_overwriting(path)
    if of_runs:
        _of_runs(files, path, figures, droppers)
        return
    save([read_result(file) for file in files], path)
    console.print(f"The page is {path}.", highlight=False, soft_wrap=True)


def _of_runs(files: list[Path], path: Path, figures: str | None, droppers: str | None) -> None:
    from panto_env import Trajectory, report
    from panto_env.metrics.run_tables import save_droppers, save_figures

    report.save(files, path)
    console.print(f"The report is {path}.", highlight=False, soft_wrap=True)
    runs = [Trajectory.load(file) for file in files] if figures or droppers else []
    if figures is not None:
        save_figures(runs, figures)
    if droppers is not None:
        save_droppers(runs, droppers)
