"""How kernels are compiled: cached on disk, never stale, never at import.

Numba's cache notices an edit in a kernel's own file but not in another file that the kernel calls.
So the cache folder is named by a hash of all of the package's sources: any edit opens a new one.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])
PACKAGE = Path(__file__).resolve().parents[1]

# "contract" lets multiply and add fuse; it leaves the order of operations alone. Kernels allocate
# nothing, so without Numba's run-time they need not count references to the arrays they are given.
OPTIONS: dict[str, Any] = {"fastmath": {"contract"}, "error_model": "numpy", "_nrt": False}
PART: dict[str, Any] = OPTIONS | {"forceinline": True}
"""Options of a catenary's overloads: inlined by the compiler, as a call costs as much as most parts do."""


@cache
def source_hash() -> str:
    """Hash of every source file of the package."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path:
    """Folder of the compiled kernels, made on first use; in the temporary folder as a last resort.

    ``PANTO_CACHE_DIR`` overrides where it lies.
    """
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    base = Path(os.environ.get("PANTO_CACHE_DIR") or Path(home) / "panto_env")
    user = os.getuid() if hasattr(os, "getuid") else 0
    for parent in (base, Path(tempfile.gettempdir()) / f"panto_env-{user}"):
        folder = parent / source_hash()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    raise OSError(f"no folder can be written for compiled kernels; set PANTO_CACHE_DIR (not {base})")


def kernel(function: F) -> F:
    """Compile ``function`` with Numba on its first call; keep the result on disk.

    A kernel runs without Python's lock, so that threads can share the lanes of a batch.
    """
    previous = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())  # read by Numba when it decorates
    try:
        compiled: F = numba.njit(cache=True, nogil=True, **OPTIONS)(function)
        return compiled
    finally:
        numba.config.CACHE_DIR = previous


def part(function: F) -> F:
    """A part of kernels, inlined where it is called before types are known, as if it were written there."""
    compiled: F = numba.njit(inline="always", **OPTIONS)(function)
    return compiled
