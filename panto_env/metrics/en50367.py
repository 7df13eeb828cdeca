"""Limits of EN 50367 and EN 50119 on the contact force, by power supply.

Speeds are in m/s; in the standards' formulas v is in km/h. The standards themselves were not at hand: all
limits are recalled, the formulas for AC seen in public code as well. Those of DC 600 V and 750 V are recalled
with little confidence, and no mean force is known for them.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..base.arrays import to_kmh
from ..base.errors import InputError
from ..plant.catenary.schema import PowerSystem
from .criterion import Criterion
from .figures import ARC, Figures
from .labels import LABELS

FAST = 200.0
"""Speed (km/h) above which other limits hold."""
# a and b of the maximum mean force a v^2 + b (N), up to FAST and above.
LARGEST_MEAN = {
    "AC": ((0.00047, 90.0), (0.00097, 70.0)),
    "DC 1.5 kV": ((0.00228, 90.0), (0.00097, 140.0)),
    "DC 3 kV": ((0.00097, 110.0), (0.00097, 110.0)),
}
# a and b of the minimum mean force (N).
SMALLEST_MEAN = {"AC": (0.00047, 60.0), "DC 1.5 kV": (0.00112, 70.0), "DC 3 kV": (0.00096, 60.0)}
STATIC = {"AC": (60.0, 90.0), "DC 3 kV": (90.0, 120.0), "DC 1.5 kV": (70.0, 110.0)}
STATIC |= dict.fromkeys(("DC 750 V", "DC 600 V"), (60.0, 120.0))
"""Minimum and maximum static force (N). At standstill up to 140 N are allowed under DC 1.5 kV."""
SLOW = 100.0
"""Speed (km/h) up to which air lifts a pantograph by less than 10 N: its force there is its static force."""
TOLERANCE = 0.5
"""How far beyond a limit a mean force (N) keeps it: limits are compared in whole newtons. A static force is
trimmed to 0.05 N, and a policy with a washout moves the mean by a few tenths. Own choice."""
SLOW_LARGEST = 300.0
"""Maximum contact force up to FAST (N)."""
FAST_LARGEST_AC, FAST_LARGEST_DC = 350.0, 400.0
"""Maximum contact force above FAST (N)."""
STD_OF_MEAN = 0.3
"""Maximum σ over F_m."""
SOURCE = "EN 50367, recalled"


def largest_mean(speed: float, system: PowerSystem) -> float:
    """Maximum mean force (N), which is also the target. InputError for a power supply without one."""
    if _formula(system) not in LARGEST_MEAN:
        raise InputError(f"EN 50367 has no mean force for {system}; give the mean force as a number (N).")
    a, b = LARGEST_MEAN[_formula(system)][to_kmh(speed) > FAST]
    return a * to_kmh(speed) ** 2 + b


def smallest_mean(speed: float, system: PowerSystem) -> float:
    """Minimum mean force (N)."""
    a, b = SMALLEST_MEAN[_formula(system)]
    return a * to_kmh(speed) ** 2 + b


def maximum_limit(speed: float, system: PowerSystem) -> float:
    """Maximum contact force (N)."""
    if to_kmh(speed) <= FAST:
        return SLOW_LARGEST
    return FAST_LARGEST_AC if _is_ac(system) else FAST_LARGEST_DC


def maximum_source(system: PowerSystem) -> str:
    """Standard that we know the maximum contact force from."""
    return "EN 50367" if _is_ac(system) else "EN 50119"


def arcing_limit(speed: float, system: PowerSystem) -> float:
    """Maximum NQ (%)."""
    v = to_kmh(speed)
    return 0.2 if (v > 250 if _is_ac(system) else v >= 160) else 0.1


def criteria(
    figures: Figures, arcing: float, speed: float, system: PowerSystem, system_source: str
) -> list[Criterion]:
    """Mean force, σ, maxima and NQ (%) of a run, with their limits.

    system_source: where the line's power supply comes from.
    """
    note = f"this and other limits are those for {system}, the line's power supply ({system_source})"
    lowest_mean = highest_mean = None
    if _formula(system) in LARGEST_MEAN:
        lowest_mean, highest_mean = smallest_mean(speed, system), largest_mean(speed, system)
    mean = _force("mean", figures.mean, lowest_mean, highest_mean, SOURCE, note)
    mean = replace(mean, tolerance=TOLERANCE)
    if mean.kept is False:
        note += "; the option --mean-force en50367 trims the static force for a mean at the upper limit"
    length = f"share of time in losses of contact over {1e3 * ARC:g} ms; contact loss CL counts all of them"
    highest, source = maximum_limit(speed, system), f"{maximum_source(system)}, recalled"
    return [
        replace(mean, note=note),
        _force("std", figures.std, None, STD_OF_MEAN * figures.mean, SOURCE),
        Criterion("statistical_max", "F_m + 3σ", "N", figures.statistical_max, None, highest, source),
        _force("max", figures.max, None, highest, source),
        Criterion("arcing", "arcing NQ", "%", arcing, None, arcing_limit(speed, system), SOURCE, length),
    ]


def of_static(value: float | None, system: PowerSystem) -> list[Criterion]:
    """Static force (N) with its limits; nan where it cannot be judged, None where nothing is known of it."""
    if value is None:
        return []
    one = "not judged, as the pantograph's data have one force for all speeds, what the air lifts included"
    note = one if math.isnan(value) else ""
    return [Criterion("static_force", "static force", "N", value, *STATIC[_formula(system)], SOURCE, note)]


def _force(
    key: str, value: float, lowest: float | None, highest: float | None, source: str, note: str = ""
) -> Criterion:
    return Criterion(key, LABELS[key].name, LABELS[key].unit, value, lowest, highest, source, note)


def _formula(system: PowerSystem) -> str:
    """Key of a power supply among the formulas of the mean force, which hold for AC of any voltage."""
    return "AC" if _is_ac(system) else system


def _is_ac(system: PowerSystem) -> bool:
    return system.startswith("AC")
