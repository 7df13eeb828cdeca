"""Static shape of the two-wire catenary, solved in closed form for one span of a periodic line.

A tensioned beam (T y'' - EI y'''' + p = 0) under its own weight and point forces, periodic in the
span L, has the Green's function of a string less that of its bending layers:
    G(x) = L/(2T) B2(|x|/L) - 1/T [cosh(kappa (L/2 - |x|)) / (2 kappa sinh(kappa L/2)) - 1/(L kappa^2)]
with kappa = sqrt(T/EI) and B2(s) = s^2 - s + 1/6, the second Bernoulli polynomial.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....base.arrays import Array
from ..schema import Wire
from .schema import FlexibleCatenaryData

GRAVITY = 9.81  # m/s^2


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


@dataclass(frozen=True)
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


def solve(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape whose contact wire has the catalogue's sag at the droppers.

    The contact wire hangs from the droppers, and from the steady arm where that holds it at height 0
    (any arm balances its own weight). The messenger's support, unloaded, stands ``encumbrance`` above
    height 0 and yields under the load.
    """
    droppers = line.droppers
    x = np.array(droppers.positions)
    n = len(x)
    length = np.full(n, line.encumbrance)
    contact, messenger = line.contact_wire, line.messenger_wire
    while True:
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
        new_length = loaded_length - tension / _stiffness(line, loaded_length)
        change = np.abs(new_length - length).max()
        length = new_length
        if change < 1e-12:
            break
    return StaticShape(lifted, hung, tension, length, _stiffness(line, length), dropper_mass)


def _stiffness(line: FlexibleCatenaryData, length: Array) -> Array:
    """Stiffness of each dropper in tension (N/m)."""
    droppers = line.droppers
    if droppers.stiffness is not None:
        return np.full(len(length), droppers.stiffness)
    assert droppers.axial_stiffness is not None  # the schema asks for one of the two
    return droppers.axial_stiffness / length


def _hold(wire: Wire, span: float, x: Array, height: Array) -> PeriodicWire:
    """Point forces at x that hold the wire at the given heights against its weight."""
    n = len(x)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = green(wire, span, x, x)
    system[:n, n] = system[n, :n] = 1.0
    solution = np.linalg.solve(system, np.append(height, wire.mass * GRAVITY * span))
    return PeriodicWire(wire, span, x, solution[:n], float(solution[n]))
