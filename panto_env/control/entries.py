"""Entries of an observation, each with the source that writes it: a new one is one function here.

A writer gives the physical value of one lane. It may look at ``episode`` (``Episode``), ``block`` (rows of
``Row``, column i) and ``task`` (rows of ``TaskRow``, column i); ``lane`` is the lane's place among all,
``number`` tells entries of the same kind apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..backend import inlined
from ..plant.sensors import READING
from ..plant.state import ROW
from ..plant.trigonometry import cosine_of_turns, sine_of_turns
from .state import TASK_ROW

WRITERS: list[Callable[..., Any]] = []
"""Writers of all kinds of entries; a kernel knows an entry's writer by its place here."""


class Entry(NamedTuple):
    """One entry of the observation: physical value = entry * scale."""

    name: str
    scale: float
    unit: str
    writer: int  # place in WRITERS
    number: int = 0  # tells entries of the same kind apart


@dataclass(frozen=True)
class EntryKind:
    """A kind of entry: of each name there may be one, or several by number."""

    name: str
    scale: float
    unit: str
    writer: int

    def entry(self, name: str | None = None, scale: float | None = None, number: int = 0) -> Entry:
        """An entry of this kind, under a name and a scale of its own if given."""
        return Entry(name or self.name, scale or self.scale, self.unit, self.writer, number)


def entry_kind(name: str, scale: float, unit: str) -> Callable[[Callable[..., Any]], EntryKind]:
    """Decorator that makes a writer a kind of entry."""

    def register(writer: Callable[..., Any]) -> EntryKind:
        WRITERS.append(inlined(writer))
        return EntryKind(name, scale, unit, len(WRITERS) - 1)

    return register


@entry_kind("head displacement", 0.1, "m")
def head_displacement(episode, block, task, lane, number, i):
    return task[TASK_ROW.READING + READING.HEAD_HEIGHT, i]


@entry_kind("frame displacement", 0.1, "m")
def frame_displacement(episode, block, task, lane, number, i):
    return task[TASK_ROW.READING + READING.FRAME_HEIGHT, i]


@entry_kind("head velocity", 1.0, "m/s")
def head_velocity(episode, block, task, lane, number, i):
    return task[TASK_ROW.READING + READING.HEAD_VELOCITY, i]


@entry_kind("frame velocity", 1.0, "m/s")
def frame_velocity(episode, block, task, lane, number, i):
    return task[TASK_ROW.READING + READING.FRAME_VELOCITY, i]


@entry_kind("contact force", 100.0, "N")
def contact_force(episode, block, task, lane, number, i):
    return task[TASK_ROW.READING + READING.CONTACT_FORCE, i]


@entry_kind("sine of span position", 1.0, "-")
def span_sine(episode, block, task, lane, number, i):
    return sine_of_turns(task[TASK_ROW.SPANS, i])


@entry_kind("cosine of span position", 1.0, "-")
def span_cosine(episode, block, task, lane, number, i):
    return cosine_of_turns(task[TASK_ROW.SPANS, i])


@entry_kind("speed", 100.0, "m/s")
def speed(episode, block, task, lane, number, i):
    return block[ROW.STRIDE, i] / episode.time_step


@entry_kind("last action", 1.0, "-")
def last_action(episode, block, task, lane, number, i):
    return episode.action[lane, number]


@entry_kind("wire displacement", 0.1, "m")
def wire_displacement(episode, block, task, lane, number, i):
    return block[ROW.WIRE_HEIGHT, i]


@entry_kind("frame force", 100.0, "N")
def frame_force(episode, block, task, lane, number, i):
    return block[ROW.FRAME_FORCE, i]


@entry_kind("head force", 100.0, "N")
def head_force(episode, block, task, lane, number, i):
    return block[ROW.HEAD_FORCE, i]


@entry_kind("mass displacement", 0.1, "m")
def mass_displacement(episode, block, task, lane, number, i):
    return block[ROW.STATE + number, i]


@entry_kind("mass velocity", 1.0, "m/s")
def mass_velocity(episode, block, task, lane, number, i):
    return block[ROW.STATE + episode.masses + number, i]
