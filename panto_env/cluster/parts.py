"""Work in parts, each a file that is written whole: after an interruption it continues with missing parts."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from ..analysis.pool import Progress
from ..backend.cache import source_hash
from ..base.checksums import __version__, commit, read_checked, write_checked
from ..base.errors import InputError
from ..base.files import make_folder
from .spread import spread

Job = Callable[[Path], None]
"""Work that writes its result to a path, whole or not at all: for other processes a ``functools.partial``."""
PARTS = ".parts"
"""Folder in the output for the parts of each data set; hidden, so that Minari does not read it."""
IDENTITY = "identity.json"


def identity(kind: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that determines the results of a work, as plain data."""
    made_by = {"version": __version__, "commit": commit(), "sources": source_hash()}
    return {"kind": kind, **made_by, "settings": json.loads(json.dumps(settings))}


def open_parts(folder: Path, made_of: Mapping[str, Any]) -> None:
    """Make the folder of a work's parts, or continue it; made_of: from ``identity``.

    Raises InputError where it holds parts of another work.
    """
    make_folder(folder)
    path = folder / IDENTITY
    if not path.is_file():
        write_checked(path, made_of)
        return
    difference = first_difference(read_checked(path), made_of)
    if difference:
        raise InputError(
            f"{folder} holds parts of another work ({difference}); finish that one, remove the folder, or "
            "use another --output."
        )


def make_parts(
    jobs: Mapping[Path, Job],
    read: Callable[[Path], object],
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Make all files, each by its job; existing files that are whole are kept.

    read: reads a file, and raises InputError where it is missing or damaged; such a file is made again.
    workers, ray: as in ``spread``. progress: called with the numbers of existing and of all files.
    """
    missing = {path: job for path, job in jobs.items() if not _whole(path, read)}
    kept = len(jobs) - len(missing)
    if progress is not None:
        progress(kept, len(jobs))
    if missing:
        spread(
            [partial(job, path) for path, job in missing.items()],
            workers=workers,
            ray=ray,
            progress=None if progress is None else lambda done, _: progress(kept + done, len(jobs)),
        )


def remove_parts(folder: Path) -> None:
    """Remove a folder of parts that are no longer needed."""
    shutil.rmtree(folder, ignore_errors=True)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder if it is empty."""
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def first_difference(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """The first difference of two identities, as a clause; "" for none."""
    before, now = ({**each, **each.get("settings", {})} for each in (old, new))
    for key in sorted(before.keys() | now.keys()):
        if key != "settings" and before.get(key) != now.get(key):
            return f"its {key} is {_short(before.get(key))}, this is {_short(now.get(key))}"
    return ""


def _whole(path: Path, read: Callable[[Path], object]) -> bool:
    """Whether a part exists and is not damaged."""
    try:
        read(path)
        return True
    except InputError:
        return False


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
