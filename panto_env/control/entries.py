"""Entries of an observation: for each its name, scale, unit, kinds of observation, and writer.

A new entry is one decorated function here; the order of these functions is the order of the entries.
A writer returns the physical value for one lane. It may read ``episode`` (``Episode``), ``own`` (the lane's
rows of ``Row``), ``task`` (of ``TaskRow``) and ``now`` (of ``Now``); ``number`` distinguishes entries that
share a writer.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..backend import inlined
from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.actuators import ActuatorSettings
from ..plant.alignment import mean_over_own_length
from ..plant.catenary.flexible import FlexibleCatenaryData
from ..plant.catenary.schema import CatenaryData
from ..plant.functions import cosine_of_turns, sine_of_turns
from ..plant.sensors import READING
from ..plant.state import ROW
from .state import NOW, NOW_ROWS, TASK_ROW

if TYPE_CHECKING:
    from .settings import RunSettings

SPAN_LENGTH = ("span length", 50.0, "m")
"""Name, scale and unit of the length of the span that the train is in."""
LINE_ENTRIES = (
    ("wave speed", 150.0, "m/s"),
    ("contact wire tension", 20e3, "N"),
    ("messenger wire tension", 20e3, "N"),
    ("contact wire mass", 1.0, "kg/m"),
    ("messenger wire mass", 1.0, "kg/m"),
    ("droppers of a span", 10.0, "-"),
)
"""Name, scale and unit of each value of the whole line; of two contact wires tension and mass together."""


def line_values(line: CatenaryData) -> Array:
    """The values of a line in the order of ``LINE_ENTRIES``. Raises InputError where it has not got them."""
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError(
            f"Only a flexible catenary has the values that line_values observes, and line '{line.name}' is "
            "not one; leave out line_values."
        )
    contact, messenger, side_by_side = line.contact_wire, line.messenger_wire, line.contact_wires
    return np.array(
        [
            contact.wave_speed,
            side_by_side * contact.tension,
            messenger.tension,
            side_by_side * contact.mass,
            messenger.mass,
            float(len(line.droppers.positions)),
        ]
    )


OBSERVATIONS = MEASURED, FULL, CENTRED, ESTIMATED, DEVIATIONS = (
    "measured",
    "full",
    "centred",
    "estimated",
    "deviations",
)
"""Kinds of observation: what a train can measure; in addition values that it cannot, without noise and
delay; measured values and the nominal force, from fixed centres and in fixed scales, by which each has a mean
near 0 and a spread near 1 in a passive run of Pantograph-v0's own line and pantograph; measured values with
the contact force that a filter estimates instead of a measured one; measured values with each reading's
deviation from its slow average in its place, which says nothing of what differs from line to line."""
AVERAGED = 1.0
"""Time constant (s) of the slow averages of readings in "deviations"; some spans pass in it."""
DEVIATION = " deviation"
"""How the names end of readings in "deviations"."""
CENTRES = {
    "head displacement": (0.056, 0.012),
    "frame displacement": (0.084, 0.013),
    "head velocity": (0.0, 0.1),
    "frame velocity": (0.0, 0.1),
    "speed": (76.0, 12.0),
    "nominal force": (120.0, 30.0),
    "front force": (120.0, 30.0),
    "remembered force": (120.0, 30.0),
    "span length": (55.0, 8.0),
    "wave speed": (140.0, 14.0),
    "contact wire tension": (22e3, 5e3),
    "messenger wire tension": (16e3, 3e3),
    "contact wire mass": (1.15, 0.12),
    "messenger wire mass": (0.85, 0.15),
    "droppers of a span": (8.0, 2.0),
}
"""Centre and scale in "centred" of entries shared with "measured", from passive runs of Pantograph-v0; those
of a line's values from the lines of the family high-speed."""
FORCE_DEVIATION, OF_NOMINAL = 0.3, "of the nominal force"
"""Scale and unit of the force deviation."""
READING_ENTRIES = (
    ("head displacement", 0.1, "m"),
    ("frame displacement", 0.1, "m"),
    ("head velocity", 1.0, "m/s"),
    ("frame velocity", 1.0, "m/s"),
    ("contact force", 100.0, "N"),
)
"""Name, scale and unit of the sensors' readings, in the order of ``Reading``."""


class Entry(NamedTuple):
    """One entry of an observation: physical value = centre + slope * speed + entry * scale."""

    name: str
    scale: float
    unit: str
    writer: int  # place in WRITERS
    number: int = 0
    centre: float = 0.0
    slope: float = 0.0  # in its unit, for each m/s of the train


Listing = Callable[["RunSettings"], list[tuple[str, float, str, int]]]
"""Name, scale, unit and number of all entries that share a writer."""
WRITERS: list[Callable[..., Any]] = []
"""Writers of all entries; a kernel identifies a writer by its index here."""
_LISTINGS: list[tuple[str, Listing]] = []


def entry(
    kind: str, name: str, scale: float, unit: str
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator of the writer of one entry.

    kind: MEASURED for an entry of all kinds of observation, FULL or CENTRED for one of that kind only.
    """
    return entries(kind, lambda _: [(name, scale, unit, 0)])


def entries(kind: str, listing: Listing) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator of a writer of several entries, or of entries that depend on a run's settings."""

    def register(writer: Callable[..., Any]) -> Callable[..., Any]:
        WRITERS.append(inlined(writer))
        _LISTINGS.append((kind, listing))
        return writer

    return register


def entries_of(settings: RunSettings) -> list[Entry]:
    """All entries of an observation, in order."""
    kind = settings.observation
    entries = [
        Entry(name, scale, unit, writer, number)
        for writer, (belongs_to, listing) in enumerate(_LISTINGS)
        if belongs_to in (MEASURED, kind)
        for name, scale, unit, number in listing(settings)
    ]
    if kind == CENTRED:  # the deviation of the contact force stands for it
        return [_centred(entry) for entry in entries if present(entry) != "contact force"]
    return [_deviation(entry) for entry in entries] if kind == DEVIATIONS else entries


def _centred(entry: Entry) -> Entry:
    centre, scale = CENTRES.get(present(entry), (entry.centre, entry.scale))
    return entry._replace(centre=centre, scale=scale)


def _deviation(entry: Entry) -> Entry:
    """Entry of the kind "deviations": a reading's, or that of a remembered force, in its usual spread."""
    name = present(entry)
    if name in (*(each for each, _, _ in READING_ENTRIES), "remembered force"):
        _, spread = CENTRES["remembered force" if name == "contact force" else name]
        return entry._replace(name=entry.name.replace(name, name + DEVIATION, 1), scale=spread)
    return _centred(entry)


def earlier(name: str, steps: int) -> str:
    """Name of an entry's value a number of control steps ago."""
    return f"{name}, {steps} step{'s' if steps > 1 else ''} ago"


def present(entry: Entry) -> str:
    """Name of an entry; for an earlier value, the name of the present one."""
    return entry.name.partition(", ")[0]


@entries(MEASURED, lambda _: [(*each, row) for row, each in enumerate(READING_ENTRIES)])
def _reading(episode, own, task, now, number):
    return now[NOW.READING + number]


@entry(MEASURED, "sine of span position", 1.0, "-")
def _span_sine(episode, own, task, now, number):
    return episode.odometer.sight * sine_of_turns(now[NOW.SPANS])


@entry(MEASURED, "cosine of span position", 1.0, "-")
def _span_cosine(episode, own, task, now, number):
    return episode.odometer.sight * cosine_of_turns(now[NOW.SPANS])


@entries(
    MEASURED,
    lambda settings: [
        (f"{wave} of span position, harmonic {k}", 1.0, "-", 2 * k + half)
        for k in range(2, settings.harmonics + 1)
        for half, wave in enumerate(("sine", "cosine"))
    ],
)
def _span_harmonic(episode, own, task, now, number):
    turns = float(number // 2) * now[NOW.SPANS]
    return episode.odometer.sight * sine_of_turns(turns + 0.25 * float(number % 2))


@entry(MEASURED, "speed", 100.0, "m/s")
def _speed(episode, own, task, now, number):
    return now[NOW.SPEED]


@entries(
    MEASURED,
    lambda settings: [
        (f"front force, {place:g} m ahead", 100.0, "N", number) for number, place in enumerate(settings.front)
    ],
)
def _front_force(episode, own, task, now, number):
    return now[NOW_ROWS + number]


def _memory(settings: RunSettings) -> list[tuple[str, float, str, int]]:
    """Force and actions of earlier spans at places ahead; number: row beyond ``Now``'s named ones."""
    actions = ((f"{name} action", 1.0, "-") for name in _place_names(settings.actuator))
    spans = [f"{k} span{'s' if k > 1 else ''} ago" for k in range(1, settings.memory_spans + 1)]
    places = product([("force", 100.0, "N"), *actions], spans, settings.memory)
    return [
        (f"remembered {name}, {span}, {time:g} s ahead", scale, unit, len(settings.front) + number)
        for number, ((name, scale, unit), span, time) in enumerate(places)
    ]


@entries(MEASURED, _memory)
def _remembered_value(episode, own, task, now, number):
    return now[NOW_ROWS + number]


@entries(MEASURED, lambda settings: [(*SPAN_LENGTH, 0)] if settings.line_values else [])
def _span_length(episode, own, task, now, number):
    return episode.alignment.mean_length / mean_over_own_length(episode.alignment, now[NOW.SPANS])


@entries(
    MEASURED, lambda settings: [(*each, row) for row, each in enumerate(LINE_ENTRIES) if settings.line_values]
)
def _line_value(episode, own, task, now, number):
    return episode.line_values[number]


@entry(CENTRED, "force deviation", FORCE_DEVIATION, OF_NOMINAL)
def _force_deviation(episode, own, task, now, number):
    return now[NOW.READING + READING.CONTACT_FORCE] / own[ROW.LIFT] - 1.0


@entry(CENTRED, "nominal force", 30.0, "N")
def _nominal_force(episode, own, task, now, number):
    return own[ROW.LIFT]


def _place_names(actuator: ActuatorSettings) -> list[str]:
    return [place.name.lower() for place in actuator.places]


@entries(
    MEASURED,
    lambda settings: [
        (f"last {name} action", 1.0, "-", k) for k, name in enumerate(_place_names(settings.actuator))
    ],
)
def _last_action(episode, own, task, now, number):
    return task[TASK_ROW.ACTION + number]


@entry(FULL, "wire displacement", 0.1, "m")
def _wire_displacement(episode, own, task, now, number):
    return own[ROW.WIRE_HEIGHT]


@entries(FULL, lambda settings: [("frame force", settings.actuator.force_limit, "N", 0)])
def _frame_force(episode, own, task, now, number):
    return own[ROW.FRAME_FORCE]


@entries(FULL, lambda settings: [("head force", settings.actuator.force_limit, "N", 0)])
def _head_force(episode, own, task, now, number):
    return own[ROW.HEAD_FORCE]


def _inner_masses(settings: RunSettings) -> list[tuple[str, float, str, int]]:
    count = len(settings.pantograph.masses)
    return [
        listed
        for k in range(1, count - 1)
        for listed in (
            (f"mass {k + 1} displacement", 0.1, "m", k),
            (f"mass {k + 1} velocity", 1.0, "m/s", count + k),
        )
    ]


@entries(FULL, _inner_masses)
def _pantograph_state(episode, own, task, now, number):
    return own[ROW.STATE + number]


def _remembered(settings: RunSettings) -> list[tuple[str, float, str, int]]:
    """Readings and actions of earlier control steps; number: row counted from that of the first action."""
    actions = [(f"last {name} action", 1.0, "-") for name in _place_names(settings.actuator)]
    rows = [*READING_ENTRIES, *actions]
    return [
        (earlier(name, k), scale, unit, len(actions) + (k - 1) * len(rows) + row)
        for k in range(1, settings.history + 1)
        for row, (name, scale, unit) in enumerate(rows)
    ]


@entries(MEASURED, _remembered)
def _earlier(episode, own, task, now, number):
    return task[TASK_ROW.ACTION + number]


@entries(
    CENTRED,
    lambda settings: [
        (name.replace("contact force", "force deviation"), FORCE_DEVIATION, OF_NOMINAL, number)
        for name, _, _, number in _remembered(settings)
        if name.startswith("contact force")
    ],
)
def _earlier_deviation(episode, own, task, now, number):
    return task[TASK_ROW.ACTION + number] / own[ROW.LIFT] - 1.0
