"""Pages of docs/ that show what a study prints: their tables, and how they are compared with it."""

from __future__ import annotations

import math
import re
from pathlib import Path

from panto_env.studies import Outcome, Table

DOCS = Path(__file__).parents[1] / "docs"
HAMMERS = 10.0  # CL (%) above which a control hammers the wire, and rounding alone moves its figures
MOVES = 0.05  # by how much of themselves, as the pages say


def tables_of(page: str) -> dict[str, tuple[list[str], list[list[str]]]]:
    """Headings and rows of the tables of a page that have a title above them, in italics."""
    text = (DOCS / page).read_text(encoding="utf-8")
    shown = {}
    for title, block in re.findall(r"^\*(.+)\*\n\n((?:\|.*\n)+)", text, re.MULTILINE):
        headings, _, *rows = ([cell.strip() for cell in line[1:-1].split("|")] for line in block.splitlines())
        shown[title] = headings, rows
    return shown


def statements_table(title: str, headings: tuple[str, ...], outcome: Outcome) -> Table:
    """The paper's statements beside ours, as a page shows them."""
    rows = [
        (
            item.quantity,
            item.unit,
            f"{item.ours:.3g}",
            item.paper if isinstance(item.paper, str) else f"{item.paper:.3g}",
            "yes" if item.agrees else "no",
        )
        for item in outcome.comparisons
    ]
    return Table(title, headings, rows)


def check_page(page: str, printed: dict[str, Table]) -> None:
    """Every row that the page shows stands in the table of its title, but for its last digit."""
    for title, (headings, rows) in tables_of(page).items():
        columns = [printed[title].headings.index(heading) for heading in headings]
        found = [[row[column] for column in columns] for row in printed[title].cells]
        for row in rows:
            assert any(same_row(title, headings, row, other) for other in found), (title, row)


def check_statements(page: str, title: str, outcome: Outcome) -> None:
    """The page tells how many statements agree, and shows each that doesn't."""
    agree = sum(item.agrees for item in outcome.comparisons)
    assert f"{agree} of {len(outcome.comparisons)} agree" in (DOCS / page).read_text(encoding="utf-8")
    headings, rows = tables_of(page)[title]
    refused = {tuple(row) for row in rows if row[headings.index("agrees")] == "no"}
    assert len(refused) == len(outcome.comparisons) - agree


def same_row(title: str, headings: list[str], shown: list[str], printed: list[str]) -> bool:
    """Whether a row of the page is this one, but for the last digit, which rounding may turn."""
    losses = [k for k, heading in enumerate(headings) if k and ("CL" in title or "CL" in heading)]
    hammers = any(number(row[k]) > HAMMERS for k in losses for row in (shown, printed))
    for cell, other in zip(shown, printed, strict=True):
        a, b = number(cell), number(other)
        if math.isnan(a) or math.isnan(b):
            if cell != other:
                return False
        elif abs(a - b) > 1.01 * 10.0 ** -len(cell.partition(".")[2]) + (MOVES * abs(a) if hammers else 0):
            return False
    return True


def number(cell: str) -> float:
    """A cell's number; nan where it is none."""
    try:
        return float(cell)
    except ValueError:
        return math.nan


def nearest(headings: list[str], shown: list[str], printed: list[list[str]]) -> list[str]:
    """The printed row that a page's row is of: most alike from the left, then nearest in numbers."""

    def distance(other: list[str]) -> tuple[int, float]:
        pairs = list(zip(shown, other, strict=True))
        alike = next((k for k, (a, b) in enumerate(pairs) if a != b), len(pairs))
        numbers = [(number(a), number(b)) for a, b in pairs]
        return -alike, sum(abs(a - b) / (abs(a) + abs(b) + 1e-9) for a, b in numbers if a == a and b == b)

    return min(printed, key=distance)


def rewrite(page: str, printed: dict[str, Table]) -> None:
    """Write a page's tables anew, row by row, from those of its study. Look at what changed."""
    text = (DOCS / page).read_text(encoding="utf-8")
    for title, (headings, rows) in tables_of(page).items():
        columns = [printed[title].headings.index(heading) for heading in headings]
        found = [[row[column] for column in columns] for row in printed[title].cells]
        for row in rows:
            if not any(same_row(title, headings, row, other) for other in found):
                old, new = (f"| {' | '.join(cells)} |" for cells in (row, nearest(headings, row, found)))
                text = text.replace(old, new)  # everywhere: two tables may show one row
    (DOCS / page).write_text(text, encoding="utf-8")
