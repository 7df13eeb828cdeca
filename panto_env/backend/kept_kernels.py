"""Compiled kernels on disk: Numba's cache, which survives damaged files and a full disk.

Each kernel is stored with a checksum. Processes that need the same one at the same time compile it
independently; if one overwrites the other's file with the kernel for other types, that is noticed.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
import time
import warnings
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

from .cache import PACKAGE, cache_folder

PAUSE = 60.0
"""Time (s) within which a compilation of kernels is announced only once."""

_announced = -PAUSE


class _InPackage(_CacheLocator):  # type: ignore[misc]
    """Place of a kernel of the package: the folder is named by what it is made of, not by dates."""

    def __init__(self, function: Any) -> None:
        self._name = hashlib.sha256(function.__module__.encode()).hexdigest()[:8]

    @classmethod
    def from_function(cls, function: Any, file: str) -> _InPackage | None:
        """The place; None for a function of another package."""
        return cls(function) if Path(file).resolve().is_relative_to(PACKAGE) and cache_folder() else None

    def get_cache_path(self) -> str:
        """The folder of the package's kernels."""
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        """Nothing: the folder's name says it."""
        return ""

    def get_disambiguator(self) -> str:
        """What makes names of files differ where those of modules and functions do not."""
        return self._name


class _CheckedResults(CompileResultCacheImpl):  # type: ignore[misc]
    """Compiled kernels in their form on disk."""

    _locator_classes = (_InPackage, *CompileResultCacheImpl._locator_classes)

    def reduce(self, result: Any) -> tuple[bytes, bytes]:
        """A checksum, and its data."""
        data = pickle.dumps(super().reduce(result))
        return hashlib.sha256(data).digest(), data

    def rebuild(self, target_context: Any, payload: tuple[bytes, bytes]) -> Any:
        """The kernel. Raises ValueError where it is damaged."""
        digest, data = payload
        if hashlib.sha256(data).digest() != digest:
            raise ValueError("damaged")
        return super().rebuild(target_context, pickle.loads(data))


class KeptKernels(FunctionCache):  # type: ignore[misc]
    """Cache of one kernel: a compiled form for each combination of types with which it was called."""

    _impl_class = _CheckedResults

    def load_overload(self, types: Any, target_context: Any) -> Any:
        """The compiled form for these types; None where it is missing or damaged."""
        try:
            kernel = super().load_overload(types, target_context)
        except Exception:  # damaged files can lead to any error
            kernel = None
        if kernel is None or tuple(kernel.signature.args) != tuple(types):
            _announce()
            return None
        return kernel

    def save_overload(self, types: Any, kernel: Any) -> None:
        """Store a compiled form, with a warning where that is not possible."""
        try:
            try:
                super().save_overload(types, kernel)
            except OSError:
                raise
            except Exception:  # a damaged index can lead to any error
                self.flush()
                super().save_overload(types, kernel)
        except OSError as error:
            warnings.warn(
                f"Compiled kernels cannot be stored in {self.cache_path} ({error.strerror or error}), so the "
                "next process compiles them again; make room there, or set PANTO_CACHE_DIR.",
                RuntimeWarning,
                stacklevel=2,
            )


def _announce() -> None:
    """Announce the compilation on standard error, where a user sees it."""
    global _announced
    seen = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    if seen and time.monotonic() - _announced > PAUSE:
        text = "Compiling kernels, 10 to 30 s, once per version and kind of line ..."
        print(text, file=sys.stderr, flush=True)
        _announced = time.monotonic()
