"""Version and commit, checksums of results, and results that are cached.

A checksum covers plain data and arrays, not their layout in a container: a result in JSON, a saved run in
Parquet and a model in safetensors all have it in their table of plain data, under the key ``sha256``.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import subprocess
from collections.abc import Callable, Mapping
from functools import cache, lru_cache, wraps
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from .errors import InputError
from .files import JSON, read_text, suffix_of, write_whole

__version__ = "0.2.0"


@cache
def commit() -> str | None:
    """Short hash of the checkout's commit, with "-dirty" where files differ; None outside a checkout."""
    folder = Path(__file__).resolve().parents[2]
    if not (folder / ".git").exists():
        return None
    try:
        described = subprocess.run(
            ["git", "-C", str(folder), "describe", "--always", "--dirty", "--exclude=*"],
            capture_output=True,
            text=True,
            check=True,
            timeout=10,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return described.stdout.strip() or None


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
        rest = {key: value for key, value in table.items() if key != CHECKSUM}
        if table.get(CHECKSUM) == checksum(rest, arrays):
            return rest
    raise ValueError("it is damaged or was changed, or is another file: its checksum does not fit")


def write_checked(path: str | Path, table: Mapping[str, Any]) -> None:
    """Write a table of plain data as JSON with its checksum, compressed if the file is named ".json.gz".

    Raises InputError if it cannot be written.
    """
    content = (json.dumps(with_checksum(table), indent=1) + "\n").encode()
    with write_whole(path) as temporary:
        temporary.write_bytes(gzip.compress(content, mtime=0) if suffix_of(path) == JSON[1] else content)


def read_checked(path: str | Path) -> dict[str, Any]:
    """The table of a file of ``write_checked``. Raises InputError where it cannot be read or is damaged."""
    text = read_text(path)
    try:
        return without_checksum(json.loads(text))
    except (json.JSONDecodeError, RecursionError) as error:
        raise InputError(
            f"{path} is not JSON, or is damaged; give a file that the program wrote, or make it again."
        ) from error
    except ValueError as error:
        raise InputError(f"{path} could not be read: {error}; make it again.") from error


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


F = TypeVar("F", bound=Callable[..., Any])
KEPT = 16
"""Number of results that are kept per function."""


class _Hashed(tuple[Any, ...]):
    """Arguments whose hash is computed only once: that of a line takes longer than to look a result up."""

    def __init__(self, _: tuple[Any, ...]) -> None:
        self._hash = super().__hash__()

    def __hash__(self) -> int:
        return self._hash


def remembered(function: F, most: int = KEPT) -> F:
    """Cache a function's results, which must not be changed, for calls with equal arguments.

    A call with arguments that have no hash, such as data with a list, is not cached. most: number of results
    that are kept.
    """
    kept = lru_cache(maxsize=most)(lambda arguments: function(*arguments))

    @wraps(function)
    def look_up(*arguments: Any) -> Any:
        try:
            key = _Hashed(arguments)
        except TypeError:
            return function(*arguments)
        return kept(key)

    return look_up  # type: ignore[return-value]


KEY = "panto_env"
"""Key of the file's metadata that holds the table as JSON."""


def write_arrays(path: str | Path, table: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays by name and a table fit for JSON, whole or not at all, with a checksum of both.

    Raises InputError where it cannot be written.
    """
    content = save(dict(arrays), {KEY: json.dumps(with_checksum(table, arrays))})
    with write_whole(path) as temporary:
        temporary.write_bytes(content)


def read_arrays(path: str | Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Table and arrays of a file of ``write_arrays``.

    Raises OSError where the file cannot be read, and ValueError, with the reason as a clause, where it is
    damaged or was written by something else.
    """
    try:
        with safe_open(path, "np") as file:
            metadata = file.metadata() or {}
            if set(metadata) != {KEY}:
                raise ValueError("it was not written by panto-env")
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        return without_checksum(json.loads(metadata[KEY]), arrays), arrays
    # Types that NumPy does not have lead to a TypeError or an AttributeError.
    except (SafetensorError, TypeError, AttributeError, RecursionError, MemoryError) as error:
        raise ValueError(str(error).partition("\n")[0].rstrip(".") or type(error).__name__) from error
