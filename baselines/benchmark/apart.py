"""Policies apart from the plant, in a process that sees observations and contexts, and nothing else.

A policy of a file has a process of its own, installed ones share one; neither plant, record nor seed is in
it. This is no sandbox: a policy's code has the rights of the user who runs it. Run what you don't trust as
another user, or in a container without a network.
"""

from __future__ import annotations

import atexit
import json
import os
import pickle
import re
import select
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from signal import Signals
from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env.analysis.pool import LINEAR_ALGEBRA_THREADS
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.base.files import finite
from panto_env.control.observation import OBSERVATION_SETTINGS, Context
from panto_env.control.settings import run_settings
from panto_env.policies import (
    Policy,
    PolicyError,
    checked_action,
    code_named,
    errors_name,
    find_policy,
    policy_names,
    wishes,
)

ACT_LIMIT = 60.0  # time (s) within which a policy must answer an observation
PREPARATION_LIMIT = 600.0
"""Time (s) within which it must be loaded, and prepare for an episode: kernels may be compiled for that."""
INTERPRETER = "PANTO_POLICY_PYTHON"
"""Variable that names the Python of policies, which has this package too; by default it is this one."""
ENVIRONMENT = re.compile("PATH|HOME|LANG|LC_.*|TZ|TMPDIR|LD_LIBRARY_PATH|.*_CACHE_(DIR|HOME)|NUMBA_.*")
"""Variables of the environment that a policy's process gets; others may hold secrets."""
END_LIMIT = 5.0  # time (s) within which its process ends by itself where another user's can't be killed
DONE, FAILED = b"+", b"!"
"""First byte of an answer: followed by its content, or by a sentence about the policy's error."""
ACT = b"@"  # first byte of an observation for the policy that was asked last; all other requests are pickled


def find_apart(source: Any, trusted: bool, number: int = 0) -> Any:
    """The policy that a benchmark runs: apart from the plant, or in this process.

    number: of the process among those that run side by side, one for each controlled pantograph. Objects run
    in this process, as do installed policies if they are ``trusted``. Raises InputError where the policy
    doesn't exist or cannot be made.
    """
    if not isinstance(source, str) or (trusted and _installed(source)):
        return find_policy(source)
    return PolicyApart(source, number)


def _installed(source: str) -> bool:
    """Whether a policy is installed, and so are those that its parameters name."""
    return source.partition(":")[0] in policy_names() and not any(code_named(source))


class PolicyApart:
    """A policy in another process. It has the attributes of the policy that say what it wishes."""

    def __init__(self, source: str, number: int = 0) -> None:
        """source: name, model file, or class in a Python file. number: of its process, see ``find_apart``.

        Raises InputError if it cannot be made.
        """
        self._source = source
        self._process = "" if _installed(source) else source, number
        wished = json.loads(self._ask("being loaded", PREPARATION_LIMIT))
        with errors_name(source, "being loaded"):
            run_settings(wished)
        names = {*OBSERVATION_SETTINGS, "washout"}
        vars(self).update({name: value for name, value in wished.items() if name in names})

    def reset(self, context: Context) -> None:
        """Prepare for an episode. Raises InputError if that fails."""
        self._ask("reset", PREPARATION_LIMIT, context)

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action, (actions,), for an observation, (entries,). Raises InputError if the policy fails."""
        return np.frombuffer(self._ask("act", ACT_LIMIT, observation))

    def _ask(self, when: str, limit: float, given: Any = None) -> bytes:
        """Content of the process's answer. Raises PolicyError where it fails, is late or ends."""
        running = _running.get(self._process) or _start(self._process)
        why = f"it took more than {limit:g} s"
        try:
            if when == "act" and running.asked == self._source:  # without pickling, which takes as long again
                running.connection.send_bytes(ACT + given.tobytes())
            else:
                running.connection.send_bytes(pickle.dumps((self._source, when, given)))
                running.asked = self._source
            if running.arrival.poll(1000 * limit):
                answer = running.connection.recv_bytes()
                if answer[:1] == DONE:
                    return answer[1:]
                why = ""
        except (OSError, EOFError):
            with suppress(subprocess.TimeoutExpired):
                running.process.wait(END_LIMIT)
            status = running.process.returncode
            why = "its process ended" if status is None else f"its process ended with status {status}"
            if status is not None and status < 0:
                why = f"its process was killed by {Signals(-status).name}"
        close()
        raise PolicyError(
            f"The policy '{self._source}' failed in {when}: {why}." if why else answer[1:].decode()
        )


@dataclass
class _Running:
    """A process of policies."""

    process: subprocess.Popen[bytes]
    connection: Connection
    arrival: select.poll  # of its answers; a selector made for each takes as long as the answer
    asked: str = ""  # the policy that the last request was for


_running: dict[tuple[str, int], _Running] = {}


@atexit.register
def close() -> None:
    """End this process's policies apart; another user's end as their connections are closed."""
    while _running:
        running = _running.popitem()[1]
        running.connection.close()
        with suppress(PermissionError):
            running.process.kill()
        with suppress(subprocess.TimeoutExpired):
            running.process.wait(END_LIMIT)


def _start(key: tuple[str, int]) -> _Running:
    """Start a process. Raises InputError where that is not possible."""
    if os.name != "posix":
        raise InputError(
            "A policy apart from the plant needs Linux or macOS; only installed policies run without, with "
            "--trusted."
        )
    variables = {name: os.environ[name] for name in filter(ENVIRONMENT.fullmatch, os.environ)}
    variables |= dict.fromkeys((*LINEAR_ALGEBRA_THREADS, "PYTHONUNBUFFERED"), "1")  # see ``in_processes``
    python = os.environ.get(INTERPRETER)
    if python is None:
        python, variables["PYTHONPATH"] = sys.executable, os.pathsep.join(sys.path)
    ours, theirs = Pipe()
    try:
        process = subprocess.Popen(
            [python, "-P", "-m", "panto_baselines.benchmark.apart", str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            stdout=2,  # what a policy prints is no output of the benchmark
            env=variables,
            pass_fds=[theirs.fileno()],
            process_group=0,  # interrupts from the keyboard are left to this process
        )
    except OSError as error:
        raise InputError(
            f"The Python of policies, {python}, can't be started: {error.strerror}; correct {INTERPRETER}."
        ) from error
    finally:
        theirs.close()
    arrival = select.poll()
    arrival.register(ours, select.POLLIN)
    _running[key] = _Running(process, ours, arrival)
    return _running[key]


def _answer(policy: Policy, context: Context | None, source: str, when: str, given: Any) -> bytes:
    """The answer of a policy, under a context or while it is loaded, to what it is given."""
    if when == "being loaded":
        return json.dumps(finite(wishes(policy))).encode()
    with errors_name(source, when):
        if when == "reset":
            policy.reset(given)
            return b""
        assert context is not None
        return checked_action(policy.act(given), (context.actions,)).tobytes()


def main() -> None:
    """Answer the process that started this one, until it closes the connection."""
    connection = Connection(int(sys.argv[1]))
    loaded, policy, context = "", None, None
    with suppress(EOFError, ConnectionError):
        while True:
            request = connection.recv_bytes()
            given: Any
            if request[:1] == ACT:
                source, when, given = loaded, "act", np.frombuffer(bytearray(request[1:]), np.float32)
            else:
                source, when, given = pickle.loads(request)
            try:
                if policy is None or source != loaded or when == "being loaded":
                    loaded, policy = source, find_policy(source)
                context = given if when == "reset" else context
                connection.send_bytes(DONE + _answer(policy, context, source, when, given))
            except InputError as error:
                connection.send_bytes(FAILED + str(error).encode())


if __name__ == "__main__":
    main()
