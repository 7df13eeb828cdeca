"""Policies: their interface, how they are found by name, and how errors in their code are reported."""

from __future__ import annotations

import inspect
import os
import runpy
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from .base import plugins
from .base.arrays import Array
from .base.errors import InputError, shortly, shown, suggest
from .base.settings import parse_inline
from .control.arguments import numbers
from .control.observation import OBSERVATION_SETTINGS, Context
from .control.settings import RunSettings

OTHER = "policy="
"""Parameter of a policy around another one: the other's name."""
MODELS = ".safetensors"
"""Suffix of model files that hold no code."""


class PolicyError(InputError):
    """A policy failed: one sentence that names it."""


class Policy(Protocol):
    """Any object with these two methods. It gets observations, never the environment.

    It may have attributes ``observation``, ``harmonics``, ``history``, ``front``, ``memory``,
    ``memory_spans``, ``line_values`` and ``normalise``, settings of its observation, and ``washout``, 0
    unless it has one: a run takes these unless it is given others.
    """

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""


def find_policy(source: Any) -> Policy:
    """Policy from an object, a name, a model file, or a class in a Python file.

    A name may have parameters, "pd:gain=0.5"; so may a class, "my_controller.py:Name:gain=0.5". Of a policy
    around another one, with a class attribute ``AROUND_ANOTHER``, that one's name may follow:
    "guarded:pd:gain=0.5". A file is run once in a process, and again after it has changed.

    Raises InputError where the policy does not exist.
    """
    if not isinstance(source, str | Path):
        if hasattr(source, "reset") and hasattr(source, "act"):
            return source  # type: ignore[no-any-return]
        raise InputError(
            f"A policy must have the methods reset and act, or be a name; {shown(source)} is neither."
        )
    name, _, parameters = str(source).partition(":")
    path = Path(source)
    kind, point = _kind(str(source))
    if kind == "code":
        return _policy_from_file(str(source), Path(name), parameters)
    if point is None:
        loaders = plugins.installed(plugins.LOADERS)
        raise InputError(
            f"Unknown policy '{source}': {suggest(name, policy_names())}; or give the path of a model file "
            f"(.{', .'.join(loaders)}), or of a Python file and a class in it (my_controller.py:Name)."
        )
    if kind == "installed":
        maker = _maker(point)
        if getattr(maker, "AROUND_ANOTHER", False) and not parameters.startswith(OTHER):
            parameters = f"{OTHER}{parameters!r}"
        return _make(maker, str(source), parameters)
    if not os.path.isfile(path):
        raise InputError(f"The model file {path} does not exist; check the path.")
    with plugins.blamed(point):
        loaded: Policy = plugins.load(point)(path)
    return loaded


def _kind(source: str) -> tuple[Literal["installed", "code", "model", "unknown"], EntryPoint | None]:
    """What a policy's name stands for, and the plug-in that makes or loads it, if any."""
    name = source.partition(":")[0]
    if point := plugins.installed(plugins.POLICIES).get(name):
        return "installed", point
    if name.endswith(".py"):
        return "code", None
    loader = plugins.installed(plugins.LOADERS).get(Path(source).suffix[1:])
    return ("model" if loader else "unknown"), loader


def check_named(policy: str, where: str | Path) -> None:
    """Raise InputError where a policy that a file names would run code from a path.

    Anyone may have written the file, and the code would have all rights of the user, who has not named it.
    Our own model files hold no code; those of other loaders may. where: the file, for the message.
    """
    for name in code_named(policy):
        raise InputError(
            f"{where} names the policy {shown(name)}, but a file may name only installed policies and "
            f"model files ({MODELS}): code from a path runs only where you name it yourself, on the command "
            "line or in Python."
        )


def code_named(policy: str) -> Iterator[str]:
    """Names within that of a policy, or this one itself, whose code comes from a path."""
    kind, _ = _kind(policy)
    if kind == "installed":  # its parameters may name others
        for name in _named_in(policy.partition(":")[2]):
            yield from code_named(name)
    if kind == "code" or (kind == "model" and Path(policy).suffix != MODELS):
        yield policy


def _named_in(parameters: str) -> Iterator[str]:
    """What may be names of policies in the parameters of another one."""
    yield parameters
    try:
        given = parse_inline(parameters)
    except InputError:
        return
    yield from (value for value in given.values() if isinstance(value, str))


def wishes(policy: Any) -> dict[str, Any]:
    """Settings that a policy requests by its attributes, by name: of its observation, and the washout.

    A policy without an attribute ``washout`` commands forces as they are.
    """
    requested = {name: getattr(policy, name, None) for name in OBSERVATION_SETTINGS}
    found = {name: value for name, value in requested.items() if value is not None}
    return found | {"washout": getattr(policy, "washout", 0.0)}


def find_fitting_policy(source: Any, settings: RunSettings) -> Policy:
    """Policy as ``find_policy`` gives it.

    Raises InputError, a clause, unless the settings have all that it requests.
    """
    policy = find_policy(source)
    for key, requested in wishes(policy).items():
        offered = getattr(settings, key)
        if requested != offered:
            raise InputError(
                f"the policy '{source}' needs {key} = {shown(requested)}, but the environment has "
                f"{shown(offered)}; set it to what the policy needs"
            )
    return policy


def with_parameters(source: str, parameters: str) -> str:
    """A policy's name with parameters, "key=value,...", added to those that it may have."""
    name = source.partition(":")[0]
    colons = 2 if name.endswith(".py") else 1  # the last one is before the parameters
    return f"{source}{',' if source.count(':') >= colons else ':'}{parameters}"


def policy_names() -> list[str]:
    """Names of all installed policies."""
    return list(plugins.installed(plugins.POLICIES))


def maker_of(name: str) -> Callable[..., Policy]:
    """The class or function that makes an installed policy from its parameters.

    Raises InputError, which names its package, where it can't be loaded or is neither.
    """
    return _maker(plugins.installed(plugins.POLICIES)[name])


def _maker(point: EntryPoint) -> Callable[..., Policy]:
    with plugins.blamed(point):
        maker: Callable[..., Policy] = plugins.load(point)
        parameters_of(maker)
    return maker


def parameters_of(maker: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """The parameters of a policy, by name."""
    return inspect.signature(maker).parameters


@contextmanager
def errors_name(policy: str, method: str) -> Iterator[None]:
    """Within the body errors of a policy become a PolicyError that names it, the method, file and line."""
    try:
        yield
    except PolicyError:
        raise
    except InputError as error:
        raise PolicyError(f"The policy '{policy}' failed in {method}: {error}") from error
    except Exception as error:  # a policy is foreign code
        raise PolicyError(f"The policy '{policy}' failed in {method}, {plugins.failure(error)}.") from error


def checked_action(returned: Any, shape: tuple[int, ...]) -> Array:
    """A policy's answer as an array of floats. Raises InputError unless it is finite and has this shape."""
    action: Array | None = numbers(returned)
    if action is None or action.shape != shape or not np.isfinite(action).all():
        raise InputError(f"its action must be finite numbers of shape {shape}, not {shortly(returned)}.")
    return action


def _make(maker: Any, source: str, text: str) -> Policy:
    try:
        given = parse_inline(text)
    except InputError as error:
        raise InputError(f"Policy '{source}': {error}") from error
    known = parameters_of(maker)
    takes_any = any(parameter.kind is parameter.VAR_KEYWORD for parameter in known.values())
    for name in () if takes_any else given:
        if name not in known:
            which = suggest(name, list(known)) if known else "it has none"
            raise InputError(f"Policy '{source}' has no parameter '{name}': {which}.")
    try:
        policy: Policy = maker(**given)
    except (TypeError, ValueError) as error:
        raise InputError(f"Policy '{source}' cannot be made: {str(error).removesuffix('.')}.") from error
    except Exception as error:
        raise InputError(f"Policy '{source}' cannot be made, {plugins.failure(error)}.") from error
    return policy


def _policy_from_file(source: str, path: Path, text: str) -> Policy:
    """Policy of the class that ``text``, "Name" or "Name:key=value,...", names in a Python file."""
    name, _, parameters = text.partition(":")
    if not name:
        raise InputError(f"Policy '{source}' must name a class in the file, as {path}:Name.")
    if not os.path.isfile(path):
        raise InputError(f"The Python file {path} does not exist; check the path.")
    content = _run_file(path.resolve(), path.stat().st_mtime_ns)
    if not callable(content.get(name)):
        classes = [key for key, value in content.items() if isinstance(value, type)]
        raise InputError(f"{path} has no class '{name}': it has {', '.join(classes) or 'none'}.")
    return find_policy(_make(content[name], source, parameters))


@cache
def _run_file(path: Path, _modified: int) -> dict[str, Any]:
    """Names and values of a Python file that has been run."""
    try:
        return runpy.run_path(str(path))
    except (Exception, SystemExit) as error:
        raise InputError(f"{path} cannot be run, {plugins.failure(error)}.") from error
