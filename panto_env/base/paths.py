"""Names that no file can have: refused with a clear message before the system fails in its own ways."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import InputError
from .shown import shown

LONGEST_NAME = 200
"""Maximum bytes of a file's or folder's name; systems allow 255, but a temporary file's name is longer."""
LONGEST_PATH = 3000
"""Maximum bytes of a whole path; Linux allows 4096."""


def check_path(path: str | Path) -> None:
    """Raise InputError for a path that no file or folder can have."""
    text = os.fspath(path)
    if "\0" in text:
        raise InputError(f"{shown(text)} cannot be a file: its name contains a null byte.")
    try:
        sizes = [len(part.encode()) for part in Path(text).parts]
    except UnicodeEncodeError as error:
        raise InputError(f"{shown(text)} cannot be a file: its name is not text in UTF-8.") from error
    if max(sizes, default=0) > LONGEST_NAME or sum(sizes) > LONGEST_PATH:
        raise InputError(
            f"{text[:40]}... cannot be a file: the maximum is {LONGEST_NAME} bytes for a name, "
            f"{LONGEST_PATH} for a path."
        )
