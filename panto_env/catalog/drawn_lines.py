"""Descriptions from which lines are drawn that hang and that an engineer would build.

Each kind is a TOML file with a schema of its own, and is named where a line is expected by its kind, a colon
and its name or its file: "family:high-speed".
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, ClassVar, TypeAlias

import numpy as np
from pydantic import Field

from ..base.errors import InputError
from ..base.settings import Between, Settings
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from .line_ranges import Length, Range, Share

DRAWN = ("family", "section")
"""Kinds of descriptions."""

Speeds: TypeAlias = tuple[float, float]


class Bands(Settings):
    """What a passive run and the elasticity of a drawn line may be; `panto family` checks it."""

    pantograph: str = Field(description="of that run, which is at the highest speed of the line's trains")
    force_deviation: Range[Share] = Field(
        description="standard deviation of the contact force over its mean (-)"
    )
    uplift: Range[Length] = Field(description="maximum uplift at a support (m)")
    elasticity: Range[Annotated[float, Between(0, 0.1, "m/N")]] = Field(
        description="maximum static uplift per newton along a span (m/N)"
    )
    non_uniformity: Range[Annotated[float, Between(0, 100, "%")]] = Field(
        description="EN 50119's non-uniformity of the elasticity (%)"
    )


class DrawnLines(Settings):
    """Lines to draw from: what all kinds have."""

    most_draws: ClassVar[int]
    """Draws after which a description counts as one without lines; one in two or three draws is taken."""

    kind: str
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what the lines are and how the ranges were chosen")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    @property
    def full_name(self) -> str:
        """Name where a line is expected, and of the lines drawn: the kind, a colon and the name."""
        return f"{self.kind}:{self.name}"

    @property
    @abstractmethod
    def fastest_kmh(self) -> float:
        """Maximum speed of trains on any of the lines (km/h)."""

    @property
    @abstractmethod
    def fewest_spans(self) -> int | None:
        """Number of spans after which a line ends at the earliest; None where none of the lines ends."""

    @abstractmethod
    def speeds(self, wave_speed: float, speed_kmh: Speeds | None = None) -> Speeds:
        """Lowest and highest speed of trains (km/h) by the wave speed of the contact wire (m/s).

        speed_kmh: speeds to choose from (km/h), by default any. The lowest is above the highest where there
        is none.
        """

    @abstractmethod
    def draw_once(self, random: np.random.Generator, speed_kmh: Speeds | None) -> FlexibleCatenaryData | None:
        """A line; None where it is to be drawn again."""

    @abstractmethod
    def none_found(self, speed_kmh: Speeds | None) -> str:
        """A sentence for the case that no draw gave a line."""

    def draw(
        self, random: np.random.Generator, speed_kmh: Speeds | None = None
    ) -> tuple[FlexibleCatenaryData, Speeds]:
        """A line, and the speeds of trains on it (km/h).

        A line is drawn again where it cannot hang, is not what an engineer would build, or has no speed of
        ``speed_kmh`` (km/h); the returned speeds are those of ``speed_kmh`` that it has. Raises InputError
        where no line is found.
        """
        for line in self.drawn(random, speed_kmh):
            if line is not None:
                return line, self.speeds(line.contact_wire.wave_speed, speed_kmh)
        raise InputError(self.none_found(speed_kmh))

    def drawn(
        self, random: np.random.Generator, speed_kmh: Speeds | None = None
    ) -> Iterator[FlexibleCatenaryData | None]:
        """``most_draws`` draws: a line, or None for one that is to be drawn again."""
        for _ in range(self.most_draws):
            yield self.draw_once(random, speed_kmh)


def in_words(speed_kmh: Speeds) -> str:
    """Speeds (km/h) in a message: "300", or "200 to 300"."""
    return " to ".join(f"{each:g}" for each in sorted(set(speed_kmh)))
