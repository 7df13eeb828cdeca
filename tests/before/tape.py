"""What a case returned, as a digest and a figure for each of its parts."""

from __future__ import annotations

import hashlib
import math
import struct
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

IGNORED = ("settings",)
"""Keys that tell what was asked for, not what came out; a new version may ask for more."""


class Tape:
    """Collects values under dotted names; equal bits give equal digests, whatever else is added.

    Items of a list share one name. A digest is over the type, the shape and the bytes of everything that came
    under its name, in order; a figure is the mean magnitude of the numbers among it.
    """

    def __init__(self) -> None:
        self._digests: dict[str, Any] = defaultdict(hashlib.sha256)
        self._sums: dict[str, list[float]] = defaultdict(list)
        self._counts: dict[str, int] = defaultdict(int)

    def add(self, name: str, value: Any) -> None:
        """Take a number, text, None, an array, or lists, tables and data classes of these."""
        if isinstance(value, Mapping):
            for key, item in value.items():
                if key not in IGNORED:
                    self.add(f"{name}.{key}", item)
        elif is_dataclass(value):
            self.add(name, {each.name: getattr(value, each.name) for each in fields(value)})
        elif isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.dtype == object):
            self._digests[name].update(b"list%d" % len(value))
            for item in value:
                self.add(name, item)
        else:
            self._leaf(name, value)

    def _leaf(self, name: str, value: Any) -> None:
        digest = self._digests[name]
        if isinstance(value, np.ndarray | np.generic):
            array = np.asarray(value)
            digest.update(f"{array.dtype.str}{array.shape}".encode() + array.tobytes())
            numbers = array[np.isfinite(array)].astype(float)
            self._count(name, float(np.abs(numbers).sum()), numbers.size)
        elif isinstance(value, bool | int):
            digest.update(f"{type(value).__name__}{value}".encode())
            self._count(name, float(abs(value)), 1)
        elif isinstance(value, float):
            digest.update(b"float" + struct.pack("<d", value))
            if math.isfinite(value):
                self._count(name, abs(value), 1)
        elif value is None or isinstance(value, str | bytes):
            digest.update(value if isinstance(value, bytes) else repr(value).encode())
        else:
            raise TypeError(f"{name} holds a {type(value).__name__}; teach Tape how to digest it.")

    def _count(self, name: str, total: float, count: int) -> None:
        self._sums[name].append(total)
        self._counts[name] += count

    def told(self) -> dict[str, Any]:
        """Digest of all, digest of every part, and the mean magnitude of every part with numbers."""
        parts = {name: digest.hexdigest()[:32] for name, digest in sorted(self._digests.items())}
        whole = hashlib.sha256(repr(parts).encode()).hexdigest()
        # Python writes a float with as many digits as tell it from its neighbours.
        figures = {
            name: math.fsum(sums) / self._counts[name]
            for name, sums in sorted(self._sums.items())
            if self._counts[name]
        }
        return {"sha256": whole, "parts": parts, "figures": figures}
