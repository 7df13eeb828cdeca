"""Static shape of the two-wire catenary as it is designed: one span of a periodic line.

The contact wire is held at the catalogue's sags by droppers, which are cut so; the messenger wire hangs
between its supports under the droppers' pull. Both are solved by exact beam elements (``beams``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from ....base.remember import remembered
from ....base.shown import beside
from .beams import GRAVITY, PeriodicWire, Profile
from .schema import FlexibleCatenaryData

MOST_ROUNDS = 200
"""Rounds in which the droppers' weight, which depends on their length, must settle; usual lines take ten."""
HEIGHT_RANGE = 0.5
"""Maximum difference of the contact wire's heights along a span (m); pantographs follow 0.3 m."""
STEEPEST = 0.2
"""Slope up to which a wire is nearly level (-): tension is then off by 2 % at most."""
MOST_STRETCH = 0.1
"""Stretch of a dropper at rest as a share of its length (-): ropes stretch by less than 1 %."""
MOST_YIELD = 0.3
"""Yield of the messenger's support at rest (m): cantilevers yield by millimetres."""
SETTLED, USABLE = 1e-12, 1e-9
"""Maximum change of the droppers' lengths in a round (m): to stop, and to accept after the last round."""
POINTS = 401
"""Number of points of a span at which heights are checked."""


@dataclass(frozen=True, eq=False)
class StaticShape:
    """One span in equilibrium; dropper arrays are in the order of the catalogue."""

    contact: Profile
    messenger: Profile
    arm_force: float  # of the steady arm where that holds the wire, upward (N)
    dropper_tension: Array  # at the contact wire (N)
    dropper_length: Array  # unloaded (m)
    dropper_stiffness: Array  # N/m
    dropper_mass: Array  # kg, without clamps


@remembered
def solve(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape whose contact wire has the catalogue's sag at the droppers.

    The contact wire hangs from the droppers, and from the steady arm where that holds it at height 0
    (any arm balances its own weight). The messenger's support, unloaded, stands ``encumbrance`` above
    height 0 and yields under the load. Raises InputError where no shape is found. The shape may be one that
    no line can have, such as with a dropper that pushes; ``hang`` refuses that.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _settle(line)


@remembered
def hang(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape of a line that can exist: every dropper pulls, wires do not cross and are level.

    Nothing in it gives way under the wires' weight either. Raises InputError, naming the dropper, the wire or
    the support, where it can't.
    """
    shape = solve(line)
    yielded = line.encumbrance - float(shape.messenger.height(np.zeros(1))[0])
    if yielded > MOST_YIELD:
        raise InputError(
            f"At rest the messenger's supports of line '{line.name}' would yield by "
            f"{beside(yielded, MOST_YIELD, '.2g')} m, more than {MOST_YIELD} m; give support.stiffness in "
            "N/m (500 N/mm are 500e3)."
        )
    _check_droppers(line, shape)
    x = np.linspace(0.0, line.span_length, POINTS)
    contact, messenger = shape.contact.height(x), shape.messenger.height(x)
    below = contact - messenger
    if below.max() >= 0:
        raise InputError(
            f"At rest the messenger wire of line '{line.name}' would hang {below.max():.2g} m below "
            f"the contact wire at {x[below.argmax()]:.4g} m; give a larger encumbrance, or more tension."
        )
    if np.ptp(contact) > HEIGHT_RANGE:
        raise InputError(
            f"At rest the contact wire of line '{line.name}' would differ by "
            f"{beside(float(np.ptp(contact)), HEIGHT_RANGE, '.2g')} m in height along a span, more than "
            f"{HEIGHT_RANGE} m; give it more tension, or more droppers."
        )
    for name, height in (("contact", contact), ("messenger", messenger)):
        slope = float(np.abs(np.diff(height)).max()) / (x[1] - x[0])
        if slope > STEEPEST:
            raise InputError(
                f"At rest the {name} wire of line '{line.name}' would have a slope of "
                f"{beside(slope, STEEPEST, '.2g')}, more than {STEEPEST}, and the model is of nearly "
                "level wires; give it more tension, or shorter spans."
            )
    return shape


def _check_droppers(line: FlexibleCatenaryData, shape: StaticShape) -> None:
    """Raise InputError for a dropper without tension or without length."""
    places = [
        f"dropper {k} of line '{line.name}', at {x:g} m," for k, x in enumerate(line.droppers.positions, 1)
    ]
    for place, tension in zip(places, shape.dropper_tension, strict=True):
        if tension <= 0:
            raise InputError(
                f"At rest {place} would carry {tension:.4g} N, and a dropper can only pull; change its "
                "position, or the sags."
            )
    stretch = shape.dropper_tension / shape.dropper_stiffness
    for place, length, longer in zip(places, shape.dropper_length, stretch, strict=True):
        if 0 < MOST_STRETCH * (length + longer) < longer:
            share = beside(100 * longer / (length + longer), 100 * MOST_STRETCH, ".2g")
            raise InputError(
                f"At rest {place} would be stretched by {longer:.2g} m, {share} % of its length, more "
                f"than {100 * MOST_STRETCH:g} %; give stiffer droppers: stiffness in N/m (100 N/mm are "
                "100e3), axial_stiffness in N."
            )
        if length <= 0:
            raise InputError(
                f"Unloaded, {place} would be {length:.4g} m long; give a larger encumbrance, more tension "
                "of the messenger wire, or stiffer droppers."
            )


def _settle(line: FlexibleCatenaryData) -> StaticShape:
    """The static shape, by rounds in which the lengths of the droppers, and so their weights, settle."""
    droppers, messenger = line.droppers, line.messenger_wire
    x, sag = np.array(droppers.positions), np.array(droppers.sag)
    breaks = np.concatenate([[0.0], x, [line.span_length]])
    hung, support = np.arange(1, len(breaks) - 1), np.array([0])  # nodes
    held, heights = hung, -sag
    if line.steady_arm.holds_wire:
        held, heights = np.append(hung, support), np.append(heights, 0.0)
    lower, upper = PeriodicWire(line.contact_wire, breaks, held), PeriodicWire(messenger, breaks, support)
    contact, lifts = lower.hang(heights, np.zeros(len(breaks) - 1))
    lift, arm_force = lifts[: len(x)], float(lifts[len(x) :].sum())
    length = np.full(len(x), line.encumbrance)
    for _ in range(MOST_ROUNDS):
        dropper_mass = droppers.mass * length
        tension = lift + GRAVITY * (dropper_mass / 2 + droppers.contact_clamp_mass)
        pulled = tension + GRAVITY * (dropper_mass / 2 + droppers.messenger_clamp_mass)
        carried = messenger.mass * GRAVITY * line.span_length + pulled.sum()
        top = np.array([line.encumbrance - carried / line.support.stiffness])
        above, _ = upper.hang(top, np.append(0.0, -pulled))
        loaded_length = above[2 * hung] + sag
        new_length = _unloaded(line, loaded_length, tension)
        change = np.abs(new_length - length).max()
        length = new_length
        if change < SETTLED:
            break
    if not change < USABLE:  # nor where it is nan
        raise InputError(
            f"The static shape of line '{line.name}' does not settle in {MOST_ROUNDS} rounds: its droppers "
            "or clamps are too heavy for its wires; give less mass, or more tension."
        )
    stiffness = _stiffness(line, length)
    return StaticShape(
        lower.profile(contact), upper.profile(above), arm_force, tension, length, stiffness, dropper_mass
    )


def _stiffness(line: FlexibleCatenaryData, length: Array) -> Array:
    """Stiffness of each dropper in tension (N/m)."""
    droppers = line.droppers
    if droppers.stiffness is not None:
        return np.full(len(length), droppers.stiffness)
    assert droppers.axial_stiffness is not None  # the schema asks for one of the two
    return droppers.axial_stiffness / length


def _unloaded(line: FlexibleCatenaryData, loaded: Array, tension: Array) -> Array:
    """Length (m) of each dropper without load, from its length under tension (m) and that tension (N)."""
    if line.droppers.axial_stiffness is not None:
        return loaded / (1 + tension / line.droppers.axial_stiffness)
    return loaded - tension / _stiffness(line, loaded)
