"""Results as JSON with a checksum of what they say: a damaged file is refused, not believed."""

from __future__ import annotations

import hashlib
import json
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import InputError, UncheckedWarning
from .files import write_whole

CHECKSUM = "sha256"
"""Key of the checksum, beside those of the result."""
NOT_AS_WRITTEN = "what it says does not fit its checksum"
_DIGITS = re.compile("[0-9a-f]{64}")


def with_checksum(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table of plain data, fit for JSON, with its checksum before everything else.

    The checksum is of the values, not of spaces and line breaks between them.
    """
    return {CHECKSUM: _checksum(table), **table}


def write_checked(path: str | Path, table: Mapping[str, Any]) -> None:
    """Write a table of plain data as JSON with its checksum. Raises InputError where it can't be written."""
    with write_whole(path) as temporary:
        temporary.write_text(json.dumps(with_checksum(table), indent=1) + "\n", encoding="utf-8")


def read_checked(path: str | Path) -> Any:
    """What a JSON file holds, without its checksum, which must fit; UncheckedWarning where there is none.

    Raises InputError where the file can't be read, is not JSON, or is damaged.
    """
    try:
        table = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path} could not be read: there is no such file; check the path.") from error
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except (ValueError, RecursionError) as error:  # no UTF-8, no JSON, or nested without end
        raise InputError(
            f"{path} is not JSON, or is damaged; give what the program wrote, or make it anew."
        ) from error
    if not isinstance(table, dict):
        return table
    # One under another name is one, too, of a file that was damaged just there.
    named_otherwise = any(isinstance(value, str) and _DIGITS.fullmatch(value) for value in table.values())
    if CHECKSUM not in table and not named_otherwise:
        warn_unchecked(path)
        return table
    if table.pop(CHECKSUM, None) != _checksum(table):
        raise InputError(f"{path} is damaged or was changed: {NOT_AS_WRITTEN}; make it anew.")
    return table


def warn_unchecked(path: str | Path) -> None:
    """Say that a file has no checksum: one of before there were any."""
    warnings.warn(
        f"{path} has no checksum, as files of older versions; it cannot be checked for damage.",
        UncheckedWarning,
        stacklevel=3,
    )


def _checksum(table: Mapping[str, Any]) -> str:
    """SHA-256 of a table in one certain form of JSON."""
    text = json.dumps(table, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
