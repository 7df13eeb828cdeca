"""A requirement on a run: a figure, its limits, and their source."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..base.errors import beside
from ..base.table import Alarm, Table


@dataclass(frozen=True)
class Criterion:
    """A figure in ``unit`` and its limits; None for no limit. Values without limits are for information."""

    key: str
    name: str
    unit: str
    value: float
    lowest: float | None = None
    highest: float | None = None
    source: str = ""  # of the limits: the standard, and whether it was seen or is recalled
    note: str = ""  # meaning of value and limits
    strict: bool = False  # whether a value equal to a limit breaks it
    tolerance: float = 0.0  # how far beyond a limit a value keeps it

    @property
    def margin(self) -> float:
        """Distance to the nearer limit, negative beyond it; nan without a limit."""
        margins = []
        if self.highest is not None:
            margins.append(self.highest - self.value)
        if self.lowest is not None:
            margins.append(self.value - self.lowest)
        return min(margins, default=math.nan)

    @property
    def kept(self) -> bool | None:
        """Whether the limits are kept; None without a limit, or for a value that cannot be judged (nan)."""
        if math.isnan(self.margin):
            return None
        return self.margin > 0 if self.strict else self.margin >= -self.tolerance

    @property
    def limited(self) -> bool:
        """Whether it has a limit."""
        return self.lowest is not None or self.highest is not None

    @property
    def verdict(self) -> str:
        """Verdict as a word; "" without a limit."""
        return {True: "kept", False: "broken", None: "not judged" if self.limited else ""}[self.kept]

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def as_dict(self) -> dict[str, Any]:
        """The criterion as plain data, with its margin and whether it is kept."""
        return vars(self) | {"margin": self.margin, "kept": self.kept}


def worst(runs: Sequence[Sequence[Criterion]]) -> list[Criterion]:
    """For each criterion, the one of several runs with the minimum margin."""
    return [min(same, key=lambda criterion: criterion.margin) for same in zip(*runs, strict=True)]


def criteria_table(criteria: Sequence[Criterion], title: str) -> Table:
    """Table of the criteria with limits: value, limit, margin, verdict and source."""
    rows = [
        (
            criterion.heading,
            value_in_words(criterion),
            limits_in_words(criterion),
            margin_in_words(criterion),
            Alarm(criterion.verdict) if criterion.kept is False else criterion.verdict,
            criterion.source,
        )
        for criterion in criteria
        if criterion.limited
    ]
    return Table(title, ("criterion", "value", "limit", "margin", "verdict", "source"), rows)


def remarks(criteria: Sequence[Criterion]) -> list[str]:
    """Lines to print below the table: notes on criteria, and the values without limits."""
    notes = [f"{criterion.name}: {criterion.note}." for criterion in criteria if criterion.note]
    without = (criterion for criterion in criteria if not criterion.limited)
    return [*notes, *(f"{criterion.heading}: {_digits(criterion.value)}" for criterion in without)]


def value_in_words(criterion: Criterion) -> str:
    """The value as text, on the same side of the limits as text: a broken criterion never looks kept."""
    return _digits(criterion.value, _more(criterion))


def limits_in_words(criterion: Criterion) -> str:
    """The limits as text, e.g. "at most 0.2"; "" without limits."""
    more = _more(criterion)
    below, above = ("below", "above") if criterion.strict else ("at most", "at least")
    if criterion.lowest is None:
        return "" if criterion.highest is None else f"{below} {_digits(criterion.highest, more)}"
    if criterion.highest is None:
        return f"{above} {_digits(criterion.lowest, more)}"
    beyond = f" ± {criterion.tolerance:g}" if criterion.tolerance else ""
    return f"{_digits(criterion.lowest, more)} to {_digits(criterion.highest, more)}{beyond}"


def margin_in_words(criterion: Criterion) -> str:
    """The margin as text, never 0 unless it is."""
    form = ".1f" if abs(criterion.margin) >= 10 else ".3f"
    return beside(criterion.margin, 0.0, form) if math.isfinite(criterion.margin) else "–"


def _more(criterion: Criterion) -> int:
    """How many more digits than usual it takes until value and limits as text say whether they are kept."""

    def rounded(number: float | None, more: int) -> float | None:
        return number if number is None or not math.isfinite(number) else float(_digits(number, more))

    for more in range(16):
        value = rounded(criterion.value, more) or 0.0
        lowest, highest = rounded(criterion.lowest, more), rounded(criterion.highest, more)
        if replace(criterion, value=value, lowest=lowest, highest=highest).kept == criterion.kept:
            return more
    return 0


def _digits(value: float, more: int = 0) -> str:
    """A value with one decimal from 10 on, with three below, or more; 0 is exact, a dash not finite."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    return f"{value:.{1 + more}f}" if abs(value) >= 10 else f"{value:.{3 + more}f}"
