"""``panto trainings``. Torch is imported only where a training runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from panto_env.base.files import make_folder
from panto_env.base.table import Table
from panto_env.cluster import RayAddress
from panto_env.terminal import Json, counting, print_json, print_table, progress_console, this_command

from .packages import check_packages

if TYPE_CHECKING:
    from .trainings import Outcome


def trainings(
    configs: Annotated[
        list[Path], typer.Argument(help="Trainings: TOML files, or names such as ppo and sac.")
    ],
    seed: Annotated[
        list[int] | None, typer.Option(help="Seed, instead of the files'; repeatable.", min=0)
    ] = None,
    steps: Annotated[int | None, typer.Option(help="Environment steps, instead of the files'.")] = None,
    output: Annotated[
        Path, typer.Option(help="Folder in which each run has one, NAME-ALGORITHM-seedK.")
    ] = Path("runs"),
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue runs that have begun, and begin the others.")
    ] = False,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.")] = None,
    ray: RayAddress = None,
    json: Json = False,
) -> None:
    """Train several configurations under several seeds in parallel, each run as by `panto train`.

    On a Ray cluster all machines must see the folder of the runs, and a run whose worker dies continues from
    its newest checkpoint. On one machine, repeat the command with --resume.
    """
    check_packages()
    from .trainings import plan, train_all

    planned = plan(configs, seed or None, steps, output)
    make_folder(output)  # now, and not in each worker
    try:
        with counting("trainings") as progress:
            command = this_command()
            outcomes = train_all(
                planned, resume=resume, workers=workers, ray=ray, progress=progress, command=command
            )
    except KeyboardInterrupt as error:
        progress_console.print(f"Stopped. To continue, repeat the command with --resume ({output}).")
        raise typer.Exit(130) from error
    if json:
        print_json([asdict(each) for each in outcomes])
        return
    print_table(_table(outcomes))


def _table(outcomes: Sequence[Outcome]) -> Table:
    """Table of the best models, one row per run."""
    rows = []
    for each in outcomes:
        change = "ended early" if each.ratio is None else f"{100 * (each.ratio - 1):+.1f} %"
        note = "" if each.qualified else "F_m out of range"
        rows.append((each.best, str(each.best_steps), change, note))
    return Table("best models", ("model file", "step", "σ to passive", "disqualified"), tuple(rows))
