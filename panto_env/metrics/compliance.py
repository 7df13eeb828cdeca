"""Criteria of EN 50367 and EN 50119 for a run, and additional values without limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.arrays import Array
from ..plant.catenary.schema import BY_DEFAULT, CatenaryData, PowerSystem
from . import en50367
from .criterion import Criterion
from .figures import Figures
from .labels import LABELS

SHARE_OF_WAVE_SPEED = 0.7
"""Maximum speed of a train relative to the wave speed of the contact wire."""
WAVE_SOURCE = "EN 50119, seen"
WAVE_NOTE = "5.2.4 of EN 50119:2009, seen as quoted by Bane NOR's TRV:00599"


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
    mean_span: float,
    tension: Array,
    tension_near: Array,
    static: float | None = None,
) -> list[Criterion]:
    """All criteria of a run, then additional values without limits.

    arcing: NQ (%). speed: of the train (m/s). mean_span: mean length of a span (m). tension, tension_near:
    all samples of the droppers of the evaluated spans, and those while the train is in their span (N), empty
    where not recorded. static: as ``en50367.of_static`` takes it.
    """
    return [
        *en50367.criteria(figures, arcing, speed, line.system, line.system_source),
        *en50367.of_static(static, line.system),
        _minimum(figures),
        *_uplift(figures, line),
        *_waves(line, speed, speed / mean_span),
        *_droppers(tension, tension_near),
    ]


def _minimum(figures: Figures) -> Criterion:
    label = LABELS["min"]
    source = "EN 50119, recalled"
    return Criterion("min", label.name, label.unit, figures.min, 0.0, None, source, strict=True)


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
    """Room for the uplift at a support that EN 50119 requires, over that uplift (recalled).

    stopped: whether a stop limits the uplift.
    """
    return 1.5 if stopped else 2.0


def _waves(line: LineFacts, speed: float, frequency: float) -> list[Criterion]:
    if math.isinf(line.wave_speed):
        return []
    ratio = speed / line.wave_speed
    values = [
        Criterion(
            "speed", "v/c, train over wave", "", ratio, None, SHARE_OF_WAVE_SPEED, WAVE_SOURCE, WAVE_NOTE
        ),
        Criterion("doppler", "Doppler factor (c − v)/(c + v)", "", (1 - ratio) / (1 + ratio)),
    ]
    if not math.isnan(line.dropper_reflection):
        support = f"wave reflection at a support, at {frequency:.2g} Hz (one per span)"
        values += [
            Criterion("dropper reflection", "wave reflection at a dropper", "", line.dropper_reflection),
            Criterion("support reflection", support, "", line.support_reflection),
        ]
    return values


def _droppers(tension: Array, tension_near: Array) -> list[Criterion]:
    if not tension_near.size:
        return []
    slack = float(100 * (tension_near <= 0).mean())
    return [
        Criterion("dropper force", "maximum dropper force", "N", float(tension.max())),
        Criterion("slack", "droppers of the train's span slack", "% of time", slack),
    ]
