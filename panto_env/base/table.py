"""A table as data, to be printed in a terminal or written as Markdown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

_NOTHING = re.compile(r"(?<![\w.])[-−](?=0(?:\.0+)?(?![\w.]))")
"""The sign of a number that was rounded to 0."""


class Alarm(str):
    """A cell that reports a problem: a terminal shows it in red."""


@dataclass(frozen=True)
class Table:
    """Rows of text or numbers under headings that name units. Numbers are shown to four digits."""

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str | float, ...]]
    text_columns: int = 1  # number of columns, from the left, that are aligned left; the others right
    section_ends: tuple[int, ...] = ()  # rows, counted from 0, after which a line is drawn

    @property
    def cells(self) -> list[tuple[str, ...]]:
        """The rows as text, in which no zero has a sign."""
        return [tuple(map(_cell, row)) for row in self.rows]

    @property
    def markdown(self) -> str:
        """Headings and rows as a table of Markdown, without the title."""
        right = len(self.headings) - self.text_columns
        rule = (*["---"] * self.text_columns, *["---:"] * right)
        return "\n".join(f"| {' | '.join(row)} |" for row in (self.headings, rule, *self.cells))


def _cell(value: str | float) -> str:
    text = value if isinstance(value, str) else f"{value:.4g}"
    return type(text)(_NOTHING.sub("", text)) if _NOTHING.search(text) else text
