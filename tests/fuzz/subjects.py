"""The files that are damaged: each kind that the project reads, whole ones, and how each is read."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from panto_agents.ablation import load_ablation
from panto_agents.model_file import read_model
from panto_agents.settings import load_training
from panto_agents.stored import FOLDER as MODELS
from panto_agents.trainings import RunFolder
from panto_baselines.benchmark import actions
from panto_baselines.benchmark.actions import Played
from panto_baselines.benchmark.run import read_result
from panto_baselines.benchmark.settings import load_benchmark
from panto_baselines.dataset.designs import load_designs
from panto_baselines.dataset.episodes import Episode, read_episodes
from panto_baselines.dataset.settings import load_episodes
from panto_baselines.oracle import stored
from panto_baselines.policies.lanes_law import load_gains
from panto_env import Trajectory, simulate
from panto_env.base.checksums import read_checked, write_arrays
from panto_env.base.files import read_text
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.catalog.loader import load_family, load_section, text_of
from panto_env.catalog.masts import line_from_masts
from panto_env.estimation.motion import read_motion
from panto_env.identification.record import read_record
from panto_env.rig.computer import load_rig
from panto_env.studies import Comparison, Outcome
from panto_env.studies import write as write_study
from panto_env.studies.throughput import study as speed

from .files import write_files

ROOT = Path(__file__).parents[2]


class Subject(NamedTuple):
    """A whole file and how it is read; checked: it has a checksum, so that no change goes unnoticed."""

    kind: str
    file: Path
    read: Callable[[Path], Any]
    checked: bool = False


def subjects(folder: Path) -> dict[str, Subject]:
    """All of them by name; those that have to be made are written into the folder."""
    write_files(folder)
    run = RunFolder(folder / "run")
    run.path.mkdir()
    run.write_settings(load_training(folder / "training.toml"))
    run.evaluations.write_text(
        "steps,speed_kmh,seed,policy_sigma\n" + "".join(f"{128 * k},300,1,{20.5 - k}\n" for k in range(1, 9))
    )
    found = {}
    for kind, names, load in (
        ("line", available("catenary"), _line),
        ("pantograph", ("three-mass", "own-two-mass"), _pantograph),
        ("family", available("family"), load_family),
        ("section", available("section"), load_section),
    ):
        for name in names:
            path = folder / f"{name}.toml"
            path.write_text(text_of(name), encoding="utf-8")
            found[f"{kind} {name}"] = Subject("TOML", path, load)
    configs = ROOT / "configs"
    found |= {
        "training": Subject("TOML", configs / "agent-high-speed.toml", load_training),
        "ablation": Subject("TOML", configs / "ablation.toml", load_ablation),
        "track": Subject("TOML", configs / "benchmark" / "as-built.toml", load_benchmark),
        "episodes": Subject("TOML", configs / "dataset-known-line.toml", load_episodes),
        "designs": Subject("TOML", configs / "dataset-designs.toml", load_designs),
        "gains": Subject("TOML", next((configs / "policies").glob("*.toml")), load_gains),
        "record": Subject("CSV", folder / "rig.csv", read_record),
        "masts": Subject("CSV", ROOT / "examples" / "masts.csv", lambda path: line_from_masts("re250", path)),
        "motion": Subject("CSV", folder / "motion.csv", lambda path: read_motion(path, 120.0)),
        "evaluations": Subject("CSV", run.evaluations, _evaluations),
        "saved run": Subject("Parquet", folder / "run.parquet", Trajectory.load, checked=True),
        "benchmark": Subject("JSON", _benchmark(folder), read_result, checked=True),
        "actions": _actions(folder),
        "oracles": Subject("JSON", stored.RESULTS / "known-lines.json", stored.read, checked=True),
        "speed": Subject("JSON", next((ROOT / "docs" / "speed").glob("*.json")), speed.read, checked=True),
        "settings of a training": Subject("JSON", run.settings, _settings, checked=True),
        "study": Subject("JSON", _study(folder), read_checked, checked=True),
        "part of a data set": _part(folder),
    }
    for path in MODELS.glob("*.safetensors"):
        found[f"model {path.stem}"] = Subject("model", path, read_model, checked=True)
    return found


def _line(path: Path) -> Any:
    """A line, and its first meters under a pantograph that fits it."""
    line = load_catenary(path)
    if line.kind == "rig":
        return line, load_rig(line)
    pantograph = "three-mass" if line.kind == "periodic-stiffness" else "own-two-mass"
    return line, _pass(line, pantograph, 40.0)


def _pantograph(path: Path) -> Any:
    """A pantograph, and its first meters along a line in no time."""
    pantograph = load_pantograph(path)
    return pantograph, _pass("periodic-stiffness", pantograph, 40.0)


def _pass(line: Any, pantograph: Any, distance: float) -> Trajectory:
    with warnings.catch_warnings(action="ignore"):
        return simulate(line, pantograph, 200.0, distance=distance, accuracy="fast")


def _benchmark(folder: Path) -> Path:
    path = folder / "head.json"
    path.write_text(read_text(ROOT / "docs" / "benchmark" / "head.json.gz"), encoding="utf-8")
    return path


def _study(folder: Path) -> Path:
    compared = Comparison("mass", "kg", 1.25, 1.2, 1.0, 1.5)
    (path,) = write_study(Outcome("a study", (compared,), numbers={"σ": [1 / 3, None]}), folder)
    return path


def _part(folder: Path) -> Subject:
    settings = load_episodes(ROOT / "configs" / "dataset-known-line.toml")
    plans = list(islice(settings.plans(settings.sets[0]), 2))
    arrays = {
        f"{plan.number}|{name}|{'std' if name in ('infos', 'figures') else ''}": np.array(float(plan.number))
        for plan in plans
        for name in Episode._fields
    }
    path = folder / "part.safetensors"
    write_arrays(path, {}, arrays)
    return Subject("model", path, lambda path: read_episodes(path, plans), checked=True)


def _actions(folder: Path) -> Subject:
    passes = [Played(np.linspace(-1, 1, steps)[:, None], 0.0) for steps in (5, 8)]
    path = folder / "out.actions.safetensors"
    actions.save(passes, path)
    return Subject("model", path, lambda path: actions.read(path, actions.digest(passes)), checked=True)


def _evaluations(path: Path) -> Any:
    run = RunFolder(path.parent)
    run.evaluations = path
    return run._rows()


def _settings(path: Path) -> Any:
    run = RunFolder(path.parent)
    run.settings = path
    return run.read_settings()
