"""The settings of a run as options of a command: names, defaults and help are stated only in the settings."""

from __future__ import annotations

import inspect
import re
import types
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import typer

from ..base.errors import InputError
from ..base.table_file import TABLES
from ..control.settings import fields
from ..metrics.spans import FIRST_SETTLED, SpanChoice, check_spans
from ..terminal import writable

RENAMED = {"speed_kmh": "speed", "spans": "line_spans"}
"""Options with another name: the unit is in the help, and --spans are the evaluated ones."""
OTHER_UNITS = {"time_step": ("s", "ms", 1e-3)}
"""Options in another unit than the setting: the setting's unit, the option's unit, and the factor."""
SIMPLE = (bool, int, float, str)

SPAN = re.compile("[0-9]{1,9}")
"""Number of a span; Python would also accept the digits of other alphabets."""

Spans = Annotated[
    str | None,
    typer.Option(
        help="Spans that the figures cover: first-last, e.g. 5-6, or all; by default those after the start "
        f"has died out, from {FIRST_SETTLED} on."
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of irregularity and noise.")]
FiguresFile = Annotated[
    str | None,
    typer.Option(
        help=f"Write figures and requirements to this file ({', '.join(TABLES)}).", callback=writable(TABLES)
    ),
]
DroppersFile = Annotated[
    str | None,
    typer.Option(
        help=f"Write the droppers' forces at rest and in the run, lengths and stretches to this file "
        f"({', '.join(TABLES)}).",
        callback=writable(TABLES),
    ),
]
Command = Callable[..., None]


def with_settings(
    only: Sequence[str] | None = None, left_out: Sequence[str] = (), defaults: bool = True
) -> Callable[[Command], Command]:
    """Decorator that gives a command an option for each setting of a run, or only for some.

    The command's first argument, ``settings``, receives the values given on the command line, by the names
    of the settings. Its other arguments become arguments and options as usual. defaults: whether options that
    are not given have their default, which the help then shows.
    """
    names = [name for name in only or _names() if name not in left_out]

    def decorate(command: Command) -> Command:
        @wraps(command)
        def with_options(**given: Any) -> None:
            options = {name: given.pop(RENAMED.get(name, name)) for name in names}
            settings = {
                name: _to_setting(name, value) for name, value in options.items() if value is not None
            }
            command(settings, **given)

        hints = get_type_hints(command, include_extras=True)
        own = [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[parameter.name])
            for parameter in list(inspect.signature(command).parameters.values())[1:]
        ]
        required = [parameter for parameter in own if parameter.default is inspect.Parameter.empty]
        optional = [parameter for parameter in own if parameter.default is not inspect.Parameter.empty]
        parameters = [*required, *(_option(name, defaults) for name in names), *optional]
        with_options.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        with_options.__annotations__ = {each.name: each.annotation for each in parameters}
        return with_options

    return decorate


def parse_spans(text: str | None) -> SpanChoice:
    """Spans from "5-6" or "all". Raises InputError where the text is neither."""
    if text is None:
        return None
    if text == "all":
        return "all"
    first, dash, last = (part.strip() for part in text.partition("-"))
    if not (dash and SPAN.fullmatch(first) and SPAN.fullmatch(last)):
        raise InputError(f"--spans must read first-last, e.g. 5-6, or all, not '{text}'.")
    spans = int(first), int(last)
    check_spans(spans)
    return spans


def _names() -> list[str]:
    """Settings that can be given by a word or a number."""
    return [name for name in fields() if _type(name) is not None]


def _type(name: str) -> type | None:
    """Type of an option: that of the default, or the setting's first simple type besides None."""
    field = fields()[name]
    if type(field.default) in SIMPLE:
        return type(field.default)
    annotation: Any = field.annotation
    members = get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,)
    bare = [get_args(each)[0] if get_origin(each) is Annotated else each for each in members]
    return next((each for each in bare if each in SIMPLE), None)


def _option(name: str, defaults: bool) -> inspect.Parameter:
    field, kind = fields()[name], _type(name)
    text = field.description or ""
    if name in OTHER_UNITS:
        unit, shown, _ = OTHER_UNITS[name]
        text = text.replace(f"({unit})", f"({shown})", 1)
    text = f"{text[:1].upper()}{text[1:]}."
    if defaults and field.default is not None and kind is not bool:
        text += f" Default: {field.default}."
    option = RENAMED.get(name, name)
    flag = [f"--{option.replace('_', '-')}"] if kind is bool else []
    info = typer.Option(*flag, help=text)
    return inspect.Parameter(
        option,
        inspect.Parameter.KEYWORD_ONLY,
        default=None,
        annotation=Annotated[kind | None, info],  # type: ignore[operator]
    )


def _to_setting(name: str, value: Any) -> Any:
    return value * OTHER_UNITS[name][2] if name in OTHER_UNITS else value
