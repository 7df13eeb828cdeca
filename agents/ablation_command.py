"""The command `panto ablation`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from panto_env.base.files import make_folder
from panto_env.cluster import RayAddress
from panto_env.terminal import Json, counting, print_json, print_table, this_command

from .packages import check_packages


def ablation(
    config: Annotated[Path, typer.Argument(help="Ablation: a TOML file, or a name such as ablation.")],
    output: Annotated[
        Path | None,
        typer.Option(help="Folder of the runs; runs/NAME by default. What is there is kept."),
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.")] = None,
    ray: RayAddress = None,
    json: Json = False,
) -> None:
    """Train an agent with and without each of its parts, under several seeds, and compare the models."""
    check_packages()
    from .ablation import load_ablation, run
    from .ablation_table import table, variants

    settings = load_ablation(config)
    folder, command = output or Path("runs") / config.stem, this_command()
    make_folder(folder)  # now, and not in each worker
    with counting("trainings") as progress:
        models, outcome = run(settings, folder, workers, ray, progress, command)
    found = variants(models, outcome)
    if json:
        rows = [asdict(each) for each in found]
        print_json({"settings": settings.model_dump(mode="json"), "variants": rows})
        return
    print_table(table(found, f"{settings.training}, {settings.total_steps:,} steps, {settings.judged_by}"))
