"""The catenaries: one folder per kind, with its data, its construction and its step.

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
    "single",
]
"""Values of ``kind`` in a line's TOML file: the names of the modules."""
CATENARIES: dict[str, CatenaryKind] = {name: import_module(f".{name}", __name__).KIND for name in KINDS}
"""Each kind, by name."""


def check_line(line: CatenaryData) -> None:
    """Raise InputError where a line with these values cannot exist, for example with droppers that push."""
    CATENARIES[line.kind].check(line)
