"""Settings of a search for oracles: passes as a table of cells, from keywords or a TOML file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, SerializeAsAny

from panto_configs import find
from panto_env.base.files import read_toml
from panto_env.base.settings import Between, Positive, Settings, parse
from panto_env.control.settings import (
    ControlInterval,
    PantographScatter,
    SpeedDrift,
    default,
    description,
)
from panto_env.plant.actuators import ActuatorSettings, actuator_settings
from panto_env.plant.catenary.schema import MOST_SPANS
from panto_env.plant.line_condition import LINE_CONDITIONS, LineCondition

from ..line import LineAndTrain
from .search import STARTS

MOST_HOPS = 1000
"""Maximum number of hops; each takes about as long as the first search."""
_Span = Annotated[int, Between(1, MOST_SPANS)]
Start = Literal[STARTS]  # type: ignore[valid-type]
_Actuator = SerializeAsAny[Annotated[ActuatorSettings, BeforeValidator(actuator_settings)]]


def _condition(value: Any) -> LineCondition:
    return parse(LineCondition, value, "line_condition", LINE_CONDITIONS)


class OracleCell(LineAndTrain):
    """A train with an actuator on a line, and the speeds to run at."""

    actuator: _Actuator = Field(
        default("actuator"), validate_default=True, description=description("actuator")
    )
    speeds_kmh: tuple[Positive, ...] = Field((300.0,), min_length=1, description="km/h")


class OracleSettings(Settings):
    """Cells, and the settings common to all of them."""

    cells: tuple[OracleCell, ...] = Field(
        (OracleCell(),), min_length=1, description="lines, actuators and speeds"
    )
    seeds: tuple[Annotated[int, Field(ge=0)], ...] = Field((0,), min_length=1, description="seeds")
    spans: tuple[_Span, _Span] | None = Field(
        None, description="first and last span over which σ is minimised; by default those after the start"
    )
    starts: tuple[Start, ...] = Field(("zero",), min_length=1, description=f"of {', '.join(STARTS)}")
    hops: int = Field(
        0,
        ge=0,
        le=MOST_HOPS,
        description="further searches, each from the best result plus noise; more find steadier forces",
    )
    line_condition: Annotated[LineCondition, BeforeValidator(_condition)] = Field(
        LINE_CONDITIONS["smooth"], description="on a new line every seed gives the same run"
    )
    pantograph_scatter: PantographScatter = Field(
        default("pantograph_scatter"), description=description("pantograph_scatter")
    )
    speed_drift: SpeedDrift = Field(default("speed_drift"), description=description("speed_drift"))
    control_interval: ControlInterval = Field(
        default("control_interval"), description=description("control_interval")
    )

    def runs(self) -> Iterator[dict[str, Any]]:
        """Settings of a run, by name, for each cell at each speed."""
        for cell in self.cells:
            for speed in cell.speeds_kmh:
                yield self.given(cell, speed)

    def given(self, cell: OracleCell, speed_kmh: float) -> dict[str, Any]:
        """Settings of a run, by name, for a cell at a speed (km/h)."""
        return {
            "catenary": cell.catenary,
            **cell.riding,
            "speed_kmh": speed_kmh,
            "actuator": cell.actuator,
            "line_condition": self.line_condition,
            "pantograph_scatter": self.pantograph_scatter,
            "speed_drift": self.speed_drift,
            "control_interval": self.control_interval,
        }


def oracle_settings(
    source: str | Path | None, changes: Mapping[str, Any], cell: Mapping[str, Any]
) -> OracleSettings:
    """Settings from a TOML file, given by its path or a name of ``configs/``, or the defaults, with changes.

    cell: if not empty, the only cell. Raises InputError for settings that are not valid.
    """
    table = {} if source is None else read_toml(find(source, "oracle"))
    if cell:
        table["cells"] = [dict(cell)]
    return parse(OracleSettings, table | dict(changes), "the oracle" if source is None else str(source))
