"""How much tension, or how many droppers, control replaces on a line as it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ...analysis.pool import in_threads
from ...base.errors import InputError
from ...catalog import load_catenary
from ...plant.catenary.flexible import FlexibleCatenaryData
from ..permissible.scan import PASSIVE, VERIFIED_FROM
from .check import AS_BUILT
from .search import Design, Found, arguments_of, passes, worst

CONTACT, MESSENGER = "catenary.contact_wire.tension", "catenary.messenger_wire.tension"
SPACING = "catenary.droppers.spacing"
SHARES = tuple(1.0 - 0.05 * k for k in range(1, 11))
"""Shares of a tension that are tried, one after another."""


class Step(NamedTuple):
    """A line with less of something, under control."""

    value: float  # of the parameter
    droppers: int  # in a span
    std_ratio: float  # largest σ/F_m of all passes and pantographs; nan where the line is refused
    more_broken: tuple[str, ...]  # requirements broken in a pass in which the line as it is keeps them

    @property
    def keeps(self) -> bool:
        """Whether it keeps what the line as it is keeps without control."""
        return not self.more_broken and not math.isnan(self.std_ratio)


class Replaced(NamedTuple):
    """How far a parameter may go under control until it is worse than the line as it is without."""

    parameter: str
    policy: str
    limit: float  # largest σ/F_m of the line as it is, without control
    steps: tuple[Step, ...]  # the first one is the line as it is, under control; the last one fails in both

    @property
    def equal_std(self) -> Step | None:
        """The last of the steps up to which σ/F_m is no larger; None where control alone makes it larger."""
        return self._last([step.std_ratio <= self.limit for step in self.steps])

    @property
    def equal_requirements(self) -> Step | None:
        """The last of the steps up to which no more requirements are broken in any pass."""
        return self._last([step.keeps for step in self.steps])

    def _last(self, kept: Sequence[bool]) -> Step | None:
        first = kept.index(False) if False in kept else len(kept)
        return self.steps[first - 1] if first else None


def replaced(design: Design, policy: str) -> list[Replaced]:
    """Tension of either wire, and droppers, that a policy replaces on the line of a search, as built.

    All passes are at the speeds of the search, under seeds of the check. A line without these parts is
    refused with InputError.
    """
    line = _line(design)
    droppers = line.droppers.positions
    room = line.span_length - 2 * min(droppers[0], line.span_length / 4)
    values = {
        CONTACT: [share * line.contact_wire.tension for share in SHARES],
        MESSENGER: [share * line.messenger_wire.tension for share in SHARES],
        SPACING: [room / gaps for gaps in range(len(droppers) - 2, 0, -1)],
    }
    start = _passes(design, {}, PASSIVE)
    limit = worst(start).std_ratio
    as_it_is = _step(0.0, len(droppers), start, _passes(design, {}, policy))
    found = []
    for name, several in values.items():
        own = {CONTACT: line.contact_wire.tension, MESSENGER: line.messenger_wire.tension}.get(name)
        steps = [as_it_is._replace(value=own or room / (len(droppers) - 1))]
        for value in several:
            if not (steps[-1].keeps or steps[-1].std_ratio <= limit):
                break
            try:
                under_control = _passes(design, {name: value}, policy)
                count = len(_line(design, {name: value}).droppers.positions)
            except InputError:  # it cannot hang so
                break
            steps.append(_step(value, count, start, under_control))
        found.append(Replaced(name, policy, limit, tuple(steps)))
    return found


def _line(design: Design, values: dict[str, float] | None = None) -> FlexibleCatenaryData:
    line = (
        arguments_of(design, values, PASSIVE)["catenary"]
        if values
        else load_catenary(design.settings["catenary"])
    )
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError("Only a line of wires and droppers has tension and droppers to replace.")
    return line


def _passes(design: Design, values: dict[str, float], policy: str) -> list[Found]:
    seeds = range(VERIFIED_FROM, VERIFIED_FROM + design.check_seeds)
    arguments = arguments_of(design, values, policy) | AS_BUILT
    return in_threads(passes(arguments, sorted(design.speeds_kmh), seeds))


def _step(value: float, droppers: int, start: Sequence[Found], found: Sequence[Found]) -> Step:
    more = {
        name for own, other in zip(start, found, strict=True) for name in set(other.broken) - set(own.broken)
    }
    return Step(value, droppers, worst(found).std_ratio, tuple(sorted(more)))
