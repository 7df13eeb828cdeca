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
from ..base.errors import InputError
from ..base.files import make_folder, sha256_of, write_whole
from ..base.version import __version__, commit
from .spread import spread

Job = Callable[[Path], None]
"""Work that writes its result to a path; ``functools.partial`` of a function of a module."""
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
        with write_whole(path) as temporary:
            temporary.write_text(json.dumps(made_of, indent=1) + "\n", encoding="utf-8")
        return
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        difference = first_difference(before, made_of)
    except (OSError, ValueError, AttributeError, TypeError, RecursionError) as error:
        raise InputError(
            f"{path} is damaged, so it does not say what the parts beside it are of; remove the folder, or "
            "take another --output."
        ) from error
    if difference:
        raise InputError(
            f"{folder} holds parts of another work ({difference}); finish that one, remove the folder, or "
            "take another --output."
        )


def make_parts(
    jobs: Mapping[Path, Job],
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Make all files, each by its job; those that are there and fit their checksum are kept.

    workers, ray: as ``spread`` takes them. progress: called with the files there, and of all.
    """
    missing = {path: job for path, job in jobs.items() if not _whole(path)}
    kept = len(jobs) - len(missing)
    if progress is not None:
        progress(kept, len(jobs))
    if missing:
        spread(
            [partial(_write, job, path) for path, job in missing.items()],
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


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _write(job: Job, path: Path) -> None:
    with write_whole(path) as temporary:
        job(temporary)
    with write_whole(_checksum_file(path)) as temporary:
        temporary.write_text(sha256_of(path), encoding="utf-8")


def _whole(path: Path) -> bool:
    """Whether a part is there as it was written."""
    try:
        return _checksum_file(path).read_text(encoding="utf-8") == sha256_of(path)
    except (OSError, UnicodeDecodeError):
        return False


def _checksum_file(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")
