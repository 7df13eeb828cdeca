"""The commands `panto dataset episodes`, `panto dataset designs` and `panto dataset verify`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from panto_env.base.files import make_folder
from panto_env.base.settings import parse
from panto_env.base.table import Table
from panto_env.cluster import RayAddress
from panto_env.terminal import Json, console, counting_on, print_json, print_table

dataset = typer.Typer(no_args_is_help=True, help="Make data to learn from, and check it.")
Workers = Annotated[int | None, typer.Option(help="Processes; one per core by default.", min=1)]


@dataset.command()
def episodes(
    config: Annotated[Path, typer.Argument(help="TOML file, or a name such as dataset-known-line.")],
    output: Annotated[
        Path, typer.Option(help="Folder for the data sets; MINARI_DATASETS_PATH may point to it.")
    ] = Path("data"),
    only: Annotated[
        list[str] | None, typer.Option(help="One of the file's sets, instead of all; repeatable.")
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(help="Episodes per policy, noise and place of every set, instead of the file's.", min=1),
    ] = None,
    workers: Workers = None,
    ray: RayAddress = None,
    json: Json = False,
) -> None:
    """Record episodes of policies as Minari data sets.

    Finished work is kept: the same command continues after an interruption.
    """
    from .make import make_episodes
    from .settings import chosen, load_episodes

    settings = load_episodes(config)
    if only:
        settings = chosen(settings, tuple(only))
    if episodes is not None:
        sets = [each.model_dump() | {"episodes": episodes} for each in settings.sets]
        settings = parse(type(settings), settings.model_dump() | {"sets": sets}, str(config))
    make_folder(output)
    with counting_on("parts", output) as progress:
        made = make_episodes(settings, output, workers=workers, ray=ray, progress=progress)
    if json:
        print_json([asdict(each) | {"folder": str(each.folder)} for each in made])
        return
    rows = [
        (each.dataset_id, f"{each.episodes:,}", f"{each.steps:,}", f"{each.megabytes:.1f}") for each in made
    ]
    print_table(Table("data sets", ("Minari's name", "episodes", "steps", "MB"), rows))
    console.print(f"MINARI_DATASETS_PATH={output.resolve()}", highlight=False)


@dataset.command()
def designs(
    config: Annotated[Path, typer.Argument(help="TOML file, or a name such as dataset-designs.")] = Path(
        "dataset-designs"
    ),
    output: Annotated[Path, typer.Option(help="Folder for the table.")] = Path("data"),
    count: Annotated[
        int | None,
        typer.Option(help="Number of designs, instead of the file's; powers of two fill evenly.", min=1),
    ] = None,
    workers: Workers = None,
    ray: RayAddress = None,
    json: Json = False,
) -> None:
    """Simulate many designs of line and pantograph, and write a table of their figures.

    Finished work is kept: the same command continues after an interruption.
    """
    from .designs import load_designs
    from .make import make_designs

    settings = load_designs(config)
    if count is not None:
        settings = parse(type(settings), settings.model_dump() | {"count": count}, str(config))
    make_folder(output)
    with counting_on("parts", output) as progress:
        made = make_designs(settings, output, workers=workers, ray=ray, progress=progress)
    if json:
        print_json(asdict(made) | {"folder": str(made.folder)})
        return
    counts = (f"{each:,}" for each in (made.designs, made.refused, made.ended_early, made.warned))
    headings = ("folder", "designs", "refused", "ended early", "with warnings", "MB")
    row = (str(made.folder), *counts, f"{made.megabytes:.1f}")
    print_table(Table("designs", headings, (row,)))


@dataset.command()
def verify(
    path: Annotated[Path, typer.Argument(help="Folder of a data set, or of several.")],
    json: Json = False,
) -> None:
    """Check by SHA-256 that the files of data sets are undamaged."""
    from .make import verify as verify_folder

    found = verify_folder(path)
    if json:
        print_json([{"folder": str(folder), "files": files} for folder, files in found])
        return
    for folder, files in found:
        console.print(f"{folder}: {files} files as listed", highlight=False)
