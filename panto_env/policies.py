"""What a policy is, and how it is found by name."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .base import plugins
from .base.errors import InputError
from .base.names import suggest
from .control.context import Context


class Policy(Protocol):
    """Anything with these two methods. It sees observations, never the environment."""

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""


def find_policy(source: Any) -> Policy:
    """Policy from an object, a name, a model file, or a class in a file of yours.

    A name may have parameters, "pd:gain=0.5"; so may a class, "my_controller.py:Name:gain=0.5".

    Raises InputError where there is none such.
    """
    if not isinstance(source, str | Path):
        if hasattr(source, "reset") and hasattr(source, "act"):
            return source  # type: ignore[no-any-return]
        raise InputError(
            f"A policy must have the methods reset and act, or be a name; {source!r} is neither."
        )
    name, _, parameters = str(source).partition(":")
    known = plugins.installed(plugins.POLICIES)
    if name in known:
        return _make(plugins.load(known[name]), str(source), parameters)
    path = Path(source)
    loaders = plugins.installed(plugins.LOADERS)
    if name.endswith(".py"):
        return _policy_from_file(str(source), Path(name), parameters)
    if path.suffix[1:] in loaders:
        if not path.is_file():
            raise InputError(f"The model file {path} does not exist; check the path.")
        loaded: Policy = plugins.load(loaders[path.suffix[1:]])(path)
        return loaded
    raise InputError(
        f"Unknown policy '{source}': {suggest(name, list(known))}; or give the path of a model file "
        f"(.{', .'.join(loaders)}), or of a Python file and a class in it (my_controller.py:Name)."
    )


def _make(maker: Any, source: str, parameters: str) -> Policy:
    try:
        policy: Policy = maker(**_parameters(source, parameters))
    except (TypeError, ValueError) as error:
        raise InputError(f"Policy '{source}' cannot be made: {error}.") from error
    return policy


def _policy_from_file(source: str, path: Path, text: str) -> Policy:
    """Policy of the class that ``text``, "Name" or "Name:key=value,...", names in a Python file."""
    name, _, parameters = text.partition(":")
    if not name:
        raise InputError(f"Policy '{source}' must name a class in the file, as {source}:Name.")
    if not path.is_file():
        raise InputError(f"The Python file {path} does not exist; check the path.")
    try:
        content = runpy.run_path(str(path))
    except Exception as error:
        raise InputError(f"{path} cannot be run: {type(error).__name__}: {error}.") from error
    if not callable(content.get(name)):
        classes = [key for key, value in content.items() if isinstance(value, type)]
        raise InputError(f"{path} has no class '{name}': it has {', '.join(classes) or 'none'}.")
    return find_policy(_make(content[name], source, parameters))


def policy_names() -> list[str]:
    """Names of all installed policies."""
    return list(plugins.installed(plugins.POLICIES))


def _parameters(source: str, text: str) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for part in filter(None, text.split(",")):
        key, equals, value = part.partition("=")
        if not equals:
            raise InputError(f"Policy '{source}': '{part}' must read key=value.")
        try:
            values[key.strip()] = ast.literal_eval(value.strip())
        except (ValueError, SyntaxError):
            values[key.strip()] = value.strip()
    return values
