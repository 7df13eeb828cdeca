"""Plug-ins of installed packages, this one included: policies, loaders of model files, commands.

Each is an entry point, a name and its object, in one of the groups below.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from .errors import InputError

POLICIES = "panto_env.policies"
"""A policy's name, and a callable that makes it from keyword parameters."""
LOADERS = "panto_env.policy_loaders"
"""A file suffix without its dot, and a callable that loads a policy from a path."""
COMMANDS = "panto_env.commands"
"""The name of a sub-command of ``panto``, and its function, or a Typer app with sub-commands of its own."""


def installed(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name, sorted; nothing is imported."""
    return {point.name: point for point in sorted(entry_points(group=group), key=lambda point: point.name)}


def load(point: EntryPoint) -> Any:
    """The object of an entry point. Raises InputError where a package is missing."""
    try:
        return point.load()
    except ImportError as error:
        raise InputError(
            f"'{point.name}' needs a package that is not installed ({error}); "
            "install panto-env with the extra 'agents'."
        ) from error
