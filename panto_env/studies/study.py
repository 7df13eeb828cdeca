"""What a study of a paper returns, how it is written to a folder, and what all studies are made with.

Statements stand in ``statements.toml``: for each key the quantity, its unit, what the paper says, the range
in which ours agrees by the paper's words, and perhaps a note.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..analysis.plots import save
from ..base.checksums import write_checked
from ..base.files import check_output, finite, make_folder
from ..base.table import Table, write_rows
from ..metrics.figures import HEADINGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure
else:
    Figure = Any  # for annotations alone, here and in all studies: Matplotlib is slow to import

NUMBERS = "numbers.json"  # file with every number of a study
Report = Callable[[str, float], None]
"""Called with what is being done and the share of the study that is done, 0..1."""


@dataclass(frozen=True)
class Comparison:
    """One figure of ours beside the paper's, and the range in which they agree."""

    quantity: str
    unit: str
    ours: float
    paper: float | str  # where the paper makes a statement without a figure, that statement in short
    low: float  # inclusive, as high
    high: float
    note: str = ""  # why they differ, or what the paper leaves open

    @property
    def agrees(self) -> bool:
        """Whether ours lies in the range."""
        return self.low <= self.ours <= self.high

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return vars(self) | {"agrees": self.agrees}


@dataclass(frozen=True)
class Outcome:
    """What a study found."""

    title: str
    comparisons: tuple[Comparison, ...]
    tables: tuple[Table, ...] = ()
    plots: Mapping[str, Figure] = field(default_factory=dict)  # by file name, without suffix
    numbers: Mapping[str, Any] = field(default_factory=dict)  # every number behind tables and plots
    rows: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)  # of CSV, by file name
    verdict: str = ""  # what it comes to, in a sentence or two

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON: nan becomes None."""
        verdict = {"verdict": self.verdict} if self.verdict else {}
        comparisons = [comparison.as_dict() for comparison in self.comparisons]
        table: dict[str, Any] = finite(
            {"title": self.title} | verdict | {"comparisons": comparisons} | dict(self.numbers)
        )
        return table


Study = Callable[[Report], Outcome]
"""A study of one part of a paper: run it, on all cores where it takes long."""
Cell = str | Callable[[Any], str | float]  # of an entry: a format such as "{.std:.2f}", or a function
Columns = Sequence[tuple[str, Cell]]
"""Headings, and the cells under them."""


@cache
def _statements() -> dict[str, list[Any]]:
    return tomllib.loads(Path(__file__).with_name("statements.toml").read_text(encoding="utf-8"))


def said(key: str, ours: float, **names: Any) -> Comparison:
    """A figure of ours beside a statement of ``statements.toml``; names: what stands in its braces."""

    def fill(part: Any) -> Any:
        if not isinstance(part, str):
            return part
        return names[part[1:-1]] if part[1:-1] in names else part.format(**names)

    quantity, unit, *others = map(fill, _statements()[key])
    return Comparison(quantity, unit, ours, *others)


def tabled(
    title: str,
    columns: Columns,
    entries: Sequence[Any],
    text_columns: int = 1,
    section: Callable[[Any], Any] | None = None,
) -> Table:
    """A row for each entry, columns by heading, and a line after entries that ``section`` groups together."""
    headings, cells = zip(*columns, strict=True)
    rows = [
        tuple(cell.format(each) if isinstance(cell, str) else cell(each) for cell in cells)
        for each in entries
    ]
    groups = [*map(section, entries)] if section else []
    ends = tuple(k for k, group in enumerate(groups) if groups[k + 1 : k + 2] != [group])
    return Table(title, headings, rows, text_columns, ends)


def over(report: Report, what: str, begin: float, end: float) -> Callable[[int, int], None]:
    """Progress of jobs, done and in all, as a part of a study's, from one share of it to another."""
    return lambda done, total: report(what, begin + (end - begin) * done / total)


def legend_below(figure: Figure, columns: int, size: str = "small") -> None:
    """One legend of the first panel's curves below all panels."""
    named = figure.axes[0].get_legend_handles_labels()
    figure.legend(*named, loc="outside lower center", ncols=columns, fontsize=size)


def check_writable(folder: Path) -> None:
    """Raise InputError unless a study's numbers can be written into a folder; called before any work."""
    check_output(folder / NUMBERS, (".json",))


def write(outcome: Outcome, folder: str | Path) -> list[Path]:
    """Write the numbers as JSON, plots as PNG and rows as CSV into a folder; the files written."""
    folder = Path(folder)
    make_folder(folder)
    files = [folder / NUMBERS]
    write_checked(files[0], outcome.as_dict())
    for name, plot in outcome.plots.items():
        files.append(folder / f"{name}.png")
        save(plot, files[-1])
    for name, rows in outcome.rows.items():
        files.append(folder / f"{name}.csv")
        write_rows(rows, files[-1], HEADINGS)
    return files
