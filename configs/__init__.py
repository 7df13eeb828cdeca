"""The project's trainings, benchmarks, data sets and more as TOML; commands find them by name."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from panto_env.base.errors import InputError, suggest
from panto_env.base.files import read_toml

FOLDER = Path(__file__).parent
Kind = Literal["training", "benchmark", "oracle", "ablation", "dataset", "designs"]
KINDS: dict[Kind, str] = {
    "training": "algorithm",
    "benchmark": "lines",
    "oracle": "cells",
    "ablation": "judged_by",
    "dataset": "sets",
    "designs": "ranges",
}
"""A key that every file of a kind has."""


def names(kind: Kind) -> list[str]:
    """Names of the files of a kind that come with the project."""
    found = (path for path in FOLDER.rglob("*.toml") if KINDS[kind] in read_toml(path))
    return sorted(path.relative_to(FOLDER).with_suffix("").as_posix() for path in found)


def find(source: str | Path, kind: Kind) -> Path:
    """The file of a path, or of a name here: "ppo" is ppo.toml, "benchmark/known-line" one in a folder.

    Raises InputError where there is none.
    """
    path = Path(source)
    if os.path.isfile(path):
        return path
    if str(source) in names(kind):
        return FOLDER / f"{source}.toml"
    raise InputError(
        f"The {kind} file {source} does not exist; give a TOML file's path, or a name: "
        f"{suggest(path.stem, names(kind))}."
    )
