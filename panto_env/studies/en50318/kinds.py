"""Passive runs on lines of the kinds for which EN 50318:2018 asks for figures: AC simple and AC stitched.

The standard's own lines, and any DC line with its values, were in no source of ours: these are figures, and
no claim.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...analysis.simulation import simulate

CASES = (
    ("AC simple", "benchmark-2015", "benchmark-2015", (250.0, 300.0)),
    ("AC simple", "re330", "dsa380", (250.0, 300.0)),
    ("AC stitched", "re250-stitched", "dsa250", (200.0, 250.0)),
    ("AC stitched", "re330-stitched", "dsa380", (250.0, 300.0)),
)
"""Kind, line, pantograph and speeds (km/h)."""


@dataclass(frozen=True)
class KindCheck:
    """Figures of one passive run over the default spans; forces low-passed at 20 Hz, but for losses."""

    line_kind: str
    catenary: str
    pantograph: str
    speed_kmh: float
    mean: float  # N
    std: float  # N
    max: float  # N
    min: float  # N
    max_uplift: float  # at a support (m)
    contact_loss: float  # %


def check_kind(kind: str, catenary: str, pantograph: str, speed_kmh: float) -> KindCheck:
    """A passive run on a line of a kind."""
    found = simulate(catenary, pantograph, speed_kmh, record_droppers=False).summary()
    names = ("mean", "std", "max", "min", "max_uplift", "contact_loss")
    return KindCheck(kind, catenary, pantograph, speed_kmh, *(getattr(found, name) for name in names))
