"""Compiled kernels on disk: Numba's cache, which survives damaged files and a full disk.

A wheel brings kernels of the usual forms, for a class of processors; they are used where nothing is stored.

Each kernel is stored with a checksum. Of processes that need the same one at the same time, one compiles it
and the others wait, but no longer than ``LONGEST_WAIT``; if one overwrites the other's file with the kernel
for other types, that is noticed.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import time
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

from .cache import PACKAGE, cache_folder

PAUSE = 60.0
"""Time (s) within which a compilation of kernels is announced only once."""

LONGEST_WAIT = 300.0
"""Time (s) after which a process compiles a kernel by itself that another one seems to be compiling."""

BROUGHT = PACKAGE / "kernels"
"""Folder of a wheel's kernels (``make wheel``)."""
CLASS, FEATURES = "x86-64-v3", ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
"""Class of processors for which these are compiled, and what makes a processor one of it."""

_announced = -PAUSE


class _InPackage(_CacheLocator):  # type: ignore[misc]
    """Place of a kernel of the package: the folder is named by what it is made of, not by dates."""

    def __init__(self, function: Any) -> None:
        self._name = hashlib.sha256(function.__module__.encode()).hexdigest()[:8]

    @classmethod
    def from_function(cls, function: Any, file: str) -> _InPackage | None:
        """The place; None for a function of another package."""
        return cls(function) if Path(file).resolve().is_relative_to(PACKAGE) else None

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        return ""  # the folder's name says it

    def get_disambiguator(self) -> str:
        """What makes names of files differ where those of modules and functions do not."""
        return self._name


class _CheckedResults(CompileResultCacheImpl):  # type: ignore[misc]
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


class _InWheel(_InPackage):
    def get_cache_path(self) -> str:
        return str(_brought_folder())


class _BroughtResults(_CheckedResults):
    _locator_classes = (_InWheel,)


class BroughtKernels(FunctionCache):  # type: ignore[misc]
    """The wheel's forms of one kernel, for any processor of their class."""

    _impl_class = _BroughtResults

    def _index_key(self, types: Any, codegen: Any) -> Any:
        types, (system, *_), code = super()._index_key(types, codegen)
        return types, (system, CLASS, ""), code


def _brought_folder() -> Path:
    """The wheel's kernels of the present sources, named as those that are kept."""
    kept = cache_folder()
    return BROUGHT / (kept.name if kept else "")


@cache
def brought() -> bool:
    """Whether there are such kernels, and this processor can run them."""
    found = llvmlite.binding.get_host_cpu_features()
    return _brought_folder().is_dir() and all(found.get(each) for each in FEATURES)


class KeptKernels(FunctionCache):  # type: ignore[misc]
    """Cache of one kernel: a compiled form for each combination of types with which it was called."""

    _impl_class = _CheckedResults
    _lock: int | None = None  # file that is locked while this process compiles

    def load_overload(self, types: Any, target_context: Any) -> Any:
        """The compiled form for these types; None where it is missing or damaged."""
        kernel = self._stored(types, target_context)
        if kernel is None:
            _announce()
            self._wait(types)
            kernel = self._stored(types, target_context)  # another process may just have stored it
            if kernel is not None:
                self._unlock()
        return kernel

    def _stored(self, types: Any, target_context: Any) -> Any:
        kernel = _loaded(super(), types, target_context)
        if kernel is None and brought():
            kernel = _loaded(BroughtKernels(self._py_func), types, target_context)
        return kernel

    def _wait(self, types: Any) -> None:
        """Be the one process that compiles the form for these types."""
        self._unlock()
        name = hashlib.sha256(repr((self._cache_file._index_name, types)).encode()).hexdigest()[:16]
        with suppress(OSError):
            self._impl.locator.ensure_cache_path()
            file = os.open(Path(self.cache_path) / f"{name}.lock", os.O_RDWR | os.O_CREAT, 0o600)
            self._lock, end = file, time.monotonic() + LONGEST_WAIT
            while not _locked(file) and time.monotonic() < end:
                time.sleep(0.05)

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

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
        finally:
            self._unlock()


def _loaded(kept: Any, types: Any, target_context: Any) -> Any:
    try:
        kernel = kept.load_overload(types, target_context)
    except Exception:  # damaged files can lead to any error
        return None
    return kernel if kernel is not None and tuple(kernel.signature.args) == tuple(types) else None


def _locked(file: int) -> bool:
    """Whether this process has a file for itself now; its lock ends with the process."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _announce() -> None:
    global _announced
    seen = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    if seen and time.monotonic() - _announced > PAUSE:
        text = "Compiling kernels, 10 to 30 s, once per version and kind of line ..."
        print(text, file=sys.stderr, flush=True)
        _announced = time.monotonic()
