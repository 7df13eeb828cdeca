"""Finite differences of a flexible catenary: their weights, stability, and error at a point force."""

from __future__ import annotations

import numpy as np

from ....backend import WIDTH
from ....base.arrays import Array
from ...interpolation import stencil
from ..schema import Wire
from .schema import FlexibleCatenaryData


def nodes_per_span(data: FlexibleCatenaryData, spacing: float) -> int:
    """Nodes per span for a maximum spacing (m): a multiple of ``WIDTH``, for segments of equal size.

    Where spans differ, a span of mean length.
    """
    return WIDTH * int(np.ceil(data.stride / spacing / WIDTH - 1e-9))


def stable(data: FlexibleCatenaryData, dx: float, step: float, lightest: float = 1.0) -> bool:
    """Whether the leapfrog is stable: 0 <= omega^2 dt^2 and omega^2 dt^2 (1 + 2 beta/dt) <= 4.

    dx: spacing (m). step: s. lightest: mass of the most worn contact wire, as a share of a new one's.
    """
    angle = np.linspace(0.0, np.pi, 181)  # of a wave from node to node
    for wire, share in ((data.contact_wire, lightest), (data.messenger_wire, 1.0)):
        squared = _response(stencil_weights(wire, dx, step), angle) / share
        if squared.min() < -1e-9 or squared.max() * (1 + 2 * data.damping.beta / step) > 4 + 1e-9:
            return False
    return True


def contact_gain(data: FlexibleCatenaryData, dx: float, step: float, lightest: float = 1.0) -> float:
    """Inverse of the stiffness (m/N) from which a contact law that reads the wire at mid-step is unstable.

    With a force k w at one point the leapfrog is stable while 4 M - dt^2 K stays above dt^2 k W W'. At the
    limit the maximum of k dt^2 W' (4 M - dt^2 K)^-1 W over all places between two nodes is 1; it is an
    integral over the waves of the grid. Infinite where the grid is at its own limit. lightest: as in
    ``stable``.
    """
    angle = np.linspace(0.0, np.pi, 721)  # of a wave from node to node
    squared = _response(stencil_weights(data.contact_wire, dx, step), angle) / lightest
    room = 4 - squared * (1 + 2 * data.damping.beta / step)
    if room.min() <= 0:
        return float(np.inf)
    _, weights = stencil(dx * np.linspace(0.0, 0.95, 20), dx)
    seen = _seen(weights, angle)
    largest = float(np.trapezoid(seen / room, angle, axis=1).max()) / np.pi
    return step**2 / (lightest * data.contact_wire.mass * dx) * largest


def missing_yield(wire: Wire, dx: float, step: float, weights: Array) -> Array:
    """Missing compliance (m/N), (points,), of a wire on a grid at points between its nodes.

    weights: (points, 4), with which a force at a point acts on the four nodes, and with which the wire is
    read there. The kink under a force is narrower than the grid. The wire's compliance is the integral of
    1 / (2 pi (T k^2 + EI k^4)) over all wavenumbers k, the grid's that of W W* / (2 pi K) over the waves that
    it resolves. The difference is of first order in the spacing and depends on the place between two nodes.
    """
    count = 512
    angle = (np.arange(count) + 0.5) * np.pi / count  # of a wave from node to node
    stiffness = _response(stencil_weights(wire, dx, step) * wire.mass * dx / step**2, angle)
    second, fourth = wire.tension / dx, wire.bending_stiffness / dx**3
    carried = (1 / (second * angle**2 + fourth * angle**4) - _seen(weights, angle) / stiffness).mean(axis=1)
    ratio = np.sqrt(fourth / second)
    shorter = (1 / np.pi - ratio * (np.pi / 2 - np.arctan(np.pi * ratio))) / (np.pi * second)
    return np.asarray(carried + shorter)


def _response(weights: Array, angle: Array) -> Array:
    """Response of a stencil to a wave of amplitude 1, by the wave's angle from node to node."""
    near, far = weights
    return np.asarray(2 * near * (1 - np.cos(angle)) + 2 * far * (1 - np.cos(2 * angle)))


def _seen(weights: Array, angle: Array) -> Array:
    """Power of each wave at points among four nodes, from their weights (points, 4): (points, waves)."""
    return np.asarray(np.abs(weights @ np.exp(1j * np.outer(np.arange(4), angle))) ** 2)


def spring_levels(stiffness: float, damping: float, step: float) -> Array:
    """Weights of a spring (N/m) and damper (N s/m) on three time levels, newest first (N/m)."""
    mean = stiffness * np.array([0.25, 0.5, 0.25])
    return np.asarray(mean + damping / (2 * step) * np.array([1.0, 0.0, -1.0]))


def stencil_weights(wire: Wire, dx: float, step: float) -> Array:
    """Weights of the nearest and second nearest nodes in the wire's force, as a displacement in a step."""
    courant = np.sqrt(wire.tension / wire.mass) * step / dx
    second = wire.tension / dx**2
    fourth = -second * (1 - courant**2) / 12 - wire.bending_stiffness / dx**4
    weights = np.array([second - 4 * fourth, fourth])
    return np.asarray(step**2 / wire.mass * weights)
