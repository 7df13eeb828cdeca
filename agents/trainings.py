"""The folders of training runs, and many trainings, over configurations and seeds, each in its own."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from panto_env.analysis.pool import Progress
from panto_env.base.checksums import read_checked, write_checked
from panto_env.base.errors import InputError, shown
from panto_env.base.files import make_folder, write_whole
from panto_env.cluster import spread

from .evaluation import Pair
from .model_file import read_model
from .settings import Training, load_training, parse_training

CHECKPOINTS_KEPT = 3
"""Number of checkpoints kept; older ones are removed, because a checkpoint of SAC holds the replay buffer."""


class RunFolder:
    """Paths of a run's files; reads and writes those that are neither models nor TensorBoard logs."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.settings = self.path / "settings.json"
        self.model = self.path / "model.safetensors"  # at the end of the training
        self.best = self.path / "best.safetensors"  # at the best evaluation
        self.cloning = self.path / "cloning.json"  # error of the start from another policy, if there is one
        self.evaluations = self.path / "evaluations.csv"
        self.tensorboard = self.path / "tensorboard"
        self.checkpoints = self.path / "checkpoints"

    def check(self, training: Training, resume: bool) -> None:
        """Raise InputError if the folder holds anything, or, to resume, unless it holds such a run."""
        if resume:
            self.check_resumable(training)
        else:
            self.check_new()

    def check_new(self) -> None:
        """Raise InputError if the folder holds anything already."""
        # Neither a lock counts nor a file that a killed process left half-written.
        if os.path.exists(self.path) and (
            not self.path.is_dir() or any(not path.name.startswith(".") for path in self.path.iterdir())
        ):
            raise InputError(
                f"{self.path} exists already; continue it with --resume, or give another --output."
            )

    def check_resumable(self, training: Training) -> None:
        """Raise InputError unless the folder holds a run with these settings; only the steps may be more."""
        if not self.settings.is_file():
            raise InputError(
                f"{self.path} holds no run to resume (no {self.settings.name}); train without --resume."
            )
        before = self.read_settings()
        old, new = (_dotted(settings.model_dump(mode="json")) for settings in (before, training))
        differing = [
            f"{key} is {shown(new.get(key))}, was {shown(old.get(key))}"
            for key in sorted(old.keys() | new.keys())
            if key != "total_steps" and new.get(key) != old.get(key)
        ]
        if differing:
            raise InputError(
                f"The settings differ from those of the run in {self.path}: {'; '.join(differing)}. "
                "Use the run's settings, or train into another --output."
            )
        self._rows()  # the table of evaluations is continued, so it must be readable
        if training.total_steps < before.total_steps:
            raise InputError(
                f"The run in {self.path} has total_steps = {before.total_steps}; a resumed run may have "
                f"more, but not fewer ({training.total_steps})."
            )

    def read_settings(self) -> Training:
        """Read the settings of the run. Raises InputError if the file is damaged."""
        return parse_training(read_checked(self.settings), str(self.settings))

    def write_settings(self, training: Training) -> None:
        """Write the settings of a new run."""
        # Before anything else, so that a killed run leaves either nothing or a folder that can be resumed.
        write_checked(self.settings, training.model_dump(mode="json"))
        make_folder(self.checkpoints)

    def checkpoint(self, steps: int) -> Path:
        """Path of the checkpoint at ``steps``."""
        return self.checkpoints / f"step-{steps:09d}.safetensors"

    def newest_checkpoint(self) -> Path | None:
        """Newest checkpoint that is not damaged, if there is one."""
        for path in sorted(self.checkpoints.glob("step-*.safetensors"), reverse=True):
            with suppress(InputError):
                read_model(path)
                return path
        return None

    def drop_old_checkpoints(self) -> None:
        """Keep only the newest checkpoints."""
        for path in sorted(self.checkpoints.glob("step-*.safetensors"))[:-CHECKPOINTS_KEPT]:
            path.unlink()

    def add_evaluation(self, steps: int, pairs: list[Pair]) -> None:
        """Add an evaluation's rows to the CSV, which is written whole."""
        rows = self._rows()
        for pair in pairs:
            row: dict[str, Any] = {"steps": steps}
            row |= {name: getattr(pair, name) for name in ("speed_kmh", "seed", "qualified")}
            for of in ("policy", "passive"):
                row |= {f"{of}_{key}": value for key, value in getattr(pair, of).as_dict().items()}
            rows.append({key: str(value) for key, value in row.items()})
        self._write_rows(rows)

    def drop_evaluations_after(self, steps: int) -> None:
        """Remove evaluations that a run resumed at ``steps`` will repeat; -1: all."""
        if self.evaluations.is_file():
            self._write_rows([row for row in self._rows() if int(row["steps"]) <= steps])

    def _rows(self) -> list[dict[str, str]]:
        """Rows of the table of evaluations. Raises InputError if it is damaged."""
        if not self.evaluations.is_file():
            return []
        rows: list[dict[str, str]] = []
        try:
            with self.evaluations.open(newline="", encoding="utf-8") as file:
                table = csv.DictReader(file, strict=True)
                if "steps" not in (table.fieldnames or ()):
                    raise ValueError("it has no header")
                for cells in table:
                    int(cells["steps"])
                    if None in cells or None in cells.values():
                        raise ValueError("its number of cells differs from the header's")
                    rows.append(cells)
        except (OSError, ValueError, LookupError, TypeError, csv.Error) as error:
            raise InputError(
                f"{self.evaluations} is damaged after {len(rows)} whole rows; correct or remove it, and "
                "resume again."
            ) from error
        return rows

    def _write_rows(self, rows: list[dict[str, str]]) -> None:
        text = io.StringIO()
        writer = csv.DictWriter(text, fieldnames=list(rows[0]) if rows else ["steps"])
        writer.writeheader()
        writer.writerows(rows)
        with write_whole(self.evaluations) as temporary:
            temporary.write_text(text.getvalue(), encoding="utf-8", newline="")


def _dotted(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values of nested tables under dotted keys, such as "hyperparameters.gamma"."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        name = prefix + key
        values |= _dotted(value, f"{name}.") if isinstance(value, Mapping) else {name: value}
    return values


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
    for config, seed in product(configs, seeds or (None,)):
        training = load_training(config, seed=seed, total_steps=total_steps)
        folder = output / run_name(config, training)
        if folder in planned:
            raise InputError(
                f"Two of the trainings would go into {folder}; omit a repeated seed, or rename a "
                "configuration file."
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
) -> list[dict[str, Any]]:
    """Train each into its folder; a table of each one's best model, in the order of the trainings.

    resume: continue runs that have begun, begin the others. workers, ray: see ``spread``; on a cluster all
    machines must see the folders, and a run whose worker died continues from its newest checkpoint. command:
    stored in the model files. Raises InputError before anything begins if, without ``resume``, one of the
    folders holds anything, and for the same reasons as ``train``.
    """
    if not resume:
        for path in trainings:
            RunFolder(path).check_new()
    jobs = [partial(_run_one, training, path.absolute(), command) for path, training in trainings.items()]
    spread(jobs, workers=workers, ray=ray, progress=progress)
    outcomes = []
    for path, training in trainings.items():
        best = RunFolder(path).best
        facts, _ = read_model(best)
        outcome = {"folder": str(path), "algorithm": training.algorithm, "seed": training.seed}
        outcome |= {"steps": training.total_steps, "best": str(best), "best_steps": facts.steps}
        outcomes.append(outcome | {"ratio": facts.ratio, "qualified": facts.qualified})
    return outcomes


def _run_one(training: Training, path: Path, command: str | None) -> None:
    """Run one training, or continue it if its worker died before."""
    from .train import train  # imports torch, which only a training needs

    train(training, path, resume=RunFolder(path).settings.is_file(), progress=False, command=command)
