"""A standard that you own: its lines and tests as a form that you fill in, compared by one command."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from ...analysis.line_check import check as line_at_rest
from ...analysis.simulation import simulate
from ...base.errors import InputError
from ...base.files import read_toml
from ...base.settings import Between, Settings, parse
from ...base.table import Alarm, Table
from ...catalog import load_catenary
from ...control.settings import RunSettings
from ...metrics.figures import LABELS
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...terminal import number
from .reference import Check

Accepted = Annotated[dict[str, tuple[float, float]], Field(min_length=1)]
AT_REST = {
    "mid_span": ("elasticity in mid-span", "mm/N"),
    "support": ("elasticity at a support", "mm/N"),
    "non_uniformity": ("non-uniformity of the elasticity", "%"),
    "pre_sag": ("maximum pre-sag", "mm"),
    "smallest_dropper_force": ("minimum force of a dropper", "N"),
    "largest_dropper_force": ("maximum force of a dropper", "N"),
}
"""Name and unit of each figure of a line at rest."""


class _Form(Settings):
    name: str = Field(min_length=1, description="name in the table")
    accepted: Accepted = Field(description="smallest and largest accepted value by figure")

    def refuse_unknown(self, figures: Any) -> None:
        for figure, (low, high) in self.accepted.items():
            if figure not in figures:
                raise ValueError(f"accepted has '{figure}'; its figures are {', '.join(figures)}")
            if not low <= high:
                raise ValueError(f"accepted.{figure} must be the smaller value first, not {[low, high]}")


class LineTest(_Form):
    """A line at rest."""

    catenary: str = Field(description="line of the catalogue, or TOML file")
    force: Annotated[float, Between(1, 1000, "N")] = Field(100.0, description="force of the elasticity (N)")

    @model_validator(mode="after")
    def _known(self) -> Self:
        self.refuse_unknown(AT_REST)
        return self


class RunTest(_Form):
    """A pass without control."""

    spans: tuple[int, int] | None = Field(None, description="first and last span that count")
    pantograph_number: Annotated[int, Between(1, 8)] = Field(1, description="pantograph of the train, from 1")
    run: dict[str, Any] = Field({}, description="settings as `simulate` takes them, beside those of all")

    @model_validator(mode="after")
    def _known(self) -> Self:
        self.refuse_unknown(LABELS)
        return self


class Standard(Settings):
    """The form, filled in."""

    title: str = Field(min_length=1, description="title of the table")
    run: dict[str, Any] = Field({}, description="settings of all passes, as `simulate` takes them")
    lines: tuple[LineTest, ...] = Field((), description="lines at rest")
    tests: tuple[RunTest, ...] = Field((), description="passes")

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if not (self.lines or self.tests):
            raise ValueError("there are neither lines nor tests in it")
        for test in self.tests:
            if unknown := sorted((self.run | test.run).keys() - RunSettings.model_fields.keys()):
                raise ValueError(f"'{unknown[0]}' of run is no setting of a run")
        return self


@dataclass(frozen=True)
class Compared:
    """Every figure of a standard beside its accepted range."""

    title: str
    checks: list[tuple[str, Check]]  # with the name of the test; the speed of a line at rest is 0

    @property
    def passed(self) -> bool:
        """Whether all figures are accepted."""
        return all(check.inside for _, check in self.checks)

    @property
    def table(self) -> Table:
        """For people."""
        rows, ends = [], []
        for place, (name, check) in enumerate(self.checks):
            value = number(check.value, 2)
            rows.append(
                (
                    name,
                    check.figure,
                    value if check.inside else Alarm(f"{value} outside"),
                    f"{number(check.lowest, 2)} to {number(check.highest, 2)}",
                )
            )
            if name != dict(enumerate(self.checks)).get(place + 1, ("",))[0]:
                ends.append(place)
        return Table(self.title, ("test", "figure", "ours", "accepted"), rows, 2, tuple(ends))

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "title": self.title,
            "passed": self.passed,
            "checks": [{"test": name} | check.as_dict() for name, check in self.checks],
        }


def read_standard(path: str | Path) -> Standard:
    """The form of a TOML file. Raises InputError, naming the file, where it is not valid."""
    try:
        return parse(Standard, read_toml(path), "the standard")
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def compare(standard: Standard, report: Callable[[str], None] = lambda _: None) -> Compared:
    """Compute all lines and passes. Raises InputError, naming the test, where one is not valid."""
    checks: list[tuple[str, Check]] = []
    every: tuple[LineTest | RunTest, ...] = (*standard.lines, *standard.tests)
    for test in every:
        report(test.name)
        try:
            found = _of_run(standard, test) if isinstance(test, RunTest) else _at_rest(test)
            checks += [(test.name, each) for each in found]
        except InputError as error:
            raise InputError(f"{test.name}: {error}") from error
    return Compared(standard.title, checks)


def _at_rest(test: LineTest) -> Iterator[Check]:
    line = load_catenary(test.catenary)
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError(f"{line.name} has no droppers; give a flexible line, or a test with a run.")
    rest = line_at_rest(line, test.force)
    values = {each.key: each.value for each in rest.criteria()}
    if not line.sequence:
        middle = int(np.argmin(np.abs(rest.places - line.span_length / 2)))
        values |= {"mid_span": 1e3 * rest.elasticities[middle], "support": 1e3 * rest.elasticities[0]}
    for name, (low, high) in test.accepted.items():
        if name not in values:
            raise InputError(f"{name} is for a line whose spans are all alike, and {line.name} has others.")
        label, unit = AT_REST[name]
        yield Check(f"{label} ({unit})", unit, 0.0, float(values[name]), low, high)


def _of_run(standard: Standard, test: RunTest) -> Iterator[Check]:
    run = simulate(**standard.run | test.run, record_droppers=False)
    if test.pantograph_number > len(run.train):
        raise InputError(
            f"pantograph_number is {test.pantograph_number}, and the train has {len(run.train)}."
        )
    figures = run.train[test.pantograph_number - 1].summary(test.spans).as_dict()
    for name, (low, high) in test.accepted.items():
        label = LABELS[name]
        value = label.scale * figures[name]
        yield Check(label.heading, label.unit, run.speed_kmh, value, low, high)
