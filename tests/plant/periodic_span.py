"""A wire over one span of a periodic line in closed form, beside which the beam elements are judged.

A tensioned beam (T y'' - EI y'''' + p = 0) under its own weight and point forces, periodic in the span L,
has the Green's function of a string less that of its bending layers::

    G(x) = L/(2T) B2(|x|/L) - 1/T [cosh(kappa (L/2 - |x|)) / (2 kappa sinh(kappa L/2)) - 1/(L kappa^2)]

with kappa = sqrt(T/EI) and B2(s) = s^2 - s + 1/6, the second Bernoulli polynomial.
"""

import numpy as np

GRAVITY = 9.81


def green(wire, span, x, points):
    """Deflection at x (m) per unit force at points (m), (len(x), len(points)), in m/N."""
    distance = np.abs(np.subtract.outer(x, points)) % span
    s = distance / span
    result = span / (2 * wire.tension) * (s * s - s + 1 / 6)
    if wire.bending_stiffness > 0:
        kappa = np.sqrt(wire.tension / wire.bending_stiffness)
        # cosh(kappa (L/2 - d)) / sinh(kappa L/2), written so that large arguments don't overflow
        decay = (np.exp(-kappa * distance) + np.exp(-kappa * (span - distance))) / (1 - np.exp(-kappa * span))
        result -= (decay / (2 * kappa) - 1 / (span * kappa**2)) / wire.tension
    return result


def held_at(wire, span, points, heights):
    """Upward forces (N) that hold a wire at points (m) at heights (m), and its mean height (m)."""
    n = len(points)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = green(wire, span, points, points)
    system[:n, n] = system[n, :n] = 1.0
    solution = np.linalg.solve(system, np.append(heights, wire.mass * GRAVITY * span))
    return solution[:n], solution[n]


def shape(line, dropper_mass, x):
    """Heights (m) of both wires at x (m) and forces (N) of droppers, whose masses (kg) are given, and arm."""
    droppers, span, messenger = line.droppers, line.span_length, line.messenger_wire
    points, heights = np.array(droppers.positions), -np.array(droppers.sag)
    count = len(points)
    if line.steady_arm.holds_wire:
        points, heights = np.append(points, 0.0), np.append(heights, 0.0)
    lifts, mean = held_at(line.contact_wire, span, points, heights)
    contact = mean + green(line.contact_wire, span, x, points) @ lifts
    tension = lifts[:count] + GRAVITY * (dropper_mass / 2 + droppers.contact_clamp_mass)
    pulled = -tension - GRAVITY * (dropper_mass / 2 + droppers.messenger_clamp_mass)
    carried = messenger.mass * GRAVITY * span - pulled.sum()
    points, forces = np.append(points[:count], 0.0), np.append(pulled, carried)
    top = line.encumbrance - carried / line.support.stiffness
    upper = green(messenger, span, x, points) @ forces
    upper += top - (green(messenger, span, np.zeros(1), points) @ forces)[0]
    return contact, upper, tension, lifts[count:].sum()
