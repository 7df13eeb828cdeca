"""What a run was made with, by type: its settings, and its line and pantographs.

A run holds both as plain data, as its file does, so that files of other versions can be read. Here alone
these are read: each value when it is needed, since another version's need not be valid in this one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..plant.catenary import CATENARIES, CatenaryData
from ..plant.catenary.flexible.parts import Overlap
from ..plant.line_condition import NEW, LineCondition
from ..plant.pantograph.schema import PantographData


@dataclass(frozen=True)
class Identity:
    """Version, settings and resulting grid of a run."""

    settings: Mapping[str, Any]  # plain data by name

    @property
    def version(self) -> str:
        """Version of the project that made the run."""
        return str(self.settings.get("version", "unknown"))

    @property
    def controlled(self) -> tuple[int, ...]:
        """Numbers of the controlled pantographs, 1 for the first."""
        return tuple(self.settings.get("controlled", (1,)))

    @property
    def distances(self) -> tuple[float, ...]:
        """Distance of each further pantograph behind the first (m)."""
        return tuple(self.settings.get("distances", ()))

    @property
    def drifts(self) -> bool:
        """Whether the train's speed drifts."""
        return bool(self.settings.get("speed_drift"))

    @property
    def wind(self) -> float:
        """Mean wind along the track in which the run may have been made, the strongest (m/s); 0: none."""
        conditions = self.settings.get("line_condition") or ()
        return max((each.get("wind", 0.0) for each in conditions), key=abs, default=0.0)

    @property
    def line_condition(self) -> LineCondition:
        """Condition of the line, the first of several to draw from. Raises ValueError where not valid."""
        conditions = self.settings.get("line_condition")
        return LineCondition.model_validate(conditions[0]) if conditions else NEW

    @property
    def known_pantograph(self) -> PantographData | None:
        """Pantograph that policies assume, if it was given. Raises ValueError where it is not valid."""
        known = self.settings.get("known_pantograph")
        return PantographData.model_validate(known) if known else None

    @property
    def spacing(self) -> float | None:
        """Spacing of the grid (m); None for lines without one."""
        return self.settings.get("spacing")

    @property
    def window(self) -> int | None:
        """Spans of the travelling window, 0 for a whole line; None for lines without a grid."""
        return self.settings.get("window")


@dataclass(frozen=True)
class Design:
    """Line and pantographs of a run by value, as designed.

    Those properties that are lines or pantographs raise KeyError or ValueError where a run's file, of another
    version, has none that are valid in this one.
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
    def aerodynamic_coefficient(self) -> float | None:
        """Aerodynamic uplift over the squared speed (N/(km/h)^2); None where not known."""
        return self.tables.get("pantograph", {}).get("aerodynamic_coefficient")  # type: ignore[no-any-return]

    @property
    def line_ends(self) -> bool:
        """Whether the line ends with its own spans, as a sequence does; else wires go on behind them."""
        return bool(self.tables.get("catenary", {}).get("sequence"))

    @property
    def overlaps(self) -> list[Overlap]:
        """Overlaps of the line."""
        return [Overlap(**each) for each in self.tables.get("catenary", {}).get("overlaps") or ()]
