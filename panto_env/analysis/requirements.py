"""Printing of a run's requirements."""

from __future__ import annotations

from collections.abc import Sequence

from ..metrics.criterion import Criterion, criteria_table, remarks
from ..terminal import console, print_table


def print_criteria(criteria: Sequence[Criterion], title: str) -> None:
    """Print the table of criteria with limits, then notes and values without limits."""
    table = criteria_table(criteria, title)
    if table.rows:
        print_table(table)
    for line in remarks(criteria):
        console.print(line, soft_wrap=True)
