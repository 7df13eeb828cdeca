"""What the static shape of a line is, and how its droppers' lengths settle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from .beams import Profile
from .parts import Droppers

R = TypeVar("R")
MOST_ROUNDS = 200
"""Rounds in which the droppers' weight, which depends on their length, must settle; usual lines take ten."""
SETTLED, USABLE = 1e-12, 1e-9
"""Maximum change of the droppers' lengths in a round (m): to stop, and to accept after the last round."""


class InUse(NamedTuple):
    """Height of the wires in use along a line with overlaps; in the place of a ``Profile``."""

    limits: Array  # (tension lengths - 1,): where trains pass from one to the next (m)
    begins: Array  # (tension lengths,): m
    profiles: tuple[Any, ...]  # ``Profile`` of each, from its own begin
    breaks: tuple[float, float]  # ends of the line (m)

    def height(self, x: Array) -> Array:
        """Height (m) at positions x (m), (n,)."""
        x = np.asarray(x, dtype=float)
        which, found = np.searchsorted(self.limits, x, side="right"), np.zeros(x.shape)
        for k, profile in enumerate(self.profiles):
            ours = which == k
            found[ours] = profile.height(x[ours] - self.begins[k])
        return found


class Rope(NamedTuple):
    """A stitch wire at rest."""

    places: Array  # of its clamps and droppers (m), along the line or about a support that repeats at 0
    heights: Array  # m
    wire: int = 0  # contact wire under it


@dataclass(frozen=True, eq=False)
class StaticShape:
    """Spans in equilibrium that repeat; dropper arrays are in their order along the line."""

    contact: Profile | InUse
    messenger: Profile | InUse
    arm_force: float | Array  # of each steady arm that holds the wire, upward; (arms,) of unlike spans (N)
    dropper_tension: Array  # at the contact wire (N)
    dropper_length: Array  # unloaded (m)
    dropper_stiffness: Array  # N/m
    dropper_mass: Array  # kg, without clamps
    spans: int = 1  # number of spans that repeat: all of the line's where they differ
    ropes: tuple[Rope, ...] = ()  # stitch wires


def settled(name: str, length: Array, cut: Callable[[Array], tuple[Array, R]]) -> tuple[Array, R]:
    """Lengths of droppers (m) that ``cut`` returns for themselves, and what it returns beside them.

    length: the first guess. Raises InputError for the line of this name where they do not settle.
    """
    for _ in range(MOST_ROUNDS):
        new, found = cut(length)
        change = np.abs(new - length).max()
        length = new
        if change < SETTLED:
            break
    if not change < USABLE:  # nor where it is nan
        raise InputError(
            f"The static shape of line '{name}' does not settle in {MOST_ROUNDS} rounds: its droppers "
            "or clamps are too heavy for its wires; give less mass, or more tension."
        )
    return length, found


def stiffness_of(droppers: Droppers, length: Array) -> Array:
    """Stiffness of each dropper in tension (N/m), by its length (m)."""
    if droppers.stiffness is not None:
        return np.full(len(length), droppers.stiffness)
    assert droppers.axial_stiffness is not None  # the schema asks for one of the two
    return droppers.axial_stiffness / length


def unloaded(droppers: Droppers, loaded: Array, tension: Array) -> Array:
    """Length (m) of each dropper without load, from its length under tension (m) and that tension (N)."""
    if droppers.axial_stiffness is not None:
        return loaded / (1 + tension / droppers.axial_stiffness)
    return loaded - tension / stiffness_of(droppers, loaded)
