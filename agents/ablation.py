"""Ablation: the effect of each part of an agent, from trainings without it, under several seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from panto_baselines.benchmark.run import Benchmark
from panto_baselines.benchmark.run import run as run_benchmark
from panto_baselines.benchmark.settings import BenchmarkSettings, load_benchmark
from panto_baselines.benchmark.statistics import Clusters, Interval, interquartile_mean, interval_of_mean
from panto_configs import find
from panto_env.analysis.pool import Progress
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.base.files import read_toml
from panto_env.base.settings import Settings, parse
from panto_env.base.table import Table

from .algorithm import Count
from .settings import Seed, Training, parse_training
from .trainings import RunFolder, train_all

REFERENCE = "as it is"
"""Name of the variant without any change."""


class Ablation(Settings):
    """A training and its variants."""

    training: str = Field(description="name or path of the training that is varied")
    total_steps: Count = Field(description="environment steps of each run")
    seeds: tuple[Seed, ...] = Field(min_length=2, description="seeds of the runs of each variant")
    judged_by: str = Field(description="name or path of the benchmark that compares the runs' best models")
    judged_on: Count = Field(description="number of the benchmark's seeds")
    variants: dict[str, dict[str, Any]] = Field(
        min_length=1,
        description="by name: settings of the training to change, in the same tables; the value "
        '"default" removes a setting',
    )

    def trainings(self) -> dict[tuple[str, int], Training]:
        """Trainings by variant and seed. Raises InputError, naming the variant, if one is not valid."""
        base = read_toml(find(self.training, "training"))
        changes: dict[str, dict[str, Any]] = {REFERENCE: {}} | self.variants
        made: dict[tuple[str, int], Training] = {}
        for name, changed in changes.items():
            table = _changed(base, changed) | {"total_steps": self.total_steps, "seed": self.seeds[0]}
            training = parse_training(table, f"The variant '{name}'")
            made |= {(name, seed): training.model_copy(update={"seed": seed}) for seed in self.seeds}
        return made

    def benchmark(self, models: Mapping[tuple[str, int], Path]) -> BenchmarkSettings:
        """Settings of the benchmark of the models."""
        settings = load_benchmark(self.judged_by).model_dump()
        settings |= {"policies": [str(path) for path in models.values()], "seeds": self.judged_on}
        return parse(BenchmarkSettings, settings, self.judged_by)


def load_ablation(source: str | Path) -> Ablation:
    """Read an ablation from a TOML file, given by its path or by a name of ``configs/``.

    Raises InputError, naming the file and the key, if it cannot be read or is not valid.
    """
    ablation = parse(Ablation, read_toml(find(source, "ablation")), str(source))
    if REFERENCE in ablation.variants:
        raise InputError(f"{source}: '{REFERENCE}' is the training itself; give the variant another name.")
    ablation.trainings()
    return ablation


def run(
    ablation: Ablation,
    output: Path,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
    command: str | None = None,
) -> tuple[dict[tuple[str, int], Path], Benchmark]:
    """Train every variant under every seed, each into its own folder, and compare the best models.

    Runs that are complete in ``output`` are not repeated, and an interrupted one continues: call it again to
    finish. workers, ray, command: see ``train_all``. Returns each run's best model, and the benchmark of all.
    """
    trainings = ablation.trainings()
    folders = {(name, seed): output / name.replace(" ", "-") / f"seed{seed}" for name, seed in trainings}
    runs = {folders[key]: training for key, training in trainings.items()}
    train_all(runs, resume=True, workers=workers, ray=ray, progress=progress, command=command)
    models = {key: RunFolder(folder).best for key, folder in folders.items()}
    return models, run_benchmark(ablation.benchmark(models), workers, ray=ray)


def _changed(table: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of a table with changes, which apply to nested tables too."""
    made = dict(table)
    for key, value in changes.items():
        if value == "default":
            made.pop(key, None)
        elif isinstance(value, Mapping):
            before = table.get(key)
            made[key] = _changed(before if isinstance(before, Mapping) else {}, value)
        else:
            made[key] = value
    return made


@dataclass(frozen=True)
class Variant:
    """One variant over its runs, each a training under another seed."""

    name: str
    changes: tuple[float, ...]  # of sigma from the passive pantograph at the same mean force, by run (%)
    change: float  # interquartile mean of the changes (%)
    interval: Interval | None  # 95 % interval of ``change``, for what runs draw
    lost: Interval | None  # 95 % interval of the gain lost against the unchanged training (points)
    worse: float | None  # share of pairs of runs in which the unchanged training gains more; None: it is that
    qualified: float  # share of runs whose mean force stays within its range in every cell


def variants(models: Mapping[tuple[str, int], Path], outcome: Benchmark) -> tuple[Variant, ...]:
    """Variants, the unchanged training first."""
    cells: dict[str, list[Any]] = {}  # by the path of a model
    for cell in outcome.cells:
        cells.setdefault(cell.policy, []).append(cell)
    runs: dict[str, list[list[Any]]] = {}  # cells of each run, by the variant's name
    for (name, _), path in models.items():
        runs.setdefault(name, []).append(cells[str(path)])
    found, base = [], None
    for name, own in runs.items():
        changes = np.array([np.mean([cell.change for cell in run]) for run in own])
        base = changes if base is None else base
        found.append(
            Variant(
                name=name,
                changes=tuple(changes.tolist()),
                change=interquartile_mean(changes),
                interval=interval_of_mean(changes, Clusters.of_one_line(len(changes))),
                lost=None if changes is base else _difference(changes, base),
                worse=None if changes is base else float(np.mean(changes[:, None] > base)),
                qualified=1.0 - float(np.mean([any(cell.disqualified for cell in run) for run in own])),
            )
        )
    return tuple(found)


def _difference(changes: Array, base: Array) -> Interval:
    """95 % bootstrap interval of the difference of two means, with the runs of each resampled."""
    from scipy.stats import bootstrap

    given: Any = {"vectorized": True, "method": "percentile", "rng": np.random.default_rng(0)}
    found = bootstrap((changes, base), lambda a, b, axis: a.mean(axis=axis) - b.mean(axis=axis), **given)
    low, high = found.confidence_interval
    return float(low), float(high)


def table(found: Sequence[Variant], title: str) -> Table:
    """The variants as a table."""

    def between(interval: Interval | None) -> str:
        return "–" if interval is None else f"{interval[0]:.1f} to {interval[1]:.1f}"

    headings = ("variant", "runs", "Δσ (%)", "95 %", "loses", "worse in", "mean held")
    rows = [
        (
            each.name,
            str(len(each.changes)),
            f"{each.change:.1f}",
            between(each.interval),
            between(each.lost),
            "–" if each.worse is None else f"{100 * each.worse:.0f} %",
            f"{100 * each.qualified:.0f} %",
        )
        for each in found
    ]
    return Table(title, headings, rows)
