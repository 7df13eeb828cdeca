"""``panto design``: a search for values of a line or a pantograph."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import rich.progress
from typer import Argument, Option

from ..base.files import make_folder
from ..studies.design.check import (
    candidates_of,
    check,
    checked_table,
    tornado_table,
    values_table,
    write,
)
from ..studies.design.search import best_of, read_design, search
from ..terminal import Json, bars, console, print_json, print_table


def design(
    study: Annotated[str, Argument(help="TOML file: what is searched, at which speeds; docs/design.md.")],
    output: Annotated[
        Path, Option(help="Folder of what was tried, which a search that was broken off goes on from.")
    ] = Path("runs/design"),
    designs: Annotated[
        int | None, Option(min=1, help="Number of designs, in the place of the file's.")
    ] = None,
    workers: Annotated[int | None, Option(min=1, help="Threads; one per core by default.")] = None,
    json: Json = False,
) -> None:
    """Search for values of a line or a pantograph that keep all requirements, and check what was found."""
    make_folder(output)  # before hours of work
    wanted = read_design(study)
    if designs is not None:
        wanted = wanted.model_copy(update={"designs": designs})
    with bars(
        "designs",
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeRemainingColumn(),
        rich.progress.TextColumn("{task.fields[note]}"),
    ) as progress:
        bar = progress.add_task("designs", total=wanted.designs, note="")

        def told(done: int, total: int, note: str) -> None:
            progress.update(bar, completed=done, total=total, note=note)

        found = search(wanted, output, workers=workers, progress=told)
    candidates = candidates_of(wanted, found)
    checked = check(wanted, candidates)
    files = write(wanted, found, checked, candidates, output)
    best = best_of(wanted, found)[0]
    if json:
        trials = [{"values": trial.params, "objectives": trial.values} for trial in best_of(wanted, found)]
        print_json(
            {"designs": len(found.trials), "best": trials, "checked": [each._asdict() for each in checked]}
        )
        return
    print_table(values_table(wanted, candidates))
    print_table(checked_table(checked))
    print_table(tornado_table(wanted, best.params))
    console.print(f"Written: {', '.join(map(str, files))}; `panto line` shows the line's droppers.")
