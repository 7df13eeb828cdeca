"""The folder of a training run: its files, and the checks before a run is resumed."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from panto_env.base.checksums import read_checked, write_checked
from panto_env.base.errors import InputError, shown
from panto_env.base.files import alone_in, make_folder, write_whole

from .evaluation import Pair
from .model_file import read_model
from .settings import Training, parse_training

CHECKPOINTS_KEPT = 3
"""Number of checkpoints kept; older ones are removed, because a checkpoint of SAC holds the replay buffer."""
EXTENDABLE = "total_steps"
"""The only setting that a resumed run may change; it may only be raised."""


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

    def check_new(self) -> None:
        """Raise InputError if the folder holds anything already."""
        if os.path.exists(self.path) and (not self.path.is_dir() or any(map(_counts, self.path.iterdir()))):
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
            if key != EXTENDABLE and new.get(key) != old.get(key)
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

    def alone(self) -> AbstractContextManager[None]:
        """Context in which no other process trains into the folder; see ``alone_in``."""
        return alone_in(self.path, "trains into")

    def read_settings(self) -> Training:
        """Read the settings of the run. Raises InputError if the file is damaged."""
        return parse_training(read_checked(self.settings), str(self.settings))

    def write_settings(self, training: Training) -> None:
        """Write the settings of a new run."""
        # Before anything else, so that a killed run leaves either nothing or a folder that can be resumed.
        write_checked(self.settings, training.model_dump(mode="json"))
        make_folder(self.checkpoints)

    def note_cloning(self, policy: str, error: Any) -> None:
        """Write the error between the agent and the policy that it starts from (``CloningError``)."""
        write_checked(self.cloning, {"policy": policy} | error.model_dump(mode="json"))

    def checkpoint(self, steps: int) -> Path:
        """Path of the checkpoint at ``steps``."""
        return self.checkpoints / f"step-{steps:09d}.safetensors"

    def newest_checkpoint(self) -> Path | None:
        """Newest checkpoint that is not damaged, if there is one."""
        for path in sorted(self.checkpoints.glob("step-*.safetensors"), reverse=True):
            try:
                read_model(path)
            except InputError:
                continue
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
            row = {
                "steps": steps,
                "speed_kmh": pair.speed_kmh,
                "seed": pair.seed,
                "qualified": pair.qualified,
            }
            row |= {f"policy_{key}": value for key, value in pair.policy.as_dict().items()}
            row |= {f"passive_{key}": value for key, value in pair.passive.as_dict().items()}
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


def _counts(path: Path) -> bool:
    """Whether a path is neither a lock nor a file that a killed process left half-written."""
    return not path.name.startswith(".")


def _dotted(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values of nested tables under dotted keys, such as "hyperparameters.gamma"."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            values |= _dotted(value, f"{prefix}{key}.")
        else:
            values[prefix + key] = value
    return values
