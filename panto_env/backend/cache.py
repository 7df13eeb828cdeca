"""Where compiled kernels are kept.

Numba's cache notices an edit in a kernel's own file but not in another file that the kernel calls.
So the cache folder is named by a hash of all of the package's sources: any edit opens a new one.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

import numba

PACKAGE = Path(__file__).resolve().parents[1]


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
