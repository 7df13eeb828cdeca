"""A standard that you own: its lines and tests as a form that you fill in, compared by one command."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from ...analysis.line_check import check as line_at_rest
from ...analysis.simulation import simulate
from ...base.errors import InputError
from ...base.files import read_toml
from ...base.settings import Between, Settings, parse
from ...base.table import Table
from ...catalog import load_catenary
from ...control.settings import RunSettings
from ...metrics.figures import LABELS, Label
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ..study import Columns, tabled
from .reference import Check

AT_REST = {
    "mid_span": Label("elasticity in mid-span", "mid-span", "mm/N"),
    "support": Label("elasticity at a support", "support", "mm/N"),
    "non_uniformity": Label("non-uniformity of the elasticity", "non-uniformity", "%"),
    "pre_sag": Label("maximum pre-sag", "pre-sag", "mm"),
    "smallest_dropper_force": Label("minimum force of a dropper", "minimum", "N"),
    "largest_dropper_force": Label("maximum force of a dropper", "maximum", "N"),
}
"""Figures of a line at rest."""


class _Form(Settings):
    figures: ClassVar[Collection[str]]  # that it knows

    name: str = Field(min_length=1, description="name in the table")
    accepted: Annotated[dict[str, tuple[float, float]], Field(min_length=1)] = Field(
        description="smallest and largest accepted value by figure"
    )

    @model_validator(mode="after")
    def _known(self) -> Self:
        for figure, (low, high) in self.accepted.items():
            if figure not in self.figures:
                raise ValueError(f"accepted has '{figure}'; its figures are {', '.join(self.figures)}")
            if not low <= high:
                raise ValueError(f"accepted.{figure} must be the smaller value first, not {[low, high]}")
        return self


class LineTest(_Form):
    """A line at rest."""

    figures = AT_REST

    catenary: str = Field(description="line of the catalogue, or TOML file")
    force: Annotated[float, Between(1, 1000, "N")] = Field(100.0, description="force of the elasticity (N)")

    def checks(self, _: Mapping[str, Any]) -> list[Check]:
        """Its figures. Raises InputError for a line without droppers or, for some figures, unlike spans."""
        line = load_catenary(self.catenary)
        if not isinstance(line, FlexibleCatenaryData):
            raise InputError(f"{line.name} has no droppers; give a flexible line, or a test with a run.")
        rest = line_at_rest(line, self.force)
        values = {each.key: each.value for each in rest.criteria()}
        if not line.sequence:
            values |= zip(("mid_span", "support"), (1e3 * each for each in rest.in_span), strict=True)
        if unknown := [name for name in self.accepted if name not in values]:
            raise InputError(
                f"{unknown[0]} is for a line whose spans are all alike, and {line.name} has others."
            )
        return [
            Check(name, AT_REST[name].unit, 0.0, float(values[name]), *ends)
            for name, ends in self.accepted.items()
        ]


class RunTest(_Form):
    """A pass without control."""

    figures = LABELS

    spans: tuple[int, int] | None = Field(None, description="first and last span that count")
    pantograph_number: Annotated[int, Between(1, 8)] = Field(1, description="pantograph of the train, from 1")
    run: dict[str, Any] = Field({}, description="settings as `simulate` takes them, beside those of all")

    def checks(self, settings: Mapping[str, Any]) -> list[Check]:
        """Its figures; settings: of all passes. Raises InputError for what is not valid."""
        train = simulate(**{**settings, **self.run}, record_droppers=False).train
        if self.pantograph_number > len(train):
            raise InputError(
                f"pantograph_number is {self.pantograph_number}, and the train has {len(train)}."
            )
        return Check.of(train[self.pantograph_number - 1], self.spans, self.accepted)


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
        labels = AT_REST | LABELS
        columns: Columns = (
            ("test", "{[0]}"),
            ("figure", lambda each: labels[each[1].figure].heading),
            ("ours", lambda each: each[1].cells(2)[0]),
            ("accepted", lambda each: each[1].cells(2)[1]),
        )
        return tabled(self.title, columns, self.checks, 2, section=lambda each: each[0])

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        checks = [{"test": name} | check.as_dict() for name, check in self.checks]
        return {"title": self.title, "passed": self.passed, "checks": checks}


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
            checks += [(test.name, each) for each in test.checks(standard.run)]
        except InputError as error:
            raise InputError(f"{test.name}: {error}") from error
    return Compared(standard.title, checks)
