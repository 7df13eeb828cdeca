"""Checksums for files of older versions: ``python -m panto_agents.add_checksums FILE...``.

What results in JSON, model files (.zip) and saved runs (.parquet) say is as before. Whether they
are as they were written is for their owner to know: from then on they are checked.
"""

from __future__ import annotations

import json
import shutil
import sys
import warnings
import zipfile
from collections.abc import Sequence
from pathlib import Path

from panto_env.base.checked_json import CHECKSUM, read_checked, with_checksum
from panto_env.base.errors import InputError, UncheckedWarning
from panto_env.base.files import write_whole
from panto_env.metrics.trajectory import Trajectory

from .model_file import read_model
from .model_parts import CHECKSUMS, write_checksums


def add_checksum(path: Path) -> None:
    """Add checksums to a file without; one that has them is left. Raises InputError for any other file."""
    kinds = {".json": _to_json, ".zip": _to_model, ".parquet": _to_run}
    if path.suffix not in kinds:
        raise InputError(f"{path} must end in one of {', '.join(kinds)}.")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UncheckedWarning)
        kinds[path.suffix](path)


def _to_json(path: Path) -> None:
    table, text = read_checked(path), path.read_text(encoding="utf-8")
    if not isinstance(table, dict) or not text.startswith("{"):
        raise InputError(f"{path} holds no table of results.")
    if CHECKSUM in json.loads(text):
        return
    rest = text[1:]
    space = rest[: len(rest) - len(rest.lstrip())]
    with write_whole(path) as temporary:
        colon = ": " if space else ":"  # as the rest of the file
        entry = f'"{CHECKSUM}"{colon}"{with_checksum(table)[CHECKSUM]}"'
        temporary.write_text(f"{{{space}{entry},{rest}", encoding="utf-8", newline="")


def _to_model(path: Path) -> None:
    read_model(path)
    with write_whole(path) as temporary:
        shutil.copyfile(path, temporary)
        with zipfile.ZipFile(temporary, "a") as archive:
            if CHECKSUMS not in archive.namelist():
                write_checksums(archive)


def _to_run(path: Path) -> None:
    Trajectory.load(path).save(path)


def main(files: Sequence[str]) -> None:
    """Add checksums to files."""
    for file in files:
        add_checksum(Path(file))


if __name__ == "__main__":
    main(sys.argv[1:])
