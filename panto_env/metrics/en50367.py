"""Limits of EN 50367 on the contact force; speeds in m/s, in the standard's formulas v is in km/h.

The standard itself was not at hand: formulas are recalled, those for AC seen in public code as well.
"""

from __future__ import annotations

from ..base.units import to_kmh
from .criterion import Criterion
from .figures import ARC, Figures
from .labels import LABELS

FAST = 200.0
"""Speed (km/h) above which other limits hold."""
# a and b of the maximum mean force a v^2 + b (N), up to FAST and above. The pairs meet at FAST.
LARGEST_MEAN = {
    "AC": ((0.00047, 90.0), (0.00097, 70.0)),
    "DC 1.5 kV": ((0.00178, 110.0), (0.00228, 90.0)),
    "DC 3 kV": ((0.00097, 110.0), (0.00097, 110.0)),
}
# a and b of the minimum mean force (N). For DC none is known to us.
SMALLEST_MEAN = {"AC": (0.00047, 60.0)}
STD_OF_MEAN = 0.3
"""Maximum σ over F_m."""
SOURCE = "EN 50367, recalled"


def largest_mean(speed: float, system: str = "AC") -> float:
    """Maximum mean force (N), which is also the target, under a system of ``LARGEST_MEAN``."""
    a, b = LARGEST_MEAN[system][to_kmh(speed) > FAST]
    return a * to_kmh(speed) ** 2 + b


def smallest_mean(speed: float, system: str = "AC") -> float | None:
    """Minimum mean force (N), where one is known."""
    if system not in SMALLEST_MEAN:
        return None
    a, b = SMALLEST_MEAN[system]
    return a * to_kmh(speed) ** 2 + b


def maximum_limit(speed: float) -> float:
    """Maximum contact force (N)."""
    return 350.0 if to_kmh(speed) > FAST else 300.0


def arcing_limit(speed: float) -> float:
    """Maximum NQ (%)."""
    return 0.2 if to_kmh(speed) > 250 else 0.1


def criteria(figures: Figures, arcing: float, speed: float, system: str = "AC") -> list[Criterion]:
    """Mean force, σ, maximum and NQ (%) of a run, with their limits."""
    lowest = smallest_mean(speed, system)
    highest = largest_mean(speed, system)
    notes = [f"no formula is known to us for the minimum mean force under {system}"] * (lowest is None)
    if figures.mean > highest or (lowest is not None and figures.mean < lowest):
        notes.append("the option --mean-force en50367 trims the static force for a mean at the upper limit")
    length = f"share of time in losses of contact over {1e3 * ARC:g} ms; contact loss CL counts all of them"
    return [
        _force("mean", figures.mean, lowest, highest, "; ".join(notes)),
        _force("std", figures.std, None, STD_OF_MEAN * figures.mean, ""),
        _force("max", figures.max, None, maximum_limit(speed), ""),
        Criterion("arcing", "arcing NQ", "%", arcing, None, arcing_limit(speed), SOURCE, length),
    ]


def _force(key: str, value: float, lowest: float | None, highest: float, note: str) -> Criterion:
    return Criterion(key, LABELS[key].name, LABELS[key].unit, value, lowest, highest, SOURCE, note)
