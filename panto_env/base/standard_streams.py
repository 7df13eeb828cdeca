"""Standard output and error of a command that may be closed, or lead to a disk that is full."""

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
    if sys.stderr is not None:  # print would take standard output instead, which is for results
        print(f"panto: {harmless(sentence)}", file=sys.stderr)


class _Guarded:
    """A stream that asks what to do where it cannot be written."""

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
    """Within the body, standard output that cannot be written raises InputError; what cannot be written on
    standard error is lost without ending the work.

    Where nobody reads on, as in ``panto list | head``, the process exits with status 1 without a word.
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
    """Drop what is in a stream's buffer and cannot be written: the exit would fail over it."""
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
