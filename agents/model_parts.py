"""Parts of a model file, a zip: their sizes are checked before they are unpacked, then their checksums."""

from __future__ import annotations

import hashlib
import io
import json
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

CHECKSUMS = "sha256.json"
"""Part that holds the SHA-256 of each other one by name."""
MOST_CHECKSUMS = 2**20
"""Bytes of it."""
SMALL, RATIO = 2**24, 100
"""Bytes that any file may unpack to, and how many times its size a larger one may: networks hardly shrink."""
CHUNK = 2**20
READ_ERRORS = (
    zipfile.BadZipFile,
    zlib.error,
    OSError,
    EOFError,
    RuntimeError,
    LookupError,
    ValueError,
    TypeError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    SyntaxError,
    struct.error,
    tokenize.TokenError,
)
"""What reading a damaged zip, JSON or array, or one made to do harm, can raise."""

Layers = tuple[NDArray[np.float32], ...]


def check_sizes(archive: zipfile.ZipFile, size: int) -> None:
    """Raise ValueError where the parts would unpack to far more than a file of this size (bytes) holds.

    No part is read further than to the size that it says.
    """
    unpacked = sum(part.file_size for part in archive.infolist())
    if unpacked > max(SMALL, RATIO * size):
        raise ValueError(f"its {size:,} bytes would unpack to {unpacked:,}, which no model does")
    names = archive.namelist()
    if len(set(names)) < len(names):
        raise ValueError("it holds two parts of one name")


def read_part(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """A part as bytes. Raises ValueError where it unpacks to more than so many."""
    size = archive.getinfo(name).file_size
    if size > most:
        raise ValueError(f"its part {name} would unpack to {size:,} bytes, more than {most:,}")
    return archive.read(name)


def write_checksums(archive: zipfile.ZipFile) -> None:
    """Add the checksums of all parts written so far."""
    archive.writestr(CHECKSUMS, json.dumps({name: _sha256(archive, name) for name in archive.namelist()}))


def check_checksums(archive: zipfile.ZipFile) -> bool:
    """Raise an error where a part is not what was written; whether there were checksums to tell.

    Without them only the zip's own, shorter ones are checked.
    """
    names = set(archive.namelist())
    if CHECKSUMS not in names:
        damaged = archive.testzip()
        if damaged is not None:
            raise ValueError(f"its part {damaged} is damaged")
        return False
    listed = json.loads(read_part(archive, CHECKSUMS, MOST_CHECKSUMS))
    if not isinstance(listed, dict) or set(listed) != names - {CHECKSUMS}:
        raise ValueError(f"it is damaged or was changed: its parts are not those that {CHECKSUMS} lists")
    for name, checksum in listed.items():
        if _sha256(archive, name) != checksum:
            raise ValueError(f"its part {name} is damaged or was changed")
    return True


def _sha256(archive: zipfile.ZipFile, name: str) -> str:
    check = hashlib.sha256()
    with archive.open(name) as part:
        while chunk := part.read(CHUNK):
            check.update(chunk)
    return check.hexdigest()


def write_arrays(archive: zipfile.ZipFile, name: str, arrays: Mapping[str, Any]) -> None:
    """Add arrays by name as one part."""
    with archive.open(name, "w", force_zip64=True) as member:
        np.savez(member, **arrays)


def read_arrays(archive: zipfile.ZipFile, name: str, most: int) -> dict[str, Any]:
    """Arrays of a part by name. Raises an error where they are damaged, or take more bytes than ``most``."""
    with zipfile.ZipFile(io.BytesIO(read_part(archive, name, most))) as arrays:
        if sum(part.file_size for part in arrays.infolist()) > most:
            raise ValueError(f"its {name} would unpack to more than {most:,} bytes")
        return {part.removesuffix(".npy"): _array(arrays.read(part), name) for part in arrays.namelist()}


def _array(data: bytes, name: str) -> Any:
    """One array. What its header says is checked before room is made for it."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    read_header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read_header is None:
        raise ValueError(f"its {name} is of an unknown version")
    shape, _, kind = read_header(file)
    if kind.hasobject or kind.itemsize * math.prod(shape) != len(data) - file.tell():
        raise ValueError(f"its {name} holds another number of values than it says")
    file.seek(0)
    return np.lib.format.read_array(file, allow_pickle=False)


def layers_of(arrays: Mapping[str, Any], inputs: int, outputs: int) -> tuple[Layers, Layers]:
    """Weights and biases of a network's layers. Raises ValueError unless they are those of one.

    inputs, outputs: that it must have.
    """
    count = len(arrays) // 2
    names = {f"{kind}_{k}" for k in range(count) for kind in ("weight", "bias")}
    if not count or set(arrays) != names:
        raise ValueError("its network has no layers, or not a weight and a bias in each")
    weights, biases = (tuple(arrays[f"{kind}_{k}"] for k in range(count)) for kind in ("weight", "bias"))
    width = inputs
    for k, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        if not all(each.dtype.kind == "f" and np.isfinite(each).all() for each in (weight, bias)):
            raise ValueError(f"layer {k} of its network holds something else than finite numbers")
        if weight.ndim != 2 or weight.shape[1] != width or bias.shape != weight.shape[:1]:
            raise ValueError(f"layer {k} of its network does not fit the one before, or what it observes")
        width = len(bias)
    if width != outputs:
        raise ValueError("its network has another shape than it says")
    return weights, biases
