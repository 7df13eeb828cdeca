"""Settings that a benchmark and a search for oracles share: which train runs on which line, and how fast."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, Field, field_validator, model_validator

from panto_env.base.errors import InputError, shown
from panto_env.base.settings import Positive, Settings
from panto_env.control.settings import controlled_numbers, default, description

T = TypeVar("T")
OPTIONS = ("catenary", "pantograph", "distances", "controlled")
"""Options of a command that say which train runs on which line."""


def as_clause(read: Callable[[Any], T]) -> Callable[[Any], T]:
    """``read`` for a field: its errors become clauses, to which pydantic adds the key and the value."""

    def read_field(value: Any) -> T:
        try:
            return read(value)
        except InputError as error:
            raise ValueError(str(error).rstrip(".")) from error

    return read_field


def distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """The values. Raises ValueError where one is given twice."""
    twice = next((value for value, count in Counter(values).items() if count > 1), None)
    if twice is not None:
        raise ValueError(f"{shown(twice)} is given twice")
    return values


class LineAndTrain(Settings):
    """A train on a line, and the speeds to run at."""

    catenary: str = Field(default("catenary"), description=description("catenary"))
    pantograph: str = Field(default("pantograph"), description=description("pantograph"))
    pantographs: tuple[str, ...] = Field(
        (), description="of a train, the first in front, instead of pantograph"
    )
    distances: tuple[Positive, ...] = Field((), description=description("distances"))
    controlled: Annotated[tuple[int, ...], BeforeValidator(as_clause(controlled_numbers))] = Field(
        default("controlled"), validate_default=True, description=description("controlled")
    )
    speeds_kmh: tuple[Positive, ...] = Field((250.0, 300.0), min_length=1, description="km/h")

    @model_validator(mode="before")
    @classmethod
    def _first_of_several(cls, values: Any) -> Any:
        """The pantograph is the first of several."""
        several = values.get("pantographs") if isinstance(values, dict) else None
        return {"pantograph": several[0], **values} if several else values

    @field_validator("speeds_kmh")
    @classmethod
    def _distinct_speeds(cls, value: tuple[Any, ...]) -> tuple[Any, ...]:
        return distinct(value)

    @property
    def riding(self) -> dict[str, Any]:
        """The train as settings of a run, by name."""
        if not (self.pantographs or self.distances) and self.controlled == (1,):
            return {"pantograph": self.pantograph}
        several = self.pantographs or (self.pantograph,)
        return {"pantographs": several, "distances": self.distances, "controlled": self.controlled}
