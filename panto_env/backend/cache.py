"""The cache folder of compiled kernels.

Numba's cache notices an edit in a kernel's own file but not in another file that the kernel calls.
So the folder is named by a hash of all sources that kernels call: after an edit a new folder is used.
Its content is executed, so a folder is used only if it belongs to this user and no other can write to it.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import llvmlite
import numba

PACKAGE = Path(__file__).resolve().parents[1]
KERNEL_ROOMS = ("backend", "plant", "control", "estimation")
"""Packages with the sources of kernels. A kernel elsewhere calls only these and its own file."""


@cache
def source_hash() -> str:
    """Hash of all source files of the package, and of the versions of the compilers."""
    return _hash(PACKAGE.rglob("*.py"))


@cache
def kernel_hash() -> str:
    """Hash of the source files of kernels, and of the versions of the compilers."""
    return _hash(path for room in KERNEL_ROOMS for path in (PACKAGE / room).rglob("*.py"))


def _hash(files: Iterable[Path]) -> str:
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    if numba.config.BOUNDSCHECK:
        digest.update(b" with bounds checked")
    for path in sorted(files):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path | None:
    """Folder of the compiled kernels, made on first use; None where nothing can be written.

    ``PANTO_CACHE_DIR`` overrides its place. If that cannot be used, it is in the temporary folder; if another
    user has put something under its name there, it is a new one only for this process.
    """
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    own = _own_folder(Path(os.environ.get("PANTO_CACHE_DIR") or Path(home) / "panto_env"))
    if own is not None:
        return own
    try:
        common = Path(tempfile.gettempdir()) / f"panto_env-{_user()}"
        own = _own_folder(common)
        if own is not None and _private(common):
            return own
        alone = Path(tempfile.mkdtemp(prefix="panto_env-"))
    except OSError:
        return None
    atexit.register(_remove, alone, os.getpid())
    return alone


def _remove(folder: Path, process: int) -> None:
    """Remove the folder of a process at its end, but not at the end of its forked children."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _own_folder(parent: Path) -> Path | None:
    """The folder of these sources in another one; None where it cannot be made, or is not private."""
    folder = parent / kernel_hash()
    try:
        parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        return folder if _private(folder) and os.access(folder, os.W_OK) else None
    except OSError:
        return None


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def _private(folder: Path) -> bool:
    """Whether a folder is not a link, belongs to this user, and cannot be written to by others."""
    if not hasattr(os, "getuid"):
        return True  # on Windows a user's folders are private
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return stat.S_ISDIR(found.st_mode) and found.st_uid == _user() and not found.st_mode & others
