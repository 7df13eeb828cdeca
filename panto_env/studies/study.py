"""What a study of a paper returns, and how it is written to a folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from ..analysis.plots import save
from ..base.checksums import write_checked
from ..base.files import check_output, finite, make_folder
from ..base.table import Table, write_rows
from ..metrics.figures import HEADINGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = "numbers.json"
"""File with every number of a study."""
Report = Callable[[str, float], None]
"""Called with what is being done and the share of the study that is done, 0..1."""


@dataclass(frozen=True)
class Comparison:
    """One figure of ours beside the paper's, and the range in which they agree.

    Where the paper makes a statement without a figure, ``paper`` is that statement in short. ``low`` and
    ``high`` are inclusive.
    """

    quantity: str
    unit: str
    ours: float
    paper: float | str
    low: float
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
        comparisons = [comparison.as_dict() for comparison in self.comparisons]
        said = {"verdict": self.verdict} if self.verdict else {}
        table: dict[str, Any] = finite(
            {"title": self.title, **said, "comparisons": comparisons, **self.numbers}
        )
        return table


class Study(Protocol):
    """A study of one part of a paper."""

    def __call__(self, report: Report) -> Outcome:
        """Run it, on all cores where it takes long."""


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
