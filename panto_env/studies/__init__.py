"""What papers and others found, reproduced: each study has ours beside theirs, tables, plots and a JSON."""

from __future__ import annotations

from importlib import import_module

from ..base.errors import InputError, suggest
from ..base.table import Table
from .study import NUMBERS, Comparison, Outcome, Report, Study, check_writable, write

__all__ = [
    "NUMBERS",
    "STUDIES",
    "Comparison",
    "Outcome",
    "Report",
    "Study",
    "Table",
    "check_writable",
    "find_study",
    "write",
]

STUDIES: tuple[str, ...] = (
    "paper1-identification",
    "paper1-control",
    "paper2",
    "paper3-parameters",
    "spacing",
    "permissible",
    "design",
)
"""Names of all studies; that of "paper3-parameters" lies in ``paper3_parameters/study.py``."""


def find_study(name: str) -> Study:
    """The study of this name. Raises InputError where there is none."""
    if name not in STUDIES:
        raise InputError(f"Unknown study '{name}': {suggest(name, [*STUDIES, 'all'])}.")
    study: Study = import_module(f".{name.replace('-', '_')}.study", __name__).run
    return study
