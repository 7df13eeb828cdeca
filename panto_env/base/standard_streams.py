"""Standard output and error of a command, which may be closed or lead to a full disk."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO, cast

from .errors import InputError
from .shown import harmless


def say(sentence: str) -> None:
    """Print a line on standard error, if that is open."""
    if sys.stderr is not None:  # print would use standard output instead, which is for results
        print(f"panto: {harmless(sentence)}", file=sys.stderr)


class _Guarded:
    """A stream that calls a handler where it cannot be written."""

    def __init__(self, stream: TextIO, failed: Callable[[OSError], None]) -> None:
        self._stream = stream
        self._failed = failed

    def write(self, text: str) -> int:
        try:
            self._stream.write(text)
        except OSError as error:
            self._failed(error)
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._failed(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def guarded_streams() -> Iterator[None]:
    """Within the body, standard output that cannot be written raises InputError; standard error is dropped.

    Where the reader has closed the pipe, as in ``panto list | head``, the process exits silently with 1.
    """
    output, remarks = sys.stdout, sys.stderr

    def output_failed(error: OSError) -> None:
        if error.errno == errno.EPIPE:
            raise SystemExit(1) from error
        raise InputError(f"Standard output cannot be written: {error.strerror or error}.") from error

    if output is not None:
        sys.stdout = cast(TextIO, _Guarded(output, output_failed))
    if remarks is not None:
        sys.stderr = cast(TextIO, _Guarded(remarks, lambda error: None))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = output, remarks
        for stream in (output, remarks):
            _empty(stream)


def _empty(stream: TextIO | None) -> None:
    """Drop a stream's buffer where it cannot be written: otherwise the exit would fail."""
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
