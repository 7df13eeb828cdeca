"""The cache folder of compiled kernels.

Numba's cache notices an edit in a kernel's own file but not in another file that the kernel calls.
So the folder is named by a hash of what kernels are made of (``kernel_sources``): after a change of it a new
folder is used, and after any other the same. Its content is executed, so a folder is used only if it belongs
to this user and no other can write to it.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

import llvmlite
import numba

from .kernel_sources import kernel_sources

PACKAGE = Path(__file__).resolve().parents[1]
HASH = re.compile("[0-9a-f]{16}")


@cache
def source_hash() -> str:
    """Hash of all source files of the package, and of the versions of the compilers."""
    files = sorted(PACKAGE.rglob("*.py"))
    return _hash(part for path in files for part in (str(path.relative_to(PACKAGE)), path.read_bytes()))


@cache
def kernel_hash() -> str:
    """Hash of what the package's kernels are made of, and of the versions of the compilers."""
    return _hash(each for (module, name), tree in kernel_sources(PACKAGE) for each in (module, name, tree))


def _hash(parts: Iterable[str | bytes]) -> str:
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    if numba.config.BOUNDSCHECK:
        digest.update(b" with bounds checked")
    for part in parts:
        digest.update((part.encode() if isinstance(part, str) else part) + b"\0")
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
    """The folder of these kernels in another one; None where it cannot be made, or is not private."""
    hashes = _private_folder(parent, "hashes")
    return hashes and _private_folder(parent, _kept_hash(hashes / source_hash()))


def _private_folder(parent: Path, name: str) -> Path | None:
    folder = parent / name
    try:
        parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        return folder if _private(folder) and os.access(folder, os.W_OK) else None
    except OSError:
        return None


def _kept_hash(file: Path) -> str:
    """``kernel_hash``, which takes a quarter of a second, from a file of these sources, or written to it."""
    with suppress(OSError, UnicodeDecodeError):
        found = file.read_text(encoding="ascii")
        if HASH.fullmatch(found):
            return found
    with suppress(OSError):
        file.write_text(kernel_hash(), encoding="ascii")
    return kernel_hash()


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def _private(folder: Path) -> bool:
    """Whether a folder is not a link, belongs to this user, and cannot be written to by others."""
    if not hasattr(os, "getuid"):
        return True  # on Windows a user's folders are private
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return stat.S_ISDIR(found.st_mode) and found.st_uid == _user() and not found.st_mode & others
