"""Settings as keyword arguments of a class: names, defaults and types are stated only in the settings."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from functools import wraps
from typing import Any, Concatenate, ParamSpec

from ..base.errors import nearest
from .settings import RunSettings, fields

P = ParamSpec("P")


def takes(
    kind: Callable[P, RunSettings], others: Collection[str] = (), taker: str = ""
) -> Callable[[Callable[[Any, dict[str, Any]], None]], Callable[Concatenate[Any, P], None]]:
    """Decorator that gives an ``__init__`` the keyword arguments of a class of settings.

    The decorated function receives the given arguments by name. An unknown one raises TypeError.
    """
    settings: type[RunSettings] = kind  # type: ignore[assignment]

    def decorate(
        initialise: Callable[[Any, dict[str, Any]], None],
    ) -> Callable[Concatenate[Any, P], None]:
        @wraps(initialise)
        def with_keywords(self: Any, /, *arguments: Any, **given: Any) -> None:
            if arguments:
                raise TypeError(f"{type(self).__name__}() takes arguments by name, such as catenary='re250'")
            for name in given.keys() & others:
                raise TypeError(f"{type(self).__name__}() has no argument '{name}', which {taker} takes")
            check_arguments(given, settings, type(self).__name__)
            initialise(self, given)

        own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
        with_keywords.__signature__ = inspect.Signature([own, *parameters(settings)])  # type: ignore[attr-defined]
        return with_keywords

    return decorate


def parameters(kind: type[RunSettings] = RunSettings) -> list[inspect.Parameter]:
    """The settings as keyword-only parameters of a signature."""
    return [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=field.get_default())
        for name, field in fields(kind).items()
    ]


def check_arguments(given: Mapping[str, Any], kind: type[RunSettings], function: str) -> None:
    """Raise TypeError for a name that is not a setting, as Python does for an unknown argument."""
    for name in given:
        if name not in kind.model_fields:
            near = nearest(name, list(kind.model_fields))
            hint = f"; did you mean {near}?" if near else f"; known are {', '.join(fields(kind))}"
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'{hint}")


def table(kind: type[RunSettings] = RunSettings) -> str:
    """The settings as a Markdown table for a docstring."""
    rows = [
        f"| `{name}` | `{field.get_default()!r}` | {field.description} |"
        for name, field in fields(kind).items()
    ]
    return "\n".join(("| Argument | Default | Meaning |", "|---|---|---|", *rows))
