"""Results of runs that are kept on disk: each under a hash of what it was made of, with a check of itself."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from ..backend import cache_folder, source_hash
from ..base.errors import InputError
from ..base.files import write_whole


def kept_file(folder: str, inputs: Any) -> Path | None:
    """Where the result of these inputs, plain data, under these sources is kept.

    None where nothing can be kept.
    """
    cache, text = cache_folder(), json.dumps([source_hash(), inputs], sort_keys=True)
    return cache and cache / folder / f"{hashlib.sha256(text.encode()).hexdigest()}.json"


def keep(file: Path | None, name: str, value: Any) -> None:
    """Keep a value, plain data, under a name, where something can be kept."""
    if file is None:
        return
    try:
        file.parent.mkdir(exist_ok=True)
        with write_whole(file) as temporary:
            temporary.write_text(json.dumps({name: value, "check": _check(file, value)}))
    except (InputError, OSError):
        pass  # no room: the next process works it out again


def read_kept(file: Path | None, name: str) -> Any:
    """What was kept; None where there is nothing or it is damaged."""
    if file is None:
        return None
    try:
        kept: dict[str, Any] = json.loads(file.read_text())
        return kept[name] if kept["check"] == _check(file, kept[name]) else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _check(file: Path, value: Any) -> str:
    return hashlib.sha256(f"{file.stem} {value!r}".encode()).hexdigest()
