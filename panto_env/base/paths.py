"""Names that no file can have: refused before the system is asked, which has an error of its own for each."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import InputError
from .shown import shown

LONGEST_NAME = 200
"""Bytes of a file's or folder's name; systems bear 255, and a temporary file beside it has a longer one."""
LONGEST_PATH = 3000
"""Bytes of a whole path; Linux bears 4096."""


def check_path(path: str | Path) -> None:
    """Raise InputError for a path that no file or folder can have."""
    text = os.fspath(path)
    if "\0" in text:
        raise InputError(f"{shown(text)} can be no file: its name has a null byte in it.")
    try:
        sizes = [len(part.encode()) for part in Path(text).parts]
    except UnicodeEncodeError as error:
        raise InputError(f"{shown(text)} can be no file: its name is not text in UTF-8.") from error
    if max(sizes, default=0) > LONGEST_NAME or sum(sizes) > LONGEST_PATH:
        raise InputError(
            f"{text[:40]}... can be no file: a name has {LONGEST_NAME} bytes at most, a path {LONGEST_PATH}."
        )
