"""Policies apart from the plant, each in a process that sees observations and contexts, and nothing else.

A policy cannot reach the plant, the record or the seeds through Python: they are in another process, and no
message, argument or variable of the environment holds them. Passes don't share its memory either. This is no
sandbox: a policy's code has the rights of the user who runs it. It may read the disk, leave files for a later
pass, and look at other processes as far as the system lets this user do that. Run what you don't trust as
another user, or in a container without a network.
"""

from __future__ import annotations

import atexit
import json
import os
import pickle
import re
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from panto_env.analysis.pool import LINEAR_ALGEBRA_THREADS
from panto_env.base.errors import InputError
from panto_env.control.observation import OBSERVATION_SETTINGS, Context
from panto_env.control.settings import run_settings
from panto_env.policies import PolicyError, find_policy, policy_names

from .policy_process import (
    BEGIN,
    DONE,
    DUMPABLE,
    END,
    ENDED,
    FAILED,
    HEADER,
    LONGEST,
    OBSERVATION,
    core,
    process_control,
)

Array = NDArray[np.float64]

ACT_LIMIT = 60.0
"""Time (s) within which a policy must answer an observation."""
PREPARATION_LIMIT = 600.0
"""Time (s) within which it must be loaded, and prepare for an episode: kernels may be compiled for that."""
INTERPRETER = "PANTO_POLICY_PYTHON"
"""Variable that names the Python of policies, which has this package too; by default it is this one."""
ENVIRONMENT = re.compile("PATH|HOME|LANG|LC_.*|TZ|TMPDIR|LD_LIBRARY_PATH|.*_CACHE_(DIR|HOME)|NUMBA_.*")
"""Variables of the environment that a policy's process gets; others may hold secrets."""
END_LIMIT = 5.0
"""Time (s) within which its process ends by itself where another user's can't be killed."""
MODULE = "panto_baselines.benchmark.policy_process"


def find_apart(source: Any, trusted: bool, number: int = 0) -> Any:
    """The policy that a benchmark runs: apart from the plant, or in this process.

    number: of the process among those that run side by side, one for each controlled pantograph. Objects run
    in this process, as do installed policies if they are ``trusted``. Raises InputError where the policy
    doesn't exist or cannot be made.
    """
    if not isinstance(source, str) or (trusted and source.partition(":")[0] in policy_names()):
        return find_policy(source)
    return PolicyApart(source, number)


class PolicyApart:
    """A policy in a process of its own. It has the attributes of the policy that say what it wishes."""

    def __init__(self, source: str, number: int = 0) -> None:
        """source: name, model file, or class in a Python file. number: of its process, see ``find_apart``.

        Raises InputError if it cannot be made.
        """
        self._source, self._number = source, number
        if number in _running and _running[number].ended:
            close()
        vars(self).update(_process(number).load(source))

    def reset(self, context: Context) -> None:
        """Prepare for an episode, in a process that has seen no other. Raises InputError if that fails."""
        _process(self._number).begin(self._source, context)

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action, (actions,), for an observation, (entries,). Raises InputError if the policy fails."""
        return _process(self._number).act(observation)


def close() -> None:
    """End this process's policies apart, with everything that they have started."""
    while _running:
        _running.popitem()[1].close()


_running: dict[int, _PolicyProcess] = {}
atexit.register(close)


def _process(number: int) -> _PolicyProcess:
    if number not in _running:
        _running[number] = _PolicyProcess()
    return _running[number]


class _PolicyProcess:
    """A ``policy_process`` as seen from the plant; it runs one policy at a time."""

    def __init__(self) -> None:
        """Start it. Raises InputError where that is not possible."""
        if not hasattr(os, "fork"):
            raise InputError(
                "A policy apart from the plant needs a system that can fork, such as Linux or macOS; only "
                "installed policies run without, with --trusted."
            )
        # Not even as the same user may a policy read this process's memory. Root still may.
        process_control(DUMPABLE, 0)
        variables = dict.fromkeys(LINEAR_ALGEBRA_THREADS, "1")  # for the reason see ``in_processes``
        python = os.environ.get(INTERPRETER)
        if python is None:
            python, variables["PYTHONPATH"] = sys.executable, os.pathsep.join(sys.path)
        try:
            self._process = subprocess.Popen(
                [python, "-P", "-m", MODULE],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={name: os.environ[name] for name in filter(ENVIRONMENT.fullmatch, os.environ)}
                | variables,
                process_group=0,  # interrupts from the keyboard are left to this process
                bufsize=0,
            )
        except OSError as error:
            raise InputError(
                f"The Python of policies, {python}, can't be started: {error.strerror}; "
                f"correct {INTERPRETER}."
            ) from error
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests, self._answers = self._process.stdin.fileno(), self._process.stdout.fileno()
        self._arrival = select.poll()
        self._arrival.register(self._answers, select.POLLIN)
        self._open: list[bytes] = []  # what the processes that wait for one another were begun with
        self._source = ""
        self._wishes: dict[str, Any] = {}
        self._size = 0  # of an action (bytes)

    @property
    def ended(self) -> bool:
        """Whether the process has ended by itself."""
        return self._process.poll() is not None

    def load(self, source: str) -> dict[str, Any]:
        """What a policy wishes. Raises PolicyError if it cannot be made."""
        if self._open[:1] != [source.encode()]:
            self._source = source
            self._descend(source.encode())
            answer = self._answer("being loaded", PREPARATION_LIMIT)
            try:
                self._wishes = json.loads(answer)
                if not self._wishes.keys() <= {*OBSERVATION_SETTINGS, "washout"}:
                    raise ValueError("unknown names")
                run_settings(self._wishes)
            except (InputError, ValueError, AttributeError, RecursionError) as error:
                self._fail("being loaded", f"what it wishes is not valid: {error}".removesuffix("."))
        return self._wishes

    def begin(self, source: str, context: Context) -> None:
        """Begin a pass. Raises PolicyError if the policy fails."""
        self.load(source)
        given = pickle.dumps(context)
        alike = pickle.dumps(replace(context, nominal_force=0.0))  # scatters from pass to pass
        if self._open[1:2] != [alike]:
            self._descend(source.encode(), given)
            self._open[1] = alike
        self._descend(source.encode(), alike, given)
        self._answer("reset", PREPARATION_LIMIT)
        self._size = 8 * context.actions

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action for an observation. Raises PolicyError if the policy fails."""
        self._send(OBSERVATION + core() + observation.tobytes())
        answer = self._answer("act", ACT_LIMIT)
        if len(answer) != self._size:
            self._fail("act", "its process sent something else than an action")
        return np.frombuffer(answer)

    def close(self) -> None:
        """End the process, and all that it has forked; another user's ends as its pipes are closed."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(END_LIMIT)

    def _descend(self, *contents: bytes) -> None:
        """End the processes that were begun with something else, or with the last of these, and begin it."""
        keep = 0
        while keep < len(contents) - 1 and self._open[keep : keep + 1] == [contents[keep]]:
            keep += 1
        while len(self._open) > keep:
            self._send(END)
            self._answer("its end", ACT_LIMIT, ENDED)
            self._open.pop()
        content = contents[-1]
        self._send(BEGIN + len(content).to_bytes(8, "big") + content)
        self._open.append(content)

    def _send(self, request: bytes) -> None:
        with suppress(BrokenPipeError):  # the answer then shows why
            while request:
                request = request[os.write(self._requests, request) :]

    def _answer(self, when: str, limit: float, expected: bytes = DONE) -> bytes:
        """Content of the next answer. Raises PolicyError where it is another one, or late."""
        end, answer, length = time.monotonic() + limit, b"", HEADER
        while len(answer) < length:
            if not self._arrival.poll(1000 * max(0.0, end - time.monotonic())):
                self._fail(when, f"it took more than {limit:g} s")
            if not (more := os.read(self._answers, LONGEST)):
                self._fail(when, "its process ended")
            answer += more
            length = HEADER + int.from_bytes(answer[1:HEADER].ljust(HEADER - 1, b"\xff"), "big")
            if len(answer) >= HEADER and not len(answer) <= length <= LONGEST:
                self._fail(when, "its process sent something else than an answer")
        kind, content = answer[:1], answer[HEADER:]
        if kind == expected:
            return content
        words = content.decode(errors="replace")
        if kind == FAILED and self._source in words:  # otherwise it may blame another policy
            close()
            raise PolicyError(words)
        self._fail(when, f"its process {words or 'ended'}" if kind == ENDED else words.removesuffix("."))

    def _fail(self, when: str, why: str) -> NoReturn:
        close()
        raise PolicyError(f"The policy '{self._source}' failed in {when}: {why}.")
