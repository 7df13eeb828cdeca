"""The catenaries: one folder per kind, with what it is made of, how it is built, and its step.

A new kind is a module or folder here, with a schema, a ``CatenaryModel``, its sources of the operations of
``protocol`` and a ``KIND``; and its name in ``KINDS``.
"""

from __future__ import annotations

from importlib import import_module

from .protocol import CatenaryKind, CatenaryModel
from .schema import CatenaryData

__all__ = ["CATENARIES", "KINDS", "CatenaryData", "CatenaryKind", "CatenaryModel", "check_line"]

KINDS = [
    "flexible",
    "three_span",
    "periodic_stiffness",
    "rig",
]
"""Words that a line's TOML file may have under ``kind``: the names of the modules."""
CATENARIES: dict[str, CatenaryKind] = {name: import_module(f".{name}", __name__).KIND for name in KINDS}
"""Kinds by name."""


def check_line(line: CatenaryData) -> None:
    """Raise InputError where a line of these values cannot exist, such as one whose droppers would push."""
    CATENARIES[line.kind].check(line)
