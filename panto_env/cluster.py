"""Jobs in processes or on a Ray cluster, an extra, and works whose parts are files, to be continued."""

from __future__ import annotations

import json
import os
import shutil
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from .analysis.pool import LINEAR_ALGEBRA_THREADS, Job, Progress, collect, in_processes
from .backend.cache import source_hash
from .base.checksums import __version__, commit, read_checked, write_checked
from .base.errors import InputError, shown
from .base.extras import require
from .base.files import make_folder
from .base.machine import cores

T = TypeVar("T")
LOCAL = "local"
"""Address of a cluster on this machine only, which is started for the jobs and ends with them."""
RETRIES = 5
"""Maximum number of retries of a job whose worker or machine died."""


def spread(
    jobs: Sequence[Job[T]],
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> list[T]:
    """Results of jobs, in the given order; they must not depend on where a job runs.

    workers: processes on this machine, one per core by default. ray: address of a cluster to use instead,
    one task on each of its CPUs: that of its head, e.g. "10.0.0.5:6379"; "auto" for the one on this machine;
    or LOCAL. There a job whose worker or machine dies is run again, so a repeated job must give the same
    result.

    Raises a job's error, and InputError where both are given, as ``in_processes`` does, and where Ray is not
    installed, this process is already connected to it, there is no cluster, one of its machines cannot load a
    job or has other sources than this one, or a job lost its worker more than RETRIES times. Jobs that still
    run are then stopped.
    """
    if ray is None:
        return in_processes(jobs, workers=workers, progress=progress)
    if workers is not None:
        raise InputError("A Ray cluster has as many workers as CPUs; leave out either workers or ray.")
    with _connected(ray) as package:
        # An error of the job itself is final: it would be the same again.
        task = package.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=False)(_run)
        try:
            home = source_hash(), Path.cwd()
            return collect([task.remote(job, *home).future() for job in jobs], progress)
        except package.exceptions.RayTaskError as error:
            if isinstance(error.cause, package.exceptions.RaySystemError):
                raise InputError(
                    f"A machine of the Ray cluster could not load a job ({_reason(error.cause)}); install "
                    "the same packages everywhere."
                ) from error
            raise error.cause from error
        except package.exceptions.RayError as error:
            raise InputError(
                f"A job was started {RETRIES + 1} times on the Ray cluster and lost each time "
                f"({_reason(error)}); make sure that a worker has enough memory, or run it without --ray."
            ) from error


def _run(job: Job[T], sources: str, folder: Path) -> T:
    """Run a job in a worker, in the folder of the caller. InputError where its sources are other ones."""
    if source_hash() != sources:
        raise InputError(
            f"The machine {socket.gethostname()} of the Ray cluster has other sources of panto-env, or "
            "another Numba, than this one; install the same everywhere."
        )
    # Where the folder is not shared, a job with a relative path finds no file, and says so.
    if folder.is_dir():
        os.chdir(folder)
    return job()


def _reason(error: Exception) -> str:
    return str(error).strip().partition("\n")[0].rstrip(".")


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    """Ray, connected to a cluster within the body; at the end tasks that still run are stopped."""
    require("A cluster", "ray", "ray")
    import ray

    if ray.is_initialized():
        raise InputError("This process is connected to a Ray cluster already; call ray.shutdown() before.")
    variables = dict.fromkeys(LINEAR_ALGEBRA_THREADS, "1")  # for the reason see ``in_processes``
    settings: dict[str, Any] = {"logging_level": "ERROR", "runtime_env": {"env_vars": variables}}
    if address == LOCAL:
        # By default Ray reports each cluster to its makers, and takes a third of the memory for results.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        settings |= {"num_cpus": cores(), "include_dashboard": False, "object_store_memory": 256 * 2**20}
    try:
        host, colon, port = address.rpartition(":")
        if colon and port.isdigit() and "/" not in host:  # otherwise Ray itself tries for many minutes
            socket.create_connection((host, int(port)), timeout=10.0).close()
        ray.init(address=address, **settings)
    except (ImportError, OSError, RuntimeError, ValueError) as error:  # a ConnectionError is an OSError
        raise InputError(
            f"No Ray cluster could be joined at {shown(address)} ({_reason(error)}); start one by "
            f"`ray start --head`, or give {LOCAL!r}."
        ) from error
    try:
        yield ray
    finally:
        ray.shutdown()


RayAddress = Annotated[
    str | None,
    typer.Option(
        "--ray",
        metavar="ADDRESS",
        help='Work on a Ray cluster instead: its address, "auto", or "local" for one on this machine only.',
    ),
]
"""Option of a command whose work can run on a cluster."""


PartJob = Callable[[Path], None]
"""Work that writes its result to a path, whole or not at all: for other processes a ``functools.partial``."""
PARTS = ".parts"
"""Folder in the output for the parts of each data set; hidden, so that Minari does not read it."""
IDENTITY = "identity.json"


def identity(kind: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that determines the results of a work, as plain data."""
    made_by = {"version": __version__, "commit": commit(), "sources": source_hash()}
    return {"kind": kind, **made_by, "settings": json.loads(json.dumps(settings))}


def open_parts(folder: Path, made_of: Mapping[str, Any]) -> None:
    """Make the folder of a work's parts, or continue it; made_of: from ``identity``.

    Raises InputError where it holds parts of another work.
    """
    make_folder(folder)
    path = folder / IDENTITY
    if not path.is_file():
        write_checked(path, made_of)
        return
    difference = first_difference(read_checked(path), made_of)
    if difference:
        raise InputError(
            f"{folder} holds parts of another work ({difference}); finish that one, remove the folder, or "
            "use another --output."
        )


def make_parts(
    jobs: Mapping[Path, PartJob],
    read: Callable[[Path], object],
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Make all files, each by its job; existing files that are whole are kept.

    read: reads a file, and raises InputError where it is missing or damaged; such a file is made again.
    workers, ray: as in ``spread``. progress: called with the numbers of existing and of all files.
    """
    missing = dict(jobs)
    for path in jobs:
        with suppress(InputError):
            read(path)
            del missing[path]
    kept = len(jobs) - len(missing)
    if progress is not None:
        progress(kept, len(jobs))
    if missing:
        told = None if progress is None else lambda done, _: progress(kept + done, len(jobs))
        todo = [partial(job, path) for path, job in missing.items()]
        spread(todo, workers=workers, ray=ray, progress=told)


def remove_parts(folder: Path) -> None:
    """Remove a folder of parts that are no longer needed."""
    shutil.rmtree(folder, ignore_errors=True)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder if it is empty."""
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def first_difference(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """The first difference of two identities, as a clause; "" for none."""
    before, now = ({**each, **each.get("settings", {})} for each in (old, new))
    for key in sorted(before.keys() | now.keys()):
        if key != "settings" and before.get(key) != now.get(key):
            texts = [json.dumps(each.get(key)) for each in (before, now)]
            one, other = (text if len(text) <= 60 else f"{text[:57]}..." for text in texts)
            return f"its {key} is {one}, this is {other}"
    return ""


__all__ = ["RayAddress", "spread"]
