"""One forked process for each case, with a time limit and a limit of memory; how each of them ended."""

from __future__ import annotations

import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

ROOM = 3 * 2**30
"""Bytes that a case may take beyond what the process had when it was forked: what wants more is a crash."""


class End(NamedTuple):
    """How a case ended."""

    status: int | None  # exit status, minus the signal that killed it; None: it was ended at its time limit
    output: str
    errors: str
    seconds: float


class _Running(NamedTuple):
    number: int
    begun: float
    folder: Path


def run_all(
    cases: Sequence[Callable[[], None]], folder: Path, limit: float, at_once: int = 2
) -> Iterator[tuple[int, End]]:
    """Run each case in a process of its own, forked from this one; yields its number and end as it ends.

    folder: where their output is kept meanwhile. limit: seconds that a case may take. This process must have
    no threads but its own.
    """
    running: dict[int, _Running] = {}
    waiting = list(enumerate(cases))[::-1]
    try:
        while waiting or running:
            while waiting and len(running) < at_once:
                number, case = waiting.pop()
                own = Path(tempfile.mkdtemp(dir=folder, prefix="end-"))
                running[_fork(case, own)] = _Running(number, time.monotonic(), own)
            for process in list(running):
                end = _end_of(process, running[process], limit)
                if end is not None:
                    yield running.pop(process).number, end
            time.sleep(0.005)
    finally:
        for process in running:
            _kill(process)


def _fork(case: Callable[[], None], folder: Path) -> int:
    process = os.fork()
    if process:
        return process
    status = 1
    try:
        os.setsid()  # so that its own processes can be ended with it
        for descriptor, name in ((1, "output"), (2, "errors")):
            os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT), descriptor)
        # Whatever wrote for the process before, as pytest's capture, must not now.
        sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))  # noqa: SIM115
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (_size() + ROOM, hard))
        case()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _end_of(process: int, case: _Running, limit: float) -> End | None:
    seconds = time.monotonic() - case.begun
    ended, status = os.waitpid(process, os.WNOHANG)
    if not ended and seconds < limit:
        return None
    if not ended:
        _kill(process)
    texts = [(case.folder / name).read_text(errors="replace") for name in ("output", "errors")]
    code = os.waitstatus_to_exitcode(status) if ended else None
    return End(code, *texts, seconds)


def _kill(process: int) -> None:
    try:
        os.killpg(process, signal.SIGKILL)
    except ProcessLookupError:  # it has not begun its session yet
        os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)


def _size() -> int:
    """Bytes of address space that this process has."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
