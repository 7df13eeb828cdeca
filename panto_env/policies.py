"""What a policy is, and how it is found by name."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .base import plugins
from .base.errors import InputError
from .base.settings import suggest
from .control.context import Context


class Policy(Protocol):
    """Anything with these two methods. It sees observations, never the environment."""

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""


def find_policy(source: Any) -> Policy:
    """Policy from an object, a name ("pd"), a name with parameters ("pd:gain=0.5") or a model file.

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
        maker = plugins.load(known[name])
        try:
            policy: Policy = maker(**_parameters(str(source), parameters))
        except (TypeError, ValueError) as error:
            raise InputError(f"Policy '{source}' cannot be made: {error}.") from error
        return policy
    path = Path(source)
    loaders = plugins.installed(plugins.LOADERS)
    if path.suffix[1:] in loaders:
        if not path.is_file():
            raise InputError(f"The model file {path} does not exist; check the path.")
        loaded: Policy = plugins.load(loaders[path.suffix[1:]])(path)
        return loaded
    raise InputError(
        f"Unknown policy '{source}': {suggest(name, list(known))}; or give the path of a model file "
        f"(.{', .'.join(loaders)})."
    )


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
