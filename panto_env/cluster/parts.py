"""Work in parts, each a file that is written whole: whatever ends it, it goes on with what is missing."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from ..analysis.pool import Progress
from ..backend.cache import source_hash
from ..base.checksums import read_checked, write_checked
from ..base.errors import InputError
from ..base.files import make_folder
from ..base.version import __version__, commit
from .spread import spread

Job = Callable[[Path], None]
"""Work that writes its result to a path, whole or not at all; a ``functools.partial``, to go elsewhere."""
PARTS = ".parts"
"""Folder in the output with one for each data set's parts; hidden, so that Minari does not look into it."""
IDENTITY = "identity.json"


def identity(kind: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What a work is made of, plain data: results of the same are the same."""
    made_by = {"version": __version__, "commit": commit(), "sources": source_hash()}
    return {"kind": kind, **made_by, "settings": json.loads(json.dumps(settings))}


def open_parts(folder: Path, made_of: Mapping[str, Any]) -> None:
    """Make the folder of a work's parts, or go on with it; made_of: what ``identity`` gives.

    Raises InputError where it holds parts of something else.
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
            "take another --output."
        )


def make_parts(
    jobs: Mapping[Path, Job],
    read: Callable[[Path], object],
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Make all files, each by its job; those that are there and whole are kept.

    read: reads a file, and raises InputError where it is missing or damaged; such a file is made again.
    workers, ray: as ``spread`` takes them. progress: called with the files there, and of all.
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
    """Remove what is needed no more."""
    shutil.rmtree(folder, ignore_errors=True)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder in which nothing is left."""
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def first_difference(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """The first thing in which two identities differ, as a clause; "" where there is none."""
    before, now = ({**each, **each.get("settings", {})} for each in (old, new))
    for key in sorted(before.keys() | now.keys()):
        if key != "settings" and before.get(key) != now.get(key):
            return f"its {key} is {_short(before.get(key))}, this is {_short(now.get(key))}"
    return ""


def _whole(path: Path, read: Callable[[Path], object]) -> bool:
    """Whether a part is there as it was written."""
    try:
        read(path)
        return True
    except InputError:
        return False


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
