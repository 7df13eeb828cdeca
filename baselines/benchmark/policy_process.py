"""The process of policies apart from the plant: it sees observations and contexts, and answers actions.

It is a fresh interpreter that has neither a plant nor a seed, and loads no policy itself. It forks a process
that loads one; that forks one for a line and speed, and that one forks one for each pass. So a pass begins
with what loading the policy left behind, not with what another pass did, and waits neither for imports nor
for what only depends on line and speed. All use the same two pipes: each waits for the one that it forked.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import pickle
import signal
import sys
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn

import numpy as np

from panto_env.base.errors import InputError
from panto_env.base.files import finite
from panto_env.control.observation import Context
from panto_env.policies import Policy, checked_action, errors_name, find_policy, wishes

BEGIN, OBSERVATION, END = b"b", b"o", b"e"
"""First byte of a request. BEGIN is followed by 8 bytes, the length, and so much content; OBSERVATION by 2,
the number of the core on which the other side runs, and the observation."""
DONE, FAILED, ENDED = b"+", b"!", b"."
"""First byte of an answer: content, a sentence about the policy's error, or how a process has ended."""
HEADER, LONGEST = 5, 65_536
"""Length of an answer's kind and, in 4 bytes, of its content's length; maximum of an answer (bytes)."""
DIE_WITH_PARENT, DUMPABLE = 1, 4
"""Options of Linux's ``prctl``."""
NO_CORE = b"\xff\xff"
"""Number of the core where the system doesn't tell it."""
LINUX = ctypes.CDLL(None) if sys.platform == "linux" else None


def process_control(option: int, value: int) -> None:
    """Set an option of this process, on Linux only."""
    if LINUX is not None:
        LINUX.prctl(option, value, 0, 0, 0)


def core() -> bytes:
    """Number of the core on which this process runs, 2 bytes, on Linux only."""
    return NO_CORE if LINUX is None else int(LINUX.sched_getcpu()).to_bytes(2, "big")


class Channel:
    """Requests and answers. What a policy prints goes to standard error; it can read no standard input."""

    def __init__(self) -> None:
        self._requests, self._answers = os.dup(0), os.dup(1)
        self._core = NO_CORE
        nothing = os.open(os.devnull, os.O_RDWR)
        os.dup2(nothing, 0)
        os.dup2(nothing if sys.stderr is None else 2, 1)
        os.close(nothing)
        sys.stdout = sys.stderr

    def read(self, count: int) -> bytes:
        """As many bytes; none where the other side has closed its end."""
        content = b""
        while len(content) < count:
            more = os.read(self._requests, count - len(content))
            if not more:
                return b""
            content += more
        return content

    def observation(self, size: int) -> bytes:
        """The bytes of an observation, as many; none at the end of the pass.

        The process moves to the core on which the other side runs. As one of both waits at any time, they
        need no more, and pairs of processes that share two cores would wait for each other.
        """
        request = os.read(self._requests, 3 + size)
        if request[:1] != OBSERVATION:
            return b""
        if len(request) < 3 + size:
            request += self.read(3 + size - len(request))
        if request[1:3] != self._core:
            self._core = request[1:3]
            with suppress(OSError):
                os.sched_setaffinity(0, {int.from_bytes(self._core, "big")})
        return request[3:]

    def answer(self, kind: bytes, content: bytes = b"") -> None:
        """Send an answer, its content cut so that both are no longer than ``LONGEST``."""
        content = content[: LONGEST - HEADER]
        os.write(self._answers, kind + len(content).to_bytes(HEADER - 1, "big") + content)


def serve(channel: Channel, begin: Callable[[bytes], None]) -> None:
    """Answer each BEGIN by a forked process that calls ``begin`` with the content, until END."""
    while channel.read(1) == BEGIN:
        content = channel.read(int.from_bytes(channel.read(8), "big"))
        gc.freeze()  # a collection would touch, and so copy, all memory in each forked process
        me, process = os.getpid(), os.fork()
        if process == 0:
            _run(channel, me, begin, content)
        status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        how = f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        channel.answer(ENDED, how.encode())


def _run(channel: Channel, parent: int, begin: Callable[[bytes], None], content: bytes) -> NoReturn:
    """Call ``begin`` in a process just forked, and end it."""
    status = 1
    try:
        process_control(DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() == parent:
            begin(content)
        status = 0
    except InputError as error:
        channel.answer(FAILED, str(error).encode())
        channel.read(1)  # until the other side ends all processes
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BrokenPipeError:
        pass  # the other side has ended
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(status)


def _load(channel: Channel, source: str) -> None:
    """Load a policy, answer what it wishes, and serve its lines and speeds."""
    policy = find_policy(source)
    channel.answer(DONE, json.dumps(finite(wishes(policy))).encode())
    serve(channel, lambda content: _prepare(channel, source, policy, content))


def _prepare(channel: Channel, source: str, policy: Policy, content: bytes) -> None:
    """Let a second object of the policy fill its module's caches for a line and speed, and serve passes."""
    with suppress(Exception):  # a pass meets the same error, and reports it
        find_policy(source).reset(pickle.loads(content))
    serve(channel, lambda context: _play(channel, source, policy, pickle.loads(context)))


def _play(channel: Channel, source: str, policy: Policy, context: Context) -> None:
    """Play one pass: answer each observation by an action."""
    with errors_name(source, "reset"):
        policy.reset(context)
    channel.answer(DONE)
    size, shape = 4 * len(context.layout.entries), (context.actions,)
    with errors_name(source, "act"):
        while content := channel.observation(size):
            observation = np.frombuffer(content, np.float32).copy()
            channel.answer(DONE, checked_action(policy.act(observation), shape).tobytes())


def main() -> None:
    """Serve policies to the process that started this one."""
    process_control(DIE_WITH_PARENT, signal.SIGKILL)
    # Forking while idle threads of kernels or of linear algebra exist: none of them is needed afterwards.
    warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
    channel = Channel()
    checked_action(np.zeros(1), (1,))  # imports what NumPy imports late, once for all passes
    with suppress(BrokenPipeError, KeyboardInterrupt):
        serve(channel, lambda content: _load(channel, content.decode()))
    os._exit(0)


if __name__ == "__main__":
    main()
