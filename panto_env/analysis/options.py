"""Options of commands: the settings of a run, and what several commands share."""

from __future__ import annotations

import inspect
import re
import types
from collections.abc import Callable, Sequence
from copy import copy
from functools import wraps
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import typer
from typer.models import OptionInfo

from ..base.errors import InputError
from ..base.table import TABLES
from ..control.settings import fields
from ..metrics.compliance import Criterion, criteria_table, remarks
from ..metrics.figures import FIRST_SETTLED, SpanChoice, check_spans
from ..plant.numerics import Numerics
from ..terminal import console, print_table, writable


def print_criteria(criteria: Sequence[Criterion], title: str) -> None:
    """Print the table of criteria with limits, then notes and values without limits."""
    table = criteria_table(criteria, title)
    if table.rows:
        print_table(table)
    for line in remarks(criteria):
        console.print(line, soft_wrap=True)


RENAMED = {"speed_kmh": "speed", "spans": "line_spans", "faults": "fault"}
"""Options with another name: the unit is in the help, and --spans are the evaluated ones."""
IN_MILLISECONDS = ("time_step",)
"""Options in milliseconds, of settings in seconds."""
OF_TRAINS: dict[str, type] = {"pantograph": str, "distances": float, "controlled": int}
"""Options that may be given several times, and the type of each value. A command without distances takes one
pantograph."""
SEVERAL = OF_TRAINS | {"faults": str}
"""The same, and an option that any command takes several times."""
TEXTS = {"speed_profile": str}
"""Options whose value is read from a text."""
SIMPLE = (bool, int, float, str)
PANELS = ("Line", "Pantograph", "Run", "Output", "Control and learning")
"""Panels of the help, in its order."""
LINE, PANTOGRAPH, RUN, OUTPUT, LEARNING = PANELS
_SETTINGS = {
    LINE: "catenary line_condition spans",
    PANTOGRAPH: "pantograph distances controlled mean_force pantograph_scatter actuator sensors faults",
    LEARNING: "control_interval washout observation harmonics history line_values normalise estimator "
    "known_pantograph reward cost settle",
}
PANEL_OF = {name: panel for panel, names in _SETTINGS.items() for name in names.split()}
"""Panels of settings; others are in that of the run."""
OUTPUTS = {"output", "figures", "droppers", "plot", "html", "force", "live", "json"}
OUTPUTS |= {"first_span", "seconds", "slow_motion", "size"}  # of a film
"""Options of commands in the panel of the output; others that a command has itself are in that of the run."""

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
    names = [name for name in only or filter(_type, fields()) if name not in left_out]
    trains = "distances" in names

    def decorate(command: Command) -> Command:
        @wraps(command)
        def with_options(**given: Any) -> None:
            options = {name: given.pop(RENAMED.get(name, name)) for name in names}
            settings = {
                name: 1e-3 * value if name in IN_MILLISECONDS else value
                for name, value in options.items()
                if value is not None and value != []
            }
            command(_riding(settings) if trains else settings, **given)

        hints = get_type_hints(command, include_extras=True)
        own = [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=_in_panel(name, hints[name]))
            for name, parameter in list(inspect.signature(command).parameters.items())[1:]
        ]
        parameters = sorted((*(_option(name, defaults, trains) for name in names), *own), key=_place)
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


def _riding(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings in which several pantographs are a train, and one with distances is one of equal ones."""
    named = settings.pop("pantograph", None) or []
    if len(named) == 1:
        named = named * (1 + len(settings.get("distances") or ()))
    if len(named) > 1:
        settings["pantographs"] = named
    elif named:
        settings["pantograph"] = named[0]
    return settings


def _type(name: str) -> type | None:
    """Type of an option: that of the default, or the setting's first simple type besides None."""
    if name in SEVERAL or name in TEXTS:
        return (SEVERAL | TEXTS)[name]
    field = fields()[name]
    if type(field.default) in SIMPLE:
        return type(field.default)
    annotation: Any = field.annotation
    members = get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,)
    bare = [get_args(each)[0] if get_origin(each) is Annotated else each for each in members]
    return next((each for each in bare if each in SIMPLE), None)


def _option(name: str, defaults: bool, trains: bool) -> inspect.Parameter:
    field, kind = fields()[name], _type(name)
    several = name in SEVERAL and (trains or name not in OF_TRAINS)
    text = field.description or ""
    if name in IN_MILLISECONDS:
        text = text.replace("(s)", "(ms)", 1)
    text = f"{text[:1].upper()}{text[1:]}."
    if several:
        text += " May be given several times."
    if defaults and field.default not in (None, ()) and kind is not bool:
        text += f" Default: {field.default}."
    option = RENAMED.get(name, name)
    flag = [f"--{option.replace('_', '-')}"] if kind is bool else []
    info = typer.Option(*flag, help=text, rich_help_panel=PANEL_OF.get(name, RUN))
    return inspect.Parameter(
        option,
        inspect.Parameter.KEYWORD_ONLY,
        default=None,
        annotation=Annotated[list[kind] | None if several else kind | None, info],  # type: ignore
    )


def _in_panel(name: str, annotation: Any) -> Any:
    """The annotation of a command's own parameter with its panel, if it is an option."""
    if get_origin(annotation) is not Annotated:
        return annotation
    kind, info, *rest = get_args(annotation)
    if not isinstance(info, OptionInfo):
        return annotation
    info = copy(info)  # of options that commands share
    info.rich_help_panel = OUTPUT if name in OUTPUTS else RUN
    return Annotated[kind, info, *rest]


def _place(parameter: inspect.Parameter) -> tuple[int, bool]:
    """Place of a parameter in the help: arguments, then options by panel, the discretisation at its end."""
    panels = [getattr(each, "rich_help_panel", None) for each in get_args(parameter.annotation)]
    place = next((PANELS.index(panel) for panel in panels if panel in PANELS), -1)
    return place, parameter.name in Numerics.model_fields
