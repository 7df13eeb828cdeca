"""A file of arrays and a table of plain data, as safetensors: it can neither run code nor unpack to more."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from .checksums import with_checksum, without_checksum
from .files import check_regular, write_whole

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
    check_regular(path)
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
