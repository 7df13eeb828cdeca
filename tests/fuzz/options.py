"""The options of every command of ``panto``, as its own functions declare them."""

from __future__ import annotations

import inspect
import types
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

import typer
from typer.models import ArgumentInfo, ParameterInfo

from panto_env.base import plugins
from panto_env.cli import make_app


class Parameter(NamedTuple):
    """One option or argument of a command."""

    command: tuple[str, ...]  # words after "panto"
    flag: str  # as "--speed"; "" for an argument
    kind: type  # bool, int, float, str, Path, an Enum, or tuple for several values


def parameters() -> list[Parameter]:
    """All of them, in the order in which the help shows them."""
    app = make_app()
    for name, point in plugins.installed(plugins.COMMANDS).items():
        command = plugins.load(point)
        app.add_typer(command, name=name) if isinstance(command, typer.Typer) else app.command(name)(command)
    return list(_of_app(app, ()))


def _of_app(app: typer.Typer, before: tuple[str, ...]) -> Iterator[Parameter]:
    for command in app.registered_commands:
        assert command.callback is not None
        name = command.name or command.callback.__name__.replace("_", "-")
        yield from _of_function(command.callback, (*before, name))
    for group in app.registered_groups:
        assert group.typer_instance is not None
        yield from _of_app(group.typer_instance, (*before, str(group.name)))


def _of_function(function: Any, command: tuple[str, ...]) -> Iterator[Parameter]:
    hints = inspect.get_annotations(inspect.unwrap(function), eval_str=True)
    for parameter in inspect.signature(function).parameters.values():
        annotation = parameter.annotation
        if isinstance(annotation, str):
            annotation = hints[parameter.name]
        if get_origin(annotation) is not Annotated:
            continue
        kind, info = get_args(annotation)[:2]
        if isinstance(info, ParameterInfo):
            yield Parameter(command, _flag(parameter.name, info), _bare(kind))


def _flag(name: str, info: ParameterInfo) -> str:
    if isinstance(info, ArgumentInfo):
        return ""
    declared = [info.default, *(info.param_decls or ())]
    flags = [each for each in declared if isinstance(each, str) and each.startswith("--")]
    return flags[0] if flags else "--" + name.replace("_", "-")


def _bare(kind: Any) -> type:
    """The type of one value: without None, and without the list of what can be given again."""
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(each for each in get_args(kind) if each is not type(None))
    if get_origin(kind) is list:
        kind = get_args(kind)[0]
    if get_origin(kind) is tuple:
        return tuple
    assert kind in (bool, int, float, str, Path) or issubclass(kind, Enum)
    return kind
