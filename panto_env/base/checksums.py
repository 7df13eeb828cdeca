"""The checksum of all our files: SHA-256 of a file's content, so that a damaged file is refused.

It covers plain data and arrays, not their layout in a container: a result in JSON, a saved run in Parquet
and a model in safetensors all have it in their table of plain data, under the key ``sha256``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from .errors import InputError
from .files import check_nesting, check_regular, write_whole

CHECKSUM = "sha256"
"""Key of the checksum in the table."""
NO_ARRAYS: Mapping[str, NDArray[Any]] = {}


def checksum(table: Any, arrays: Mapping[str, NDArray[Any]] = NO_ARRAYS) -> str:
    """SHA-256 of plain data in a fixed form of JSON, and of arrays by name, type, shape and values."""
    digest = hashlib.sha256(json.dumps(table, sort_keys=True, separators=(",", ":")).encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def with_checksum(table: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] = NO_ARRAYS) -> dict[str, Any]:
    """A table of plain data, fit for JSON, with a checksum of the table and the arrays."""
    return {CHECKSUM: checksum(table, arrays), **table}


def without_checksum(table: Any, arrays: Mapping[str, NDArray[Any]] = NO_ARRAYS) -> dict[str, Any]:
    """The table without its checksum. Raises ValueError where the checksum is missing or does not fit."""
    if isinstance(table, dict):
        try:
            check_nesting(table)
        except RecursionError as error:
            raise ValueError("it is nested too deeply") from error
        rest = {key: value for key, value in table.items() if key != CHECKSUM}
        if table.get(CHECKSUM) == checksum(rest, arrays):
            return rest
    raise ValueError("it is damaged or was changed, or is another file: its checksum does not fit")


def write_checked(path: str | Path, table: Mapping[str, Any]) -> None:
    """Write a table of plain data as JSON with its checksum. Raises InputError if it cannot be written."""
    with write_whole(path) as temporary:
        temporary.write_text(json.dumps(with_checksum(table), indent=1) + "\n", encoding="utf-8")


def read_checked(path: str | Path) -> dict[str, Any]:
    """The table of a file of ``write_checked``. Raises InputError where it cannot be read or is damaged."""
    check_regular(path)
    try:
        return without_checksum(json.loads(Path(path).read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        raise InputError(f"{path} could not be read: there is no such file; check the path.") from error
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise InputError(
            f"{path} is not JSON, or is damaged; give a file that the program wrote, or make it again."
        ) from error
    except ValueError as error:
        raise InputError(f"{path} could not be read: {error}; make it again.") from error


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
