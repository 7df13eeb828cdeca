"""What a run was made with, by type: its settings, and its line and pantographs.

A run holds both as plain data, as its file does. Here alone they are read. Lines and pantographs are checked
only when they are needed, since those of another version need not be valid in this one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from ..plant.catenary import CATENARIES, CatenaryData
from ..plant.catenary.flexible.parts import Overlap
from ..plant.line_condition import NEW, LineCondition
from ..plant.pantograph.schema import PantographData


@dataclass(frozen=True)
class Identity:
    """Version, settings and resulting grid of a run, as far as they are read again."""

    version: str
    controlled: tuple[int, ...]  # numbers of the controlled pantographs, 1 for the first
    drifts: bool  # whether the train's speed drifts, or follows a profile
    has_profile: bool  # whether it follows a profile
    conditions: tuple[Mapping[str, Any], ...]  # of the line, of which one was drawn; plain data
    spacing: float | None  # of the grid (m); None for lines without one
    window: int | None  # travelling spans, 0 for the whole line; None for lines without a grid

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Self:
        """Identity from a run's settings as plain data."""
        return cls(
            version=settings.get("version", "unknown"),
            controlled=tuple(settings.get("controlled", (1,))),
            drifts=bool(settings.get("speed_drift") or settings.get("speed_profile")),
            has_profile=bool(settings.get("speed_profile")),
            conditions=tuple(settings.get("line_condition") or ()),
            spacing=settings.get("spacing"),
            window=settings.get("window"),
        )

    @property
    def wind(self) -> float:
        """Mean wind along the track in which the run may have been made, the strongest (m/s); 0: none."""
        return max((each.get("wind", 0.0) for each in self.conditions), key=abs, default=0.0)

    @property
    def line_condition(self) -> LineCondition:
        """Condition of the line, the first of several. Raises ValueError where it is not valid."""
        return LineCondition.model_validate(self.conditions[0]) if self.conditions else NEW


@dataclass(frozen=True)
class Design:
    """Line and pantographs of a run by value, as designed.

    A line or a pantograph that is missing or not valid raises KeyError or ValueError.
    """

    tables: Mapping[str, Any]  # plain data by "catenary", "pantograph" and, for a train, "pantographs"

    @property
    def line(self) -> CatenaryData:
        """The line."""
        table = self.tables["catenary"]
        return CATENARIES[table["kind"]].schema.model_validate(table)

    @property
    def pantograph(self) -> PantographData:
        """The pantograph whose record this is."""
        return PantographData.model_validate(self.tables["pantograph"])

    @property
    def pantographs(self) -> tuple[PantographData, ...]:
        """Pantographs of a train, the first in front; none where there is one alone."""
        return tuple(map(PantographData.model_validate, self.tables.get("pantographs", ())))

    @property
    def known_pantograph(self) -> PantographData | None:
        """The pantograph whose record this is; None where it is missing or not valid."""
        try:
            return self.pantograph
        except (KeyError, ValueError):
            return None

    @property
    def tunnels(self) -> bool:
        """Whether the line has tunnels."""
        return bool(self.tables.get("catenary", {}).get("tunnels"))

    @property
    def line_ends(self) -> bool:
        """Whether the line ends with its own spans, as a sequence does; else wires go on behind them."""
        return bool(self.tables.get("catenary", {}).get("sequence"))

    @property
    def overlaps(self) -> list[Overlap]:
        """Overlaps of the line."""
        return [Overlap(**each) for each in self.tables.get("catenary", {}).get("overlaps") or ()]
