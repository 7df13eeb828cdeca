"""What benchmark, oracle, tuner and data sets share: settings of a train on a line, and TOML."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, SerializeAsAny, model_validator

from panto_env.base.errors import InputError, shown
from panto_env.base.settings import Between, Positive, Settings, parse
from panto_env.control.settings import controlled_numbers, default, description
from panto_env.plant.actuators import ActuatorSettings, actuator_settings
from panto_env.plant.catenary.schema import MOST_SPANS
from panto_env.plant.line_condition import LINE_CONDITIONS, LineCondition

T = TypeVar("T")

OPTIONS = ("catenary", "pantograph", "distances", "controlled")
"""Options of a command that say which train runs on which line."""
CONDITIONS = ("line_condition", "pantograph_scatter", "speed_drift", "control_interval")
"""Settings of runs that all lines of a file have in common."""


def of_run(name: str) -> Any:
    """A field with the default and the description of a run's setting of this name."""
    return Field(default(name), validate_default=True, description=description(name))


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
    for value, count in Counter(values).items():
        if count > 1:
            raise ValueError(f"{shown(value)} is given twice")
    return values


Distinct = Annotated[tuple[T, ...], AfterValidator(distinct)]  # values of which none is given twice
Actuator = SerializeAsAny[Annotated[ActuatorSettings, BeforeValidator(as_clause(actuator_settings))]]
Condition = Annotated[
    LineCondition,
    BeforeValidator(as_clause(lambda value: parse(LineCondition, value, "line_condition", LINE_CONDITIONS))),
]
Span = Annotated[int, Between(1, MOST_SPANS)]
_Controlled = Annotated[tuple[int, ...], BeforeValidator(as_clause(controlled_numbers))]


class LineAndTrain(Settings):
    """A train on a line, and the speeds to run at."""

    catenary: str = of_run("catenary")
    pantograph: str = of_run("pantograph")
    pantographs: tuple[str, ...] = Field(
        (), description="of a train, the first in front, instead of pantograph"
    )
    distances: tuple[Positive, ...] = Field((), description=description("distances"))
    controlled: _Controlled = of_run("controlled")
    speeds_kmh: Distinct[Positive] = Field((250.0, 300.0), min_length=1, description="km/h")

    @model_validator(mode="before")
    @classmethod
    def _first_of_several(cls, values: Any) -> Any:
        """The pantograph is the first of several."""
        several = values.get("pantographs") if isinstance(values, dict) else None
        return {"pantograph": several[0], **values} if several else values

    @property
    def settings(self) -> dict[str, Any]:
        """Line and train as settings of a run, by name."""
        if not (self.pantographs or self.distances) and self.controlled == (1,):
            return {"catenary": self.catenary, "pantograph": self.pantograph}
        several = self.pantographs or (self.pantograph,)
        train = {"pantographs": several, "distances": self.distances, "controlled": self.controlled}
        return {"catenary": self.catenary} | train


def as_toml(table: Mapping[str, Any]) -> str:
    """TOML of plain data; values that are null are left out, lists of lists have a row on each line."""
    plain = {key: value for key, value in table.items() if not _is_tables(value)}
    tables = {key: value for key, value in table.items() if key not in plain}
    parts = ["\n".join(_lines(plain))]
    parts += ["\n".join([f"[[{_key(key)}]]", *_lines(row)]) for key, rows in tables.items() for row in rows]
    return "\n\n".join(parts) + "\n"


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items() if value is not None]


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, Mapping) for each in value)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_lines(value))} }}" if value else "{}"
    if isinstance(value, list):
        values = [_value(each) for each in value]
        if value and isinstance(value[0], list):
            return "[\n" + "".join(f"    {each},\n" for each in values) + "]"
        return f"[{', '.join(values)}]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML alone escapes it


def _key(key: str) -> str:
    return key if key.isidentifier() and key.isascii() else _value(key)
