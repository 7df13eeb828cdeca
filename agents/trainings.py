"""Many trainings, over configurations and seeds, each in a run folder of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from panto_env.analysis.pool import Progress
from panto_env.base.errors import InputError
from panto_env.cluster import spread

from .model_file import read_model
from .run_folder import RunFolder
from .settings import Training, load_training


@dataclass(frozen=True)
class Outcome:
    """Outcome of a finished run: its best model."""

    folder: str
    algorithm: str
    seed: int
    steps: int  # of the whole training
    best: str  # model file of the best evaluation
    best_steps: int  # steps trained by then
    ratio: float | None  # mean of sigma over that of the passive pantograph; None: a run ended early
    qualified: bool  # whether every mean force was within its range


def run_name(config: Path, training: Training) -> str:
    """Default name of a run's folder."""
    return f"{config.stem}-{training.algorithm}-seed{training.seed}"


def plan(
    configs: Sequence[Path], seeds: Sequence[int] | None, total_steps: int | None, output: Path
) -> dict[Path, Training]:
    """Trainings of all configurations under all seeds, by the folder of each run, in ``output``.

    seeds, total_steps: None for those of each file. Raises InputError for a file that is not valid, and if
    two runs would have the same folder.
    """
    planned: dict[Path, Training] = {}
    for config in configs:
        for seed in seeds or (None,):
            training = load_training(config, seed=seed, total_steps=total_steps)
            folder = output / run_name(config, training)
            if folder in planned:
                raise InputError(
                    f"Two of the trainings would go into {folder}; omit a repeated seed, or rename "
                    "a configuration file."
                )
            planned[folder] = training
    return planned


def train_all(
    trainings: Mapping[Path, Training],
    *,
    resume: bool = False,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
    command: str | None = None,
) -> list[Outcome]:
    """Train each into its folder; outcomes in the order of the trainings.

    resume: continue runs that have begun, begin the others. workers, ray: see ``spread``; on a cluster all
    machines must see the folders, and a run whose worker died continues from its newest checkpoint. command:
    stored in the model files. Raises InputError before anything begins if, without ``resume``, one of the
    folders holds anything, and for the same reasons as ``train``.
    """
    if not resume:
        for path in trainings:
            RunFolder(path).check_new()
    jobs = [
        partial(_begin_or_go_on, training, path.absolute(), command) for path, training in trainings.items()
    ]
    spread(jobs, workers=workers, ray=ray, progress=progress)
    return [_outcome(training, RunFolder(path)) for path, training in trainings.items()]


def _begin_or_go_on(training: Training, path: Path, command: str | None) -> None:
    """Run one training, or continue it if its worker died before."""
    from .train import train  # imports torch, which only a training needs

    resume = RunFolder(path).settings.is_file()
    train(training, path, resume=resume, progress=False, command=command)


def _outcome(training: Training, folder: RunFolder) -> Outcome:
    facts, _ = read_model(folder.best)
    return Outcome(
        folder=str(folder.path),
        algorithm=training.algorithm,
        seed=training.seed,
        steps=training.total_steps,
        best=str(folder.best),
        best_steps=facts.steps,
        ratio=facts.ratio,
        qualified=facts.qualified,
    )
