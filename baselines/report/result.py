"""Results of `panto benchmark`, read back from its JSON; a file that is not such a result is refused."""

from __future__ import annotations

from math import isfinite, nan
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
    model_validator,
)

from panto_env.base.checksums import read_checked
from panto_env.base.errors import InputError
from panto_env.base.settings import dotted

from ..benchmark.overall import with_feedback
from ..benchmark.statistics import LineAtSpeed, Share

Number = Annotated[
    float,
    BeforeValidator(lambda value: nan if value is None else value),
    AfterValidator(lambda value: value if isfinite(value) else nan),
]
"""A figure; nan if it is missing, which is null in JSON."""
Series = Annotated[tuple[FiniteFloat, ...], Field(min_length=2)]
Interval = tuple[FiniteFloat, FiniteFloat] | None


class ResultTable(BaseModel):
    """A table of the file; keys that the page does not use are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class AtPlace(ResultTable):
    """Base of tables that belong to one policy on one line at one speed."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: FiniteFloat

    @property
    def place(self) -> LineAtSpeed:
        """Line, pantograph and speed."""
        return LineAtSpeed(self.catenary, self.pantograph, self.speed_kmh)


class StoredCell(AtPlace):
    """A cell read from a file; its fields are those of ``benchmark.statistics.Cell``."""

    seeds: int
    nominal_force: FiniteFloat
    figures: dict[str, Number]
    change: Number
    interval: Interval
    cost_change: Number
    mean_change: Number
    moved: int
    improved: Number
    disqualified: str
    rank: int | None
    oracle: float | None = None  # change of σ (%) in the passes that an oracle ran; None without one
    oracle_share: float | None = None  # share of its gain, in these passes


class Trace(AtPlace):
    """A trace read from a file; its fields are those of ``benchmark.trace.Trace``."""

    seed: int
    position: Series
    force: Series
    frequency: Series
    amplitude: Series

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        for along, values in ((self.position, self.force), (self.frequency, self.amplitude)):
            if len(along) != len(values) or not along[0] < along[-1]:
                raise ValueError("must have one value for each position, and positions that rise")
        return self


class StoredStanding(ResultTable):
    """A policy's overall result read from a file; its fields are those of ``benchmark.overall.Standing``."""

    policy: str
    change: Number
    interval: Interval
    interval_for_lines: Interval = None  # not in older results
    worst_quarter: Number
    worst: Number
    worst_at: str
    improved: Number
    contact_loss: Number = nan  # not in older results
    cost_change: Number = nan
    effort: Number
    power: Number
    saturation: Number
    passes: int
    moved: int
    most_moved: Number
    better_than: dict[str, Share]
    trainings: dict[str, Number]
    disqualified: str
    rank: int | None
    oracle_share: float | None = None


class Result(ResultTable):
    """Result of one track, as far as the page shows it."""

    version: str
    settings: dict[str, Any]
    spans: tuple[tuple[int, int], ...]
    standings: tuple[StoredStanding, ...]
    cells: tuple[StoredCell, ...]
    traces: tuple[Trace, ...]

    @property
    def title(self) -> str:
        """Title from the benchmark's settings."""
        return str(self.settings.get("title", "benchmark"))

    @property
    def heading(self) -> str:
        """The title, and that a tape is nearly as good as the best policy where it is."""
        return with_feedback(self.title, self.standings)

    @property
    def policies(self) -> list[str]:
        """Names of all policies that ran, in the order of the settings."""
        return list(dict.fromkeys(cell.policy for cell in self.cells))

    @property
    def method_of(self) -> dict[str, str]:
        """Methods by the names of their trainings."""
        return {name: one.policy for one in self.standings for name in one.trainings}

    @property
    def by_rank(self) -> list[StoredStanding]:
        """Standings, the best first, each method before its trainings, and last those without a rank."""
        method_of = self.method_of
        ranked = sorted(self.standings, key=lambda one: (one.rank is None, one.rank or 0))
        own = {one.policy: one for one in self.standings}
        return [
            each
            for one in ranked
            if one.policy not in method_of
            for each in (one, *(own[name] for name in one.trainings))
        ]

    @property
    def places(self) -> list[LineAtSpeed]:
        """Lines and speeds, in the order of the settings."""
        return list(dict.fromkeys(cell.place for cell in self.cells))

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if not self.cells or len(self.spans) != len({place[:2] for place in self.places}):
            raise ValueError("must have cells, and spans for each of their lines")
        standing = {one.policy for one in self.standings if not one.trainings}
        if not standing | {one.policy for one in self.traces} <= set(self.policies):
            raise ValueError("must have a cell for every policy")
        if not set(self.method_of) <= standing:
            raise ValueError("must have a standing for every training")
        return self


def read_result(path: str | Path) -> Result:
    """Read the result in a JSON file. Raises InputError if it holds none or is damaged."""
    return parse_result(read_checked(path), str(path))


def parse_result(table: Any, name: str) -> Result:
    """Result from plain data. Raises InputError, which calls the data ``name``, if it is no result."""
    try:
        return Result.model_validate(table)
    except ValidationError as error:
        place = dotted(error.errors()[0]["loc"])
        where = f"'{place}' is missing or wrong" if place else "its parts do not fit together"
        raise InputError(
            f"{name} is no result of `panto benchmark --output RESULT.json`: {where}; run the benchmark anew."
        ) from error
