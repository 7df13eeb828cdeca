"""A lock that allows one process at a time in a folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from .errors import InputError
from .files import make_folder


@contextmanager
def alone_in(folder: Path, doing: str) -> Iterator[None]:
    """Within the body no other process is in the folder, as far as files can be locked there.

    doing: what a process does there, such as "trains into". The folder is made if necessary; the system
    releases the lock of a killed process. Raises InputError where another process holds the lock.
    """
    make_folder(folder)
    lock = FileLock(folder / ".lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise InputError(f"Another process {doing} {folder}; wait until it has ended, or end it.") from error
    except (OSError, NotImplementedError):
        pass  # files cannot be locked here
    try:
        yield
    finally:
        lock.release()
