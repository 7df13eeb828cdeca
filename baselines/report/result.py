"""Results of `panto benchmark`, read back from its JSON; a file that is not such a result is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from panto_env.base.checksums import read_checked
from panto_env.base.errors import InputError
from panto_env.base.settings import dotted

from ..benchmark.actions import Trace
from ..benchmark.overall import Standing, with_feedback
from ..benchmark.settings import LineAtSpeed
from ..benchmark.statistics import Cell


class Result(BaseModel):
    """Result of one track, as far as the page shows it; keys that the page does not use are ignored."""

    model_config = ConfigDict(frozen=True)

    version: str
    settings: dict[str, Any]
    spans: tuple[tuple[int, int], ...]
    standings: tuple[Standing, ...]
    cells: tuple[Cell, ...]
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
    def by_rank(self) -> list[Standing]:
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
        for one in self.traces:
            for along, values in ((one.position, one.force), (one.frequency, one.amplitude)):
                if len(along) != len(values) or not along or not along[0] < along[-1]:
                    raise ValueError("must have one value for each position, and positions that rise")
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
