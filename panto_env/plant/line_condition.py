"""Condition of the line: irregularity of the contact wire, defects of wires, droppers, supports; wind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydantic import Field, field_validator

from ..base.arrays import Array
from ..base.settings import Between, Settings
from .wind import Wind

# Wavelength (m) and amplitude (m) of the height irregularity of a smooth wire (seen in one toy model). It
# is that of a wire just strung: makers keep short waves of contact wires within 0.1 mm (seen: nkt cables,
# abstract at a conference of the OEVG, 2013).
IRREGULARITY = ((12.0, 0.15e-3), (5.0, 0.08e-3), (1.5, 0.03e-3))

Number = Annotated[int, Between(1, 1000)]
# Beyond this a wire is no longer nearly level.
Error = Annotated[float, Between(-0.2, 0.2, "m")]
# From a span's first support; the line checks that its span is long enough.
Offset = Annotated[float, Between(0, 200, "m")]
Mass = Annotated[float, Between(0, 100, "kg")]
Stiffness = Annotated[float, Between(0, 1e5, "N/m")]
Length = Annotated[float, Between(2, 2000, "m")]
BumpLength = Annotated[float, Between(0.2, 100, "m")]
Worn = Annotated[float, Between(0, 0.4)]  # wires are replaced at a fifth to a third (recalled)
# A little may also have been gained: by friction of the pulleys, or weights too heavy.
Lost = Annotated[float, Between(-0.1, 0.5)]

ON_WIRE = ("hard_spots", "worn_stretches", "surface_bumps")
"""Lists of what is on the contact wire itself: each a span, a distance from its first support, and more."""
ALONG_LINE = ("lost_contact_tension", "lost_messenger_tension", "ice", "temperature")
"""What changes wires all along the line."""


class LineCondition(Settings):
    """Differences from the line as designed. Spans, droppers in a span and supports count from 1."""

    irregularity: Annotated[float, Between(0, 100)] = Field(
        0.0, description="height irregularity, as a multiple of a smooth wire's, of random phases (-)"
    )
    wear_depth: Annotated[float, Between(0, 0.02, "m")] = Field(
        0.0, description="depth A of wear waves, A/2 (1 - cos) (m)"
    )
    wear_wavelength: Annotated[float, Between(0.02, 100, "m")] = Field(
        0.8, description="wavelength of the wear waves (m)"
    )
    wear_drawn: bool = Field(
        False, description="draw the phase of the wear waves; else the line begins between two of them"
    )
    broken_droppers: tuple[tuple[Number, Number], ...] = Field(
        (), description="droppers that are broken: (span, number in the span)"
    )
    miscut_droppers: tuple[tuple[Number, Number, Error], ...] = Field(
        (), description="droppers of a wrong length: (span, number, how much too long (m))"
    )
    raised_supports: tuple[tuple[Number, Error], ...] = Field(
        (),
        description="messenger supports out of height: (number, how much too high (m)); support k "
        "stands between span k and span k + 1",
    )
    dropper_scatter: Annotated[float, Between(0, 0.05, "m")] = Field(
        0.0, description="rms error of the length of every dropper, drawn at random (m)"
    )
    support_scatter: Annotated[float, Between(0, 0.05, "m")] = Field(
        0.0, description="rms error of the height of every messenger support, drawn at random (m)"
    )
    tension_scatter: Annotated[float, Between(0, 0.1)] = Field(
        0.0,
        description="rms relative error of each wire's tension along the whole line, drawn at random, "
        "uniformly within +-sqrt(3) times this value (-)",
    )
    hard_spots: tuple[tuple[Number, Offset, Mass, Stiffness], ...] = Field(
        (),
        description="masses and springs on the contact wire, such as section insulators: (span, distance "
        "from its first support (m), mass (kg), stiffness to the ground, unstressed at rest (N/m))",
    )
    worn_stretches: tuple[tuple[Number, Offset, Length, Worn], ...] = Field(
        (),
        description="stretches of worn contact wire, lighter and with a higher running surface: (span, "
        "distance from its first support (m), length (m), share of the section that is gone)",
    )
    surface_bumps: tuple[tuple[Number, Offset, BumpLength, Error], ...] = Field(
        (),
        description="where the contact wire's running surface is higher or lower, as at a splice: (span, "
        "distance of the middle from its first support (m), length, half of it ramps (m), height (m))",
    )
    lost_contact_tension: Lost = Field(
        0.0,
        description="share of the contact wire's tension that is lost, along the whole line; gained, where "
        "negative (-)",
    )
    lost_messenger_tension: Lost = Field(
        0.0,
        description="share of the messenger wire's tension that is lost, along the whole line; gained, where "
        "negative (-)",
    )
    # A hurricane blows with 33 m/s; trains are stopped well before.
    wind: Annotated[float, Between(-40, 40, "m/s")] = Field(
        0.0, description="mean wind along the track, at 10 m over the ground; a head wind is positive (m/s)"
    )
    # That of open country, 0.03 m rough, at 10 m by Davenport's spectrum: sqrt(6) 0.4 / ln(10 / 0.03).
    turbulence: Annotated[float, Between(0, 0.5)] = Field(
        0.17,
        description="standard deviation of the gusts along the track over the mean wind; they are drawn at "
        "random from Davenport's spectrum (-)",
    )
    # Ice loads of standards reach 1.5 kg/m (recalled).
    ice: Annotated[float, Between(0, 5, "kg/m")] = Field(
        0.0,
        description="ice on both wires of a flexible line, which was built without it (kg/m); a coat of "
        "10 mm on a wire of 13 mm is 0.65 kg/m at 900 kg/m^3",
    )
    # From the design's, at which wires were tensioned, to the coldest and hottest in the sun.
    temperature: Annotated[float, Between(-80, 80, "K")] = Field(
        0.0,
        description="temperature of the wires less that at which the line was built (K); it acts on wires "
        "that are fixed at both ends (axial_stiffness)",
    )
    # Own choice; tables of tensions commonly begin at 10 to 15 degrees (recalled).
    reference_temperature: Annotated[float, Between(-40, 60, "°C")] = Field(
        15.0,
        description="temperature of the wires at which the line was built (°C); nothing but what is printed "
        "in °C depends on it",
    )

    side_wind: Annotated[float, Between(-40, 40, "m/s")] = Field(
        0.0,
        description="mean wind across the track, to the right (m/s), on the wires of a flexible line, which "
        "its drag damps; where steady arms have a length, it raises and lowers supports; "
        "vertical gusts, half as strong as turbulence says of those along the wind, are drawn at random from "
        "Panofsky's spectrum",
    )

    @field_validator("broken_droppers", "miscut_droppers", "raised_supports", *ON_WIRE)
    @classmethod
    def _each_once(cls, value: tuple[Any, ...], info: Any) -> tuple[Any, ...]:
        places = [row[:1] if info.field_name == "raised_supports" else row[:2] for row in value]
        for k, place in enumerate(places):
            if place in places[:k]:
                raise ValueError(f"names {place} twice")
        return value

    @property
    def random(self) -> bool:
        """Whether two lines in this condition differ."""
        uneven = self.irregularity > 0 or (self.wear_drawn and self.wear_depth > 0)
        return uneven or self.scatters or self.weather.gusts or self.across.gusts

    @property
    def weather(self) -> Wind:
        """The wind along the track."""
        return Wind(self.wind, self.turbulence)

    @property
    def across(self) -> Wind:
        """The wind across the track."""
        return Wind(abs(self.side_wind), self.turbulence)

    @property
    def in_still_air(self) -> LineCondition:
        """The same line without wind."""
        windy = self.wind or self.side_wind
        return self.model_copy(update={"wind": 0.0, "side_wind": 0.0}) if windy else self

    @property
    def scatters(self) -> bool:
        """Whether droppers, supports or tensions are drawn."""
        return self.dropper_scatter > 0 or self.support_scatter > 0 or self.tension_scatter > 0

    @property
    def largest_tension_error(self) -> float:
        """Maximum relative error of a wire's tension, in either direction."""
        return math.sqrt(3) * self.tension_scatter

    @property
    def waves(self) -> int:
        """Number of cosines in the wire's height."""
        return len(IRREGULARITY) * (self.irregularity > 0) + (self.wear_depth > 0)

    @property
    def shortest_wave(self) -> float:
        """Shortest wavelength of the wire's height (m), infinite where it is even."""
        waves = [length for length, _ in IRREGULARITY if self.irregularity > 0]
        waves += [length for _, _, length, _ in self.surface_bumps]
        waves += [self.wear_wavelength] if self.wear_depth > 0 else []
        return min(waves, default=math.inf)

    @property
    def defective(self) -> bool:
        """Whether wires, droppers or supports are not as designed."""
        named = self.broken_droppers or self.miscut_droppers or self.raised_supports
        return bool(named) or self.scatters or self.of_wires != NEW.of_wires

    @property
    def along_line(self) -> LineCondition:
        """What changes the wires' tension and mass all along the line, and nothing else."""
        return LineCondition(**self.model_dump(include={*ALONG_LINE, "reference_temperature"}))

    @property
    def temperature_in_words(self) -> str:
        """The temperature as a difference and in degrees, such as "+20 K (35 °C, built at 15 °C)"."""
        built = self.reference_temperature
        return f"{self.temperature:+g} K ({built + self.temperature:g} °C, built at {built:g} °C)"

    @property
    def of_wires(self) -> tuple[Any, ...]:
        """Defects of the wires themselves, and what weather does to them: all lanes of a plant share it."""
        return tuple(getattr(self, name) for name in (*ON_WIRE, *ALONG_LINE))


NEW = LineCondition()


def together(found: LineCondition, given: LineCondition) -> LineCondition:
    """A line as it was found, in a condition that is given besides: its values, and lists of both."""
    changed: dict[str, Any] = {}
    for name in LineCondition.model_fields:
        one, other = getattr(found, name), getattr(given, name)
        if isinstance(one, tuple):
            changed[name] = tuple(dict.fromkeys((*one, *other)))
        elif other != getattr(NEW, name):
            changed[name] = other
    return LineCondition.model_validate(found.model_dump() | changed)


# "smooth", "fair" and "worn" are about the running surface alone, on any kind of line; "as-built" is about
# droppers, supports and tensions as well, and combines with them, as in "as-built:irregularity=10".
#
# Measured spectra are published, but none could be read with its coefficients. Seen are:
# - what irregularity contact wires have: sag between droppers, waves of 0.3 to 1 m from the drum, wear waves
#   of 0.1 to 0.2 m, for which measuring to 1 mm was too coarse and to 0.1 mm fine enough (RTRI, "Non-contact
#   irregularity measuring method of the trolley wire", 2001);
# - depths of wear waves: 0.2 to 3 mm at 0.4 to 1.2 m;
# - that more than 70 % of lines simulated with a measured spectrum are worse than the ideal line (Song et
#   al., "Contact wire irregularity stochastics and effect on high-speed railway pantograph-catenary
#   interactions", its abstract).
# Recalled is that EN 50119 lets the heights at neighbouring droppers differ by 10 mm. Levels are an own
# choice within that: twice the rms difference between heights 6 m apart is 2.2 mm on a fair line and 4.4 mm
# on a worn one. The rest of those 10 mm is for what "as-built" draws.
LINE_CONDITIONS = {
    "new": NEW,
    "smooth": LineCondition(irregularity=1.0),
    # A line as built and maintained, a different one in every run. EN 50119 lets neighbouring droppers differ
    # by 10 mm (recalled), taken as two standard deviations; the same value for supports is an own choice.
    # Tensions stay within 3 % of the design's, the friction of pulleys in good order (own choice): 1.7 % rms.
    # Wear waves are the shallowest published.
    "as-built": LineCondition(
        irregularity=1.0,
        wear_depth=0.2e-3,
        wear_drawn=True,
        dropper_scatter=5e-3,
        support_scatter=5e-3,
        tension_scatter=0.017,
    ),
    "fair": LineCondition(irregularity=5.0),
    # Its waves of wear are among the shallower of those published (own choice).
    "worn": LineCondition(irregularity=10.0, wear_depth=0.5e-3),
}


@dataclass(frozen=True)
class DrawnLine:
    """One line in a condition, with its random values drawn."""

    condition: LineCondition
    waves: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(waves, 3): irregularity as amplitude (m), turns per metre (1/m), phase in turns."""
    scatter: Array | None = None  # (droppers,): length errors (m); None where there are none
    heights: Array | None = None  # (supports,): height errors of messenger supports (m); None for none
    tensions: tuple[float, float] = (1.0, 1.0)
    """Tensions of contact and messenger wire, relative to those in the condition."""
    wind: Array | None = None  # (GUST_ROWS,): with its gusts; None for the condition's mean wind
    side_wind: Array | None = None  # (SIDE_ROWS,): likewise


def draw(
    conditions: Sequence[LineCondition], random: np.random.Generator, droppers: int = 0, supports: int = 0
) -> DrawnLine:
    """Draw one line in one of these conditions; supports: those between two spans."""
    condition = conditions[int(random.integers(len(conditions))) if len(conditions) > 1 else 0]
    rows = []
    scatter, heights, tensions = None, None, (1.0, 1.0)
    if condition.irregularity > 0:
        phases = random.uniform(0, 1, len(IRREGULARITY))
        for (wavelength, amplitude), phase in zip(IRREGULARITY, phases, strict=True):
            rows.append((condition.irregularity * amplitude, 1 / wavelength, phase))
    if condition.dropper_scatter > 0:
        scatter = condition.dropper_scatter * random.standard_normal(droppers)
    if condition.support_scatter > 0:
        heights = condition.support_scatter * random.standard_normal(supports)
    if condition.tension_scatter > 0:
        # Bounded, since grid and time step are chosen to be stable at the maximum.
        largest = condition.largest_tension_error
        contact, messenger = (1 + largest * random.uniform(-1, 1, 2)).tolist()
        tensions = contact, messenger
    if condition.wear_depth > 0:
        # Only the alternating part: the mean depth lowers the whole line and changes nothing.
        phase = random.uniform(0, 1) if condition.wear_drawn else 0.5
        rows.append((condition.wear_depth / 2, 1 / condition.wear_wavelength, phase))
    return DrawnLine(condition, np.array(rows).reshape(-1, 3), scatter, heights, tensions)
