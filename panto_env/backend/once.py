"""A kernel that many processes want at once is compiled by one of them; the others wait and load it."""

from __future__ import annotations

import hashlib
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from numba.core.compiler_lock import global_compiler_lock

PATIENCE = 300.0
"""Seconds to wait for another process, which may hang; one that dies lets go at once."""
PAUSE = 1.0
"""Seconds between two kernels compiled beyond which the second is announced again."""

_silent_until = 0.0


def compile_once(dispatcher: Any, folder: Path) -> None:
    """Let a kernel, to be kept on disk in a folder, be compiled by one process at a time."""
    compile_here: Callable[[Any], Any] = dispatcher.compile
    save: Callable[[Any, Any], None] = dispatcher._cache.save_overload
    name = f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"

    def compile_or_wait(signature: Any) -> Any:
        if tuple(signature) in dispatcher.overloads or _on_disk(dispatcher, signature):
            return compile_here(signature)
        form = hashlib.sha256(str(signature).encode()).hexdigest()[:16]
        # A thread that waits for another process keeps Numba's own lock, which is always taken first.
        with global_compiler_lock, _alone(folder / f"{name}-{form}.lock"):
            if _on_disk(dispatcher, signature):
                return compile_here(signature)
            with _announced("Compiling kernels, about 10 s, once per version and kind of line ..."):
                return compile_here(signature)

    def save_alone(signature: Any, result: Any) -> None:
        # Of two processes that save two forms of a kernel at once, Numba could keep one under both names.
        with _alone(folder / f"{name}.lock"):
            save(signature, result)

    dispatcher.compile = compile_or_wait
    dispatcher._cache.save_overload = save_alone


def _on_disk(dispatcher: Any, signature: Any) -> bool:
    """Whether the kernel's form for these types is kept on disk."""
    cache = dispatcher._cache
    return cache._index_key(signature, dispatcher.targetctx.codegen()) in cache._cache_file._load_index()


@contextmanager
def _alone(file: Path) -> Iterator[None]:
    """Within the body no other process is in a body with this file, as far as the file system sees to it."""
    lock = FileLock(file)
    try:
        try:
            lock.acquire(timeout=0)
        except Timeout:
            with _announced("Waiting for another process that compiles the same kernel ..."):
                lock.acquire(timeout=PATIENCE)
    except (Timeout, OSError, NotImplementedError):
        pass  # it hangs, or files cannot be locked here: what is done twice is done right
    try:
        yield
    finally:
        lock.release()


@contextmanager
def _announced(text: str) -> Iterator[None]:
    """Say on standard error, where somebody sees it, what takes so long; once for kernels in a row."""
    global _silent_until
    seen = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    if seen and time.monotonic() > _silent_until:
        print(text, file=sys.stderr, flush=True)
    try:
        yield
    finally:
        _silent_until = time.monotonic() + PAUSE
