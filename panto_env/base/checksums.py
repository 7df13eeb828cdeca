"""The one checksum of files that we write: SHA-256 of what a file says, so that a damaged one is refused.

It covers plain data and arrays, not how a container lays them out: a result in JSON, a saved run in Parquet
and a model in safetensors all carry it in their table of plain data, under the key ``sha256``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from .errors import InputError
from .files import write_whole

CHECKSUM = "sha256"
"""Key of the checksum, beside those of the table."""
NO_ARRAYS: Mapping[str, NDArray[Any]] = {}


def checksum(table: Any, arrays: Mapping[str, NDArray[Any]] = NO_ARRAYS) -> str:
    """SHA-256 of plain data in one certain form of JSON, and of arrays by name, type, shape and values."""
    digest = hashlib.sha256(json.dumps(table, sort_keys=True, separators=(",", ":")).encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def with_checksum(table: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] = NO_ARRAYS) -> dict[str, Any]:
    """A table of plain data, fit for JSON, with its checksum and that of the arrays beside it."""
    return {CHECKSUM: checksum(table, arrays), **table}


def without_checksum(table: Any, arrays: Mapping[str, NDArray[Any]] = NO_ARRAYS) -> dict[str, Any]:
    """What ``with_checksum`` was given. Raises ValueError where the checksum is missing or does not fit."""
    if isinstance(table, dict):
        rest = {key: value for key, value in table.items() if key != CHECKSUM}
        if table.get(CHECKSUM) == checksum(rest, arrays):
            return rest
    raise ValueError("it is damaged or was changed, or is of something else: no checksum fits what it says")


def write_checked(path: str | Path, table: Mapping[str, Any]) -> None:
    """Write a table of plain data as JSON with its checksum. Raises InputError where it can't be written."""
    with write_whole(path) as temporary:
        temporary.write_text(json.dumps(with_checksum(table), indent=1) + "\n", encoding="utf-8")


def read_checked(path: str | Path) -> dict[str, Any]:
    """The table that ``write_checked`` wrote. Raises InputError where it can't be read or is damaged."""
    try:
        return without_checksum(json.loads(Path(path).read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        raise InputError(f"{path} could not be read: there is no such file; check the path.") from error
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise InputError(
            f"{path} is not JSON, or is damaged; give what the program wrote, or make it anew."
        ) from error
    except ValueError as error:
        raise InputError(f"{path} could not be read: {error}; make it anew.") from error


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
