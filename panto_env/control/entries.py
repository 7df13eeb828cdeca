"""Entries of an observation, each in one piece: name, scale, unit, where it belongs, and its writer.

A new entry is one decorated function here; its place in an observation is that among these functions.
A writer gives the physical value, of one lane or of all in a group at once. It may look at ``episode``
(``Episode``), ``own`` (rows of ``Row``), ``task`` (of ``TaskRow``) and ``now`` (of ``Now``); ``number`` tells
entries apart that share a writer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..backend import inlined
from ..plant.actuators import ActuatorSettings
from ..plant.pantograph.schema import PantographData
from ..plant.sensors import READING
from ..plant.state import ROW
from ..plant.trigonometry import cosine_of_turns, sine_of_turns
from .state import NOW, TASK_ROW

MEASURED, FULL, CENTRED, ESTIMATED = "measured", "full", "centred", "estimated"
"""Kinds of observation: what a train can measure; that and more, free of noise and delay; what it can
measure and the nominal force, each entry with a mean near 0 and a spread near 1 in a passive run; the first
with the contact force that a filter estimates, in the place of one that is measured."""
CENTRES = {
    "head displacement": (0.056, 0.012),
    "frame displacement": (0.084, 0.013),
    "head velocity": (0.0, 0.1),
    "frame velocity": (0.0, 0.1),
    "speed": (70.0, 10.0),
    "nominal force": (120.0, 30.0),
}
"""Centre and scale in "centred" of entries that "measured" has too, from passive runs of Pantograph-v0."""
KINDS: dict[str, tuple[str, ...]] = {
    MEASURED: (MEASURED, FULL, CENTRED, ESTIMATED),
    FULL: (FULL,),
    CENTRED: (CENTRED,),
}
"""Kinds of observation that have an entry, by where it is said to belong."""


class Entry(NamedTuple):
    """One entry of an observation: physical value = centre + entry * scale."""

    name: str
    scale: float
    unit: str
    writer: int  # place in WRITERS
    number: int = 0
    centre: float = 0.0


Writer = Callable[..., Any]
Listing = Callable[[ActuatorSettings, PantographData], list[tuple[str, float, str, int]]]
"""Name, scale, unit and number of all entries that share a writer."""
WRITERS: list[Writer] = []
"""Writers of all entries; a kernel knows an entry's writer by its place here."""
_LISTINGS: list[tuple[str, Listing]] = []


def entry(
    kind: str, name: str, scale: float, unit: str
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator of the writer of one entry; kind: MEASURED, which all have, or the only one that has it."""
    return entries(kind, lambda actuator, pantograph: [(name, scale, unit, 0)])


def entries(kind: str, listing: Listing) -> Callable[[Writer], Writer]:
    """Decorator of a writer of several entries, or of entries that depend on actuator or pantograph."""

    def register(writer: Writer) -> Writer:
        WRITERS.append(inlined(writer))
        _LISTINGS.append((kind, listing))
        return writer

    return register


def entries_of(kind: str, actuator: ActuatorSettings, pantograph: PantographData) -> list[Entry]:
    """All entries of an observation, in order."""
    entries = [
        Entry(name, scale, unit, writer, number)
        for writer, (belongs_to, listing) in enumerate(_LISTINGS)
        if kind in KINDS[belongs_to]
        for name, scale, unit, number in listing(actuator, pantograph)
    ]
    if kind != CENTRED:
        return entries
    centred = [entry for entry in entries if entry.name != "contact force"]  # its deviation stands for it
    return [
        entry._replace(centre=CENTRES[entry.name][0], scale=CENTRES[entry.name][1])
        if entry.name in CENTRES
        else entry
        for entry in centred
    ]


@entry(MEASURED, "head displacement", 0.1, "m")
def _head_displacement(episode, own, task, now, number):
    return now[NOW.READING + READING.HEAD_HEIGHT]


@entry(MEASURED, "frame displacement", 0.1, "m")
def _frame_displacement(episode, own, task, now, number):
    return now[NOW.READING + READING.FRAME_HEIGHT]


@entry(MEASURED, "head velocity", 1.0, "m/s")
def _head_velocity(episode, own, task, now, number):
    return now[NOW.READING + READING.HEAD_VELOCITY]


@entry(MEASURED, "frame velocity", 1.0, "m/s")
def _frame_velocity(episode, own, task, now, number):
    return now[NOW.READING + READING.FRAME_VELOCITY]


@entry(MEASURED, "contact force", 100.0, "N")
def _contact_force(episode, own, task, now, number):
    return now[NOW.READING + READING.CONTACT_FORCE]


@entry(MEASURED, "sine of span position", 1.0, "-")
def _span_sine(episode, own, task, now, number):
    return episode.odometer.sight * sine_of_turns(now[NOW.SPANS])


@entry(MEASURED, "cosine of span position", 1.0, "-")
def _span_cosine(episode, own, task, now, number):
    return episode.odometer.sight * cosine_of_turns(now[NOW.SPANS])


@entry(MEASURED, "speed", 100.0, "m/s")
def _speed(episode, own, task, now, number):
    return now[NOW.SPEED]


@entry(CENTRED, "force deviation", 0.3, "of the nominal force")
def _force_deviation(episode, own, task, now, number):
    return now[NOW.READING + READING.CONTACT_FORCE] / own[ROW.NOMINAL_FORCE] - 1.0


@entry(CENTRED, "nominal force", 30.0, "N")
def _nominal_force(episode, own, task, now, number):
    return own[ROW.NOMINAL_FORCE]


def _actions(actuator: ActuatorSettings, _: PantographData) -> list[tuple[str, float, str, int]]:
    return [(f"last {place.name.lower()} action", 1.0, "-", k) for k, place in enumerate(actuator.places)]


@entries(MEASURED, _actions)
def _last_action(episode, own, task, now, number):
    return task[TASK_ROW.ACTION + number]


@entry(FULL, "wire displacement", 0.1, "m")
def _wire_displacement(episode, own, task, now, number):
    return own[ROW.WIRE_HEIGHT]


@entries(FULL, lambda actuator, _: [("frame force", actuator.force_limit, "N", 0)])
def _frame_force(episode, own, task, now, number):
    return own[ROW.FRAME_FORCE]


@entries(FULL, lambda actuator, _: [("head force", actuator.force_limit, "N", 0)])
def _head_force(episode, own, task, now, number):
    return own[ROW.HEAD_FORCE]


def _inner_masses(_: ActuatorSettings, pantograph: PantographData) -> list[tuple[str, float, str, int]]:
    """Displacement and velocity of each mass between head and frame."""
    count = len(pantograph.masses)
    places = [(k, f"mass {k + 1}") for k in range(1, count - 1)]
    pairs = [
        ((f"{mass} displacement", 0.1, "m", k), (f"{mass} velocity", 1.0, "m/s", count + k))
        for k, mass in places
    ]
    return [listed for pair in pairs for listed in pair]


@entries(FULL, _inner_masses)
def _pantograph_state(episode, own, task, now, number):
    return own[ROW.STATE + number]
