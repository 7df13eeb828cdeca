"""Jobs in processes on this machine, or as tasks of a Ray cluster."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, TypeVar

import typer

from ..analysis.pool import Job, Progress, Take, in_processes
from ..base.errors import InputError
from .tasks import on_ray

T = TypeVar("T")
RayAddress = Annotated[
    str | None,
    typer.Option(
        "--ray",
        metavar="ADDRESS",
        help='Work on a Ray cluster instead: its address, "auto", or "local" for one on this machine only.',
    ),
]
"""Option of a command whose work can run on a cluster."""


def spread(
    jobs: Sequence[Job[T]],
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
    take: Take[T] | None = None,
) -> list[T]:
    """Results of jobs, in the given order; they must not depend on where a job runs.

    workers: processes on this machine, one per core by default. ray: address of a cluster to use instead.
    take: called in this process with the index and the result of each job as soon as it is finished. Raises
    InputError where both are given, and as ``in_processes`` and ``on_ray`` do.
    """
    if ray is None:
        return in_processes(jobs, workers=workers, progress=progress, take=take)
    if workers is not None:
        raise InputError("A Ray cluster has as many workers as CPUs; leave out either workers or ray.")
    return on_ray(jobs, ray, progress=progress, take=take)
