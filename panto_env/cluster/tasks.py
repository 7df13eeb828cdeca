"""Jobs as tasks of a Ray cluster. Ray, an extra, is imported only when it is used."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from ..analysis.pool import LINEAR_ALGEBRA_THREADS, Job, Progress, Take, collect
from ..backend.cache import source_hash
from ..base.errors import InputError, shown
from ..base.machine import cores

T = TypeVar("T")
LOCAL = "local"
"""Address of a cluster on this machine only, which is started for the jobs and ends with them."""
RETRIES = 5
"""Maximum number of retries of a job whose worker or machine died."""
PATIENCE = 10.0
"""Time (s) within which the head of a cluster must answer."""
OBJECT_STORE = 256 * 2**20
"""Shared memory of a local cluster (bytes): results are small; by default Ray takes a third of the memory."""


class Home(NamedTuple):
    """Sources and folder of the process that submits the jobs."""

    sources: str  # hash of our source files
    folder: Path  # base of relative paths in jobs


def on_ray(
    jobs: Sequence[Job[T]],
    address: str,
    *,
    progress: Progress | None = None,
    take: Take[T] | None = None,
) -> list[T]:
    """Results of jobs, in the given order, that run as tasks of a Ray cluster, one on each of its CPUs.

    address: of the cluster's head, e.g. "10.0.0.5:6379"; "auto" for the one on this machine; or LOCAL. A job
    whose worker or machine dies is run again, so a repeated job must give the same result.

    Raises a job's error, and InputError where Ray is not installed, this process is already connected to it,
    there is no cluster, one of its machines cannot load a job or has other sources than this one, or a job
    lost its worker more than RETRIES times. Jobs that still run are then stopped.
    """
    ray = _ray()
    home = Home(source_hash(), Path.cwd())
    with _connected(ray, address):
        # An error of the job itself is final: it would be the same again.
        task = ray.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=False)(_run)
        try:
            return collect([task.remote(job, home).future() for job in jobs], progress, take)
        except ray.exceptions.RayTaskError as error:
            if isinstance(error.cause, ray.exceptions.RaySystemError):
                raise InputError(
                    f"A machine of the Ray cluster could not load a job ({_reason(error.cause)}); install "
                    "the same packages everywhere."
                ) from error
            raise error.cause from error
        except ray.exceptions.RayError as error:
            raise InputError(
                f"A job was started {RETRIES + 1} times on the Ray cluster and lost each time "
                f"({_reason(error)}); make sure that a worker has enough memory, or run it without --ray."
            ) from error


def _run(job: Job[T], home: Home) -> T:
    """Run a job in a worker. Raises InputError where the worker has other sources."""
    if source_hash() != home.sources:
        raise InputError(
            f"The machine {socket.gethostname()} of the Ray cluster has other sources of panto-env, or "
            "another Numba, than this one; install the same everywhere."
        )
    # Where the folder is not shared, a job with a relative path finds no file, and says so.
    if home.folder.is_dir():
        os.chdir(home.folder)
    return job()


def _reason(error: Exception) -> str:
    """The first line of an error message of Ray, as part of a sentence."""
    return str(error).strip().partition("\n")[0].rstrip(".")


def _ray() -> Any:
    """The package Ray. Raises InputError where it is not installed."""
    try:
        import ray
    except ImportError as error:
        raise InputError(
            f"A cluster needs Ray, which is not installed ({error}); install panto-env with its extra 'ray'."
        ) from error
    return ray


@contextmanager
def _connected(ray: Any, address: str) -> Iterator[None]:
    """Within the body this process is connected to a cluster; at the end tasks that still run are stopped."""
    if ray.is_initialized():
        raise InputError("This process is connected to a Ray cluster already; call ray.shutdown() before.")
    variables = dict.fromkeys(LINEAR_ALGEBRA_THREADS, "1")  # for the reason see ``in_processes``
    settings: dict[str, Any] = {"logging_level": "ERROR", "runtime_env": {"env_vars": variables}}
    if address == LOCAL:
        # By default Ray reports each cluster to its makers.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        settings |= {"num_cpus": cores(), "include_dashboard": False, "object_store_memory": OBJECT_STORE}
    try:
        host, colon, port = address.rpartition(":")
        if colon and port.isdigit() and "/" not in host:  # otherwise Ray itself tries for many minutes
            socket.create_connection((host, int(port)), PATIENCE).close()
        ray.init(address=address, **settings)
    except (ImportError, OSError, RuntimeError, ValueError) as error:  # a ConnectionError is an OSError
        raise InputError(
            f"No Ray cluster could be joined at {shown(address)} ({_reason(error)}); start one by "
            f"`ray start --head`, or give {LOCAL!r}."
        ) from error
    try:
        yield
    finally:
        ray.shutdown()
