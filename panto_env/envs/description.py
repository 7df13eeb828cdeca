"""Tables of arguments, ids and observations in the environment's docstring."""

from __future__ import annotations

from ..catalog import load_pantograph
from ..control.arguments import table
from ..control.entries import CENTRED, EntryOptions
from ..control.observation import layout
from ..control.settings import default
from ..plant.actuators import actuator_settings
from .ids import IDS
from .settings import EnvironmentSettings


def described(text: str) -> str:
    """A description with its tables inserted."""
    return text.format(
        in_service=_indented(_id_table("Pantograph-v0")),
        centred=_indented(_observation_table(CENTRED)),
        observation=_indented(_observation_table(default("observation"))),
        arguments=_indented(table(EnvironmentSettings)),
    )


def _observation_table(kind: str) -> str:
    """The entries of an observation as a Markdown table."""
    actuator, pantograph = actuator_settings(default("actuator")), load_pantograph(default("pantograph"))
    entries = layout(kind, EntryOptions(actuator, pantograph)).entries
    rows = [
        f"| {k} | {each.name} | {each.centre:g} | {each.scale:g} {each.unit} |"
        for k, each in enumerate(entries)
    ]
    return "\n".join(
        ("| Num | Observation | Centre | Scale |", "|-----|-------------|--------|-------|", *rows)
    )


def _id_table(name: str) -> str:
    """Arguments that an id sets, as a Markdown table."""
    rows = [f"| `{key}` | `{value!r}` |" for key, value in IDS[name].items()]
    return "\n".join(("| Argument | Value |", "|----------|-------|", *rows))


def _indented(text: str) -> str:
    return text.replace("\n", "\n    ")
