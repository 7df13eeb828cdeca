"""Requirements on a run: figures and their limits of EN 50367 and EN 50119, by power supply.

Speeds are in m/s; in the standards' formulas v is in km/h. The standards themselves were not at hand: all
limits are recalled, the formulas for AC seen in public code as well. Those of DC 600 V and 750 V are recalled
with little confidence, and no mean force is known for them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError, beside
from ..base.table import Alarm, Table
from ..plant.catenary.schema import BY_DEFAULT, CatenaryData, PowerSystem
from .figures import ARC, LABELS, Figures


@dataclass(frozen=True)
class Criterion:
    """A figure in ``unit`` and its limits; None for no limit. Values without limits are for information."""

    key: str
    name: str
    unit: str
    value: float
    lowest: float | None = None
    highest: float | None = None
    source: str = ""  # of the limits: the standard, and whether it was seen or is recalled
    note: str = ""  # meaning of value and limits
    strict: bool = False  # whether a value equal to a limit breaks it
    tolerance: float = 0.0  # how far beyond a limit a value keeps it

    @property
    def margin(self) -> float:
        """Distance to the nearer limit, negative beyond it; nan without a limit."""
        above = [] if self.highest is None else [self.highest - self.value]
        below = [] if self.lowest is None else [self.value - self.lowest]
        return min([*above, *below], default=math.nan)

    @property
    def kept(self) -> bool | None:
        """Whether the limits are kept; None without a limit, or for a value that cannot be judged (nan)."""
        if math.isnan(self.margin):
            return None
        return self.margin > 0 if self.strict else self.margin >= -self.tolerance

    @property
    def limited(self) -> bool:
        """Whether it has a limit."""
        return self.lowest is not None or self.highest is not None

    @property
    def verdict(self) -> str:
        """Verdict as a word; "" without a limit."""
        return {True: "kept", False: "broken", None: "not judged" if self.limited else ""}[self.kept]

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def as_dict(self) -> dict[str, Any]:
        """The criterion as plain data, with its margin and whether it is kept."""
        return vars(self) | {"margin": self.margin, "kept": self.kept}


class Requirement(NamedTuple):
    """A criterion of a train: that of the pantograph with the smallest margin."""

    pantograph: int  # its number, from 1
    criterion: Criterion


def of_train(each: Sequence[Sequence[Criterion]]) -> list[Requirement]:
    """The criteria with limits of a train, from those of each of its pantographs."""
    found: dict[str, Requirement] = {}
    for number, own in enumerate(each, start=1):
        for criterion in filter(lambda one: one.limited, own):
            known = found[criterion.key].criterion.margin if criterion.key in found else math.nan
            if math.isnan(known) or criterion.margin < known:  # one that cannot be judged hides none that can
                found[criterion.key] = Requirement(number, criterion)
    return list(found.values())


def worst(runs: Sequence[Sequence[Criterion]]) -> list[Criterion]:
    """For each criterion, the one of several runs with the minimum margin."""
    return [min(same, key=lambda criterion: criterion.margin) for same in zip(*runs, strict=True)]


def criteria_table(criteria: Sequence[Criterion], title: str) -> Table:
    """Table of the criteria with limits: value, limit, margin, verdict and source."""
    rows = [
        (
            criterion.heading,
            value_in_words(criterion),
            limits_in_words(criterion),
            margin_in_words(criterion),
            Alarm(criterion.verdict) if criterion.kept is False else criterion.verdict,
            criterion.source,
        )
        for criterion in criteria
        if criterion.limited
    ]
    return Table(title, ("criterion", "value", "limit", "margin", "verdict", "source"), rows)


def remarks(criteria: Sequence[Criterion]) -> list[str]:
    """Lines to print below the table: notes on criteria, and the values without limits."""
    notes = [f"{criterion.name}: {criterion.note}." for criterion in criteria if criterion.note]
    without = (criterion for criterion in criteria if not criterion.limited)
    return [*notes, *(f"{criterion.heading}: {_digits(criterion.value)}" for criterion in without)]


def value_in_words(criterion: Criterion) -> str:
    """The value as text, on the same side of the limits as text: a broken criterion never looks kept."""
    return _digits(criterion.value, _more(criterion))


def limits_in_words(criterion: Criterion) -> str:
    """The limits as text, e.g. "at most 0.2"; "" without limits."""
    more = _more(criterion)
    below, above = ("below", "above") if criterion.strict else ("at most", "at least")
    if criterion.lowest is None:
        return "" if criterion.highest is None else f"{below} {_digits(criterion.highest, more)}"
    if criterion.highest is None:
        return f"{above} {_digits(criterion.lowest, more)}"
    beyond = f" ± {criterion.tolerance:g}" if criterion.tolerance else ""
    return f"{_digits(criterion.lowest, more)} to {_digits(criterion.highest, more)}{beyond}"


def margin_in_words(criterion: Criterion) -> str:
    """The margin as text, never 0 unless it is."""
    form = ".1f" if abs(criterion.margin) >= 10 else ".3f"
    return beside(criterion.margin, 0.0, form) if math.isfinite(criterion.margin) else "–"


def _more(criterion: Criterion) -> int:
    """How many more digits than usual it takes until value and limits as text say whether they are kept."""
    numbers = {name: getattr(criterion, name) for name in ("value", "lowest", "highest")}
    finite = {name: each for name, each in numbers.items() if each is not None and math.isfinite(each)}
    for more in range(16):
        rounded: dict[str, Any] = {name: float(_digits(each, more)) for name, each in finite.items()}
        if replace(criterion, **rounded).kept == criterion.kept:
            return more
    return 0


def _digits(value: float, more: int = 0) -> str:
    """A value with one decimal from 10 on, with three below, or more; 0 is exact, a dash not finite."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    return f"{value:.{1 + more}f}" if abs(value) >= 10 else f"{value:.{3 + more}f}"


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
STD_OF_MEAN = 0.3
"""Maximum σ over F_m."""
WAVE_SHARE = 0.7
"""Maximum speed over the contact wire's wave speed."""
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
        return 300.0
    return 350.0 if _is_ac(system) else 400.0


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
    known = _formula(system) in LARGEST_MEAN
    low, high = (smallest_mean(speed, system), largest_mean(speed, system)) if known else (None, None)
    mean = replace(_force("mean", figures.mean, low, high, SOURCE, note), tolerance=TOLERANCE)
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


@dataclass(frozen=True)
class LineFacts:
    """Data of a line that the criteria of a run depend on."""

    system: PowerSystem = "AC"  # power supply
    system_source: str = BY_DEFAULT
    wave_speed: float = math.inf  # of the contact wire (m/s), infinite where no wave runs along it
    free_uplift: float = math.nan  # room for the uplift at a support (m)
    free_uplift_source: str = ""
    uplift_stop: bool = False  # whether a stop at the support limits the uplift
    dropper_reflection: float = math.nan  # of a wave at a dropper (-)
    support_reflection: float = math.nan  # of a wave at a support, at the rate of passing them (-)
    contact_heights: tuple[float, ...] = ()  # (supports,): over the nominal one (m); none where it is level

    @classmethod
    def of(cls, line: CatenaryData, wave_speed: float, speed: float) -> LineFacts:
        """Facts of a line with a train on it; both speeds in m/s."""
        room = line.source_of("free_uplift")
        dropper, support = line.reflections(speed / line.alignment().mean_length)
        return cls(
            system=line.system,
            system_source=line.source_of("system"),
            wave_speed=wave_speed,
            free_uplift=line.free_uplift,
            free_uplift_source=f"{room}, recalled" if room == BY_DEFAULT else room,
            uplift_stop=line.uplift_stop,
            dropper_reflection=dropper,
            support_reflection=support,
            contact_heights=line.contact_heights,
        )


def compliance(
    figures: Figures,
    arcing: float,
    line: LineFacts,
    speed: float,
    tension: Array,
    tension_near: Array,
    static: float | None = None,
) -> list[Criterion]:
    """All criteria of a run, then additional values without limits.

    arcing: NQ (%). speed: of the train (m/s). tension, tension_near: all samples of the droppers of the
    evaluated spans, and those while the train is in their span (N), empty where not recorded. static: as
    ``of_static`` takes it.
    """
    return [
        *criteria(figures, arcing, speed, line.system, line.system_source),
        *of_static(static, line.system),
        replace(_force("min", figures.min, 0.0, None, "EN 50119, recalled"), strict=True),
        *_uplift(figures, line),
        *_waves(line, speed),
        *_droppers(tension, tension_near),
    ]


def _uplift(figures: Figures, line: LineFacts) -> list[Criterion]:
    if math.isnan(figures.max_uplift) or math.isnan(line.free_uplift):
        return []
    factor = uplift_factor(line.uplift_stop)
    value, room = 1e3 * factor * figures.max_uplift, 1e3 * line.free_uplift
    name = f"{'twice' if factor == 2 else f'{factor:g} times'} the uplift"
    limited = "a stop limits" if line.uplift_stop else "no stop limits"
    note = f"maximum of the supports; {limited} it; limit: the room there ({line.free_uplift_source})"
    return [Criterion("uplift", name, "mm", value, None, room, "EN 50119, recalled", note)]


def uplift_factor(stopped: bool) -> float:
    """Room for the uplift at a support, with a stop or none, over that uplift (EN 50119, recalled)."""
    return 1.5 if stopped else 2.0


def _waves(line: LineFacts, speed: float) -> list[Criterion]:
    if math.isinf(line.wave_speed):
        return []
    ratio = speed / line.wave_speed
    seen = "5.2.4 of EN 50119:2009, seen as quoted by Bane NOR's TRV:00599"
    support = "wave reflection at a support, at one wave per span"
    values = [
        Criterion("speed", "v/c, train over wave", "", ratio, None, WAVE_SHARE, "EN 50119, seen", seen),
        Criterion("doppler", "Doppler factor (c − v)/(c + v)", "", (1 - ratio) / (1 + ratio)),
        Criterion("dropper reflection", "wave reflection at a dropper", "", line.dropper_reflection),
        Criterion("support reflection", support, "", line.support_reflection),
    ]
    return values[:2] if math.isnan(line.dropper_reflection) else values


def _droppers(tension: Array, tension_near: Array) -> list[Criterion]:
    if not tension_near.size:
        return []
    slack = float(100 * (tension_near <= 0).mean())
    return [
        Criterion("dropper force", "maximum dropper force", "N", float(tension.max())),
        Criterion("slack", "droppers of the train's span slack", "% of time", slack),
    ]
