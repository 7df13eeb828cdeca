"""Plug-ins of installed packages, this one included: policies, loaders of model files, commands.

Each is an entry point, a name and its object, in one of the groups below. One of others may do anything: it
is imported only when it is named, and what it raises becomes an InputError that names its package.
"""

from __future__ import annotations

import re
import traceback
import warnings
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from .errors import InputError, PlugInWarning

POLICIES = "panto_env.policies"
"""A policy's name, and a callable that makes it from keyword parameters."""
LOADERS = "panto_env.policy_loaders"
"""A file suffix without its dot, and a callable that loads a policy from a path."""
COMMANDS = "panto_env.commands"
"""The name of a sub-command of ``panto``, and its function, or a Typer app with sub-commands of its own."""
OWN = "panto-env"
"""The package of this project."""


def installed(group: str, taken: Collection[str] = ()) -> dict[str, EntryPoint]:
    """Entry points of a group by name, sorted; nothing is imported.

    taken: names that are ours without an entry point. Of several of one name ours is taken, else the first
    one; a PlugInWarning says which ones are left out.
    """
    found: dict[str, EntryPoint] = {}
    for point in sorted(entry_points(group=group), key=lambda point: point.name):
        first = found.get(point.name)
        if first is None and point.name not in taken:
            found[point.name] = point
            continue
        if first is not None and is_own(point) and not is_own(first):
            first, point = point, first
            found[first.name] = first
        warnings.warn(
            f"The plug-in '{point.name}' ({group}) of {package(point)} is left out: that name is taken by "
            f"{package(first) if first else OWN}; uninstall one of them, or rename it.",
            PlugInWarning,
            stacklevel=2,
        )
    return found


def package(point: EntryPoint) -> str:
    """Name of the package that an entry point belongs to."""
    return "an unknown package" if point.dist is None else point.dist.name


def is_own(point: EntryPoint) -> bool:
    """Whether an entry point is of this project."""
    return re.sub(r"[-_.]+", "-", package(point)).lower() == OWN


def load(point: EntryPoint) -> Any:
    """The object of an entry point. Raises InputError, which names its package, where it can't be loaded."""
    with blamed(point):
        return point.load()


@contextmanager
def blamed(point: EntryPoint) -> Iterator[None]:
    """Within the body any error becomes an InputError, which names the plug-in, its package and the place."""
    whose = f"The plug-in '{point.name}' of {package(point)}"
    try:
        yield
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        if isinstance(error, ModuleNotFoundError) and error.name is not None:
            how = f"needs the module '{error.name}', which is not installed; install it"
        else:
            how = f"fails {failure(error)}; correct or uninstall it"
        raise InputError(f"{whose} {how}.") from error


def failure(error: BaseException) -> str:
    """Place, class and message of an error in code that is not ours, as a clause."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    words = " ".join(str(error).split()).removesuffix(".")
    return f"at {place.filename}:{place.lineno}: {type(error).__name__}{f': {words}' if words else ''}"
