"""Static shape of the two-wire catenary, solved in closed form for one span of a periodic line.

A tensioned beam (T y'' - EI y'''' + p = 0) under its own weight and point forces, periodic in the
span L, has the Green's function of a string less that of its bending layers::

    G(x) = L/(2T) B2(|x|/L) - 1/T [cosh(kappa (L/2 - |x|)) / (2 kappa sinh(kappa L/2)) - 1/(L kappa^2)]

with kappa = sqrt(T/EI) and B2(s) = s^2 - s + 1/6, the second Bernoulli polynomial.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from ....base.remember import remembered
from ..schema import Wire
from .schema import FlexibleCatenaryData

GRAVITY = 9.81  # m/s^2
MOST_ROUNDS = 200
"""In which the droppers' weight, which depends on their length, must settle; real lines take about ten."""
HEIGHT_RANGE = 0.5
"""Difference of the contact wire's heights (m) that is still a contact wire's; pantographs follow 0.3 m."""
STEEPEST = 0.2
"""Slope up to which a wire is nearly level (-): tension is then off by 2 % at most."""
SETTLED, USABLE = 1e-12, 1e-9
"""Changes of the droppers' lengths in a round (m): the one ends the rounds, the other may be rounding."""
POINTS = 401
"""Of a span, where heights are looked at."""


@dataclass(frozen=True)
class PeriodicWire:
    """Height of a wire over one span: offset + sum of point forces times Green's function."""

    wire: Wire
    span: float
    points: Array  # where the point forces act (m)
    forces: Array  # upward point forces, weight of the wire balanced by them (N)
    offset: float  # m

    def height(self, x: Array) -> Array:
        """Height (m) at positions x (m) along the line."""
        return self.offset + green(self.wire, self.span, x, self.points) @ self.forces


@dataclass(frozen=True, eq=False)
class StaticShape:
    """One span in equilibrium; dropper arrays are in the order of the catalogue."""

    contact: PeriodicWire
    messenger: PeriodicWire
    dropper_tension: Array  # at the contact wire (N)
    dropper_length: Array  # unloaded (m)
    dropper_stiffness: Array  # N/m
    dropper_mass: Array  # kg, without clamps


def green(wire: Wire, span: float, x: Array, points: Array) -> Array:
    """Deflection at x per unit force at points, (len(x), len(points)), in m/N."""
    distance = np.abs(np.subtract.outer(x, points)) % span
    s = distance / span
    result = span / (2 * wire.tension) * (s * s - s + 1 / 6)
    if wire.bending_stiffness > 0:
        kappa = np.sqrt(wire.tension / wire.bending_stiffness)
        # cosh(kappa (L/2 - d)) / sinh(kappa L/2), written so that large arguments don't overflow
        decay = (np.exp(-kappa * distance) + np.exp(-kappa * (span - distance))) / (1 - np.exp(-kappa * span))
        result -= (decay / (2 * kappa) - 1 / (span * kappa**2)) / wire.tension
    return result


@remembered
def solve(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape whose contact wire has the catalogue's sag at the droppers.

    The contact wire hangs from the droppers, and from the steady arm where that holds it at height 0
    (any arm balances its own weight). The messenger's support, unloaded, stands ``encumbrance`` above
    height 0 and yields under the load. Raises InputError where no shape is found. What is found may be
    impossible, as with a dropper that pushes: ``hang`` says so.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _settle(line)


@remembered
def hang(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape of a line that can hang so at rest: every dropper pulls, wires are in order and level.

    Raises InputError, naming the dropper or the wire, where it can't.
    """
    shape = solve(line)
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
            f"At rest the contact wire of line '{line.name}' would differ by {np.ptp(contact):.2g} m in "
            f"height along a span, more than {HEIGHT_RANGE} m; give it more tension, or more droppers."
        )
    for name, height in (("contact", contact), ("messenger", messenger)):
        slope = float(np.abs(np.diff(height)).max()) / (x[1] - x[0])
        if slope > STEEPEST:
            raise InputError(
                f"At rest the {name} wire of line '{line.name}' would have a slope of {slope:.2g}, more than "
                f"{STEEPEST}, and the model is of nearly level wires; give it more tension, or shorter spans."
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
    for place, length in zip(places, shape.dropper_length, strict=True):
        if length <= 0:
            raise InputError(
                f"Unloaded, {place} would be {length:.4g} m long; give a larger encumbrance, more tension "
                "of the messenger wire, or stiffer droppers."
            )


def _settle(line: FlexibleCatenaryData) -> StaticShape:
    """The static shape, by rounds in which the lengths of the droppers, and so their weights, settle."""
    droppers = line.droppers
    x = np.array(droppers.positions)
    n = len(x)
    length = np.full(n, line.encumbrance)
    contact, messenger = line.contact_wire, line.messenger_wire
    for _ in range(MOST_ROUNDS):
        dropper_mass = droppers.mass * length
        clamped = GRAVITY * (dropper_mass / 2 + droppers.contact_clamp_mass)
        held, height = x, -np.array(droppers.sag)
        if line.steady_arm.holds_wire:
            held, height = np.append(x, 0.0), np.append(height, 0.0)
        lifted = _hold(contact, line.span_length, held, height)
        tension = lifted.forces[:n] + clamped
        pulled = -tension - GRAVITY * (dropper_mass / 2 + droppers.messenger_clamp_mass)
        carried = messenger.mass * GRAVITY * line.span_length - pulled.sum()
        points, forces = np.append(x, 0.0), np.append(pulled, carried)
        deflection = green(messenger, line.span_length, np.zeros(1), points) @ forces
        support = line.encumbrance - carried / line.support.stiffness
        offset = support - float(deflection[0])
        hung = PeriodicWire(messenger, line.span_length, points, forces, offset)
        loaded_length = hung.height(x) + np.array(droppers.sag)
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
    return StaticShape(lifted, hung, tension, length, _stiffness(line, length), dropper_mass)


def _stiffness(line: FlexibleCatenaryData, length: Array) -> Array:
    """Stiffness of each dropper in tension (N/m)."""
    droppers = line.droppers
    if droppers.stiffness is not None:
        return np.full(len(length), droppers.stiffness)
    assert droppers.axial_stiffness is not None  # the schema asks for one of the two
    return droppers.axial_stiffness / length


def _unloaded(line: FlexibleCatenaryData, loaded: Array, tension: Array) -> Array:
    """Length (m) of each dropper without load, of which its stiffness is that of ``_stiffness``."""
    if line.droppers.axial_stiffness is not None:
        return loaded / (1 + tension / line.droppers.axial_stiffness)
    return loaded - tension / _stiffness(line, loaded)


def _hold(wire: Wire, span: float, x: Array, height: Array) -> PeriodicWire:
    """Point forces at x that hold the wire at the given heights against its weight."""
    n = len(x)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = green(wire, span, x, x)
    system[:n, n] = system[n, :n] = 1.0
    solution = np.linalg.solve(system, np.append(height, wire.mass * GRAVITY * span))
    return PeriodicWire(wire, span, x, solution[:n], float(solution[n]))
