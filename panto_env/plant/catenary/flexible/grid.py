"""Finite differences of a flexible catenary: weights, stability, error at a point force, waves carried.

A force that changes at f Hz and travels at v sends waves ahead whose length shrinks with the train's distance
from the wave speed: omega(k) = 2 pi f + k v, without bending 2 pi / k = (c - v) / f. A grid carries no wave
of less than two nodes, and a clamp, which hangs on two nodes, reflects too little. Both limits were set where
figures of the catalogue's lines and of drawn ones leave the bounds of ``fine_enough`` in ``resolution``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....backend import WIDTH, python_function
from ....base.arrays import Array
from ....base.checksums import remembered
from ...functions import cubic_weights, stencil
from ..schema import Wire
from .schema import FlexibleCatenaryData

BEARABLE = 0.5
"""Share of the stiffness at which one spring is unstable that springs have at most; others are near."""

FITTED = 1.6  # angle from node to node up to which waves are fitted: four nodes per wave
TURNED = 1.3  # maximum angle (rad) by which such a wave turns in a step: beyond it the fit is poor


def nodes_per_span(data: FlexibleCatenaryData, spacing: float) -> int:
    """Nodes per span for a maximum spacing (m): a multiple of ``WIDTH``, for segments of equal size.

    Where spans differ, a span of mean length.
    """
    return WIDTH * int(np.ceil(data.stride / spacing / WIDTH - 1e-9))


def stable(data: FlexibleCatenaryData, dx: float, step: float, lightest: float = 1.0) -> bool:
    """Whether the leapfrog is stable: 0 <= omega^2 dt^2 and omega^2 dt^2 (1 + 2 beta/dt) <= 4.

    And whether its waves turn in a step by at most ``TURNED``. dx: spacing (m). step: s. lightest: mass of
    the most worn contact wire, as a share of a new one's.
    """
    shares = zip(data.wires, (lightest, 1.0), strict=True)
    return all(_stable(wire, dx, step, data.damping.beta, share) for wire, share in shares)


def _stable(wire: Wire, dx: float, step: float, beta: float, lightest: float = 1.0) -> bool:
    if _frequency(wire, FITTED / dx) * step > TURNED:
        return False
    angle = np.linspace(0.0, np.pi, 181)  # of a wave from node to node
    squared = _response(stencil_weights(wire, dx, step, beta), angle) / lightest
    return bool(squared.min() >= -1e-9 and squared.max() * (1 + 2 * beta / step) <= 4 + 1e-9)


@remembered
def finest_stable(wires: tuple[Wire, Wire], beta: float, stride: float, step: float) -> float:
    """Spacing (m) of the finest grid on which a step (s) is stable; beta: s; stride: of a window (m)."""
    count = WIDTH * round(stride / (step * max(wire.wave_speed for wire in wires)) / WIDTH)
    while count > WIDTH and not all(_stable(wire, stride / count, step, beta) for wire in wires):
        count -= WIDTH
    return stride / count


@remembered
def point_gain(wire: Wire, dx: float, step: float, beta: float, lightest: float = 1.0) -> float:
    """Inverse of the stiffness (m/N) from which a force that reads a wire at mid-step is unstable.

    With a force k w at one point the leapfrog is stable while 4 M - dt^2 K stays above dt^2 k W W'. At the
    limit the maximum of k dt^2 W' (4 M - dt^2 K)^-1 W over all places between two nodes is 1; it is an
    integral over the waves of the grid. Infinite where the grid is at its own limit. beta: damping in
    proportion to the stiffness (s). lightest: as in ``stable``.
    """
    angle = np.linspace(0.0, np.pi, 721)  # of a wave from node to node
    squared = _response(stencil_weights(wire, dx, step, beta), angle) / lightest
    room = 4 - squared * (1 + 2 * beta / step)
    if room.min() <= 0:
        return float(np.inf)
    _, weights = stencil(dx * np.linspace(0.0, 0.95, 20), dx)
    seen = _seen(weights, angle)
    largest = float(np.trapezoid(seen / room, angle, axis=1).max()) / np.pi
    return step**2 / (lightest * wire.mass * dx) * largest


def implicit_share(stiffness: Array, gain: Array) -> Array:
    """Least share of the newest extension in the forces of springs with which they are stable.

    A spring (N/m) of which a share s is taken from the newest and as much from the oldest extension is, for
    the leapfrog, one of 1 - 4 s times its stiffness that reads the wire at mid-step. gain: as ``point_gain``,
    of both ends in sum (m/N).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        explicit = np.nan_to_num(BEARABLE / (stiffness * gain), nan=0.0, posinf=1.0)
    return np.maximum((1 - explicit) / 4, 0.0)


def missing_yield(wire: Wire, dx: float, step: float, beta: float, weights: Array) -> Array:
    """Missing compliance (m/N), (points,), of a wire on a grid at points between its nodes.

    weights: (points, 4), with which a force at a point acts on the four nodes, and with which the wire is
    read there. The kink under a force is narrower than the grid. The wire's compliance is the integral of
    1 / (2 pi (T k^2 + EI k^4)) over all wavenumbers k, the grid's that of W W* / (2 pi K) over the waves that
    it resolves. The difference is of first order in the spacing and depends on the place between two nodes.
    """
    angle, stiffness, yielding, shorter = _waves(wire, dx, step, beta)
    return np.asarray((yielding - _seen(weights, angle) / stiffness).mean(axis=1) + shorter)


def missing_between(wire: Wire, dx: float, step: float, beta: float, parts: Array, reach: int) -> Array:
    """Missing compliance (m/N), (2 reach + 1, parts, parts), of a wire on a grid between two of its points.

    The displacement at the first by a force at the second, as in ``missing_yield``. parts: places between two
    nodes, 0 to 1. The first axis counts the cells by which the first point is further along the wire.
    """
    angle, stiffness, yielding, shorter = _waves(wire, dx, step, beta)
    weights = np.stack([python_function(cubic_weights)(part) for part in parts.tolist()])
    seen = weights @ np.exp(1j * np.outer(np.arange(-1, 3), angle))
    cells = np.arange(-reach, reach + 1)
    turned = seen[None] * np.exp(1j * np.outer(cells, angle))[:, None]
    on_grid = np.einsum("mct,dt->mcd", turned / stiffness, seen.conj()).real / len(angle)
    width = np.sqrt(wire.bending_stiffness / wire.tension)
    # From one point to another a wire's displacement falls as that of a string whose kink bending rounds.
    apart = np.abs(cells[:, None, None] + parts[:, None] - parts) * dx
    rounded = width * np.exp(-apart / width) - width if width > 0 else 0.0
    return np.asarray(yielding.mean() + shorter - on_grid - (apart + rounded) / (2 * wire.tension))


def _waves(wire: Wire, dx: float, step: float, beta: float) -> tuple[Array, Array, Array, float]:
    """Waves that a grid carries: angle from node to node, and a wire's stiffness on it against each (N/m).

    Then what the real wire yields to each (m/N), and to all shorter ones in sum.
    """
    count = 512
    angle = (np.arange(count) + 0.5) * np.pi / count
    stiffness = _response(stencil_weights(wire, dx, step, beta) * wire.mass * dx / step**2, angle)
    second, fourth = wire.tension / dx, wire.bending_stiffness / dx**3
    ratio = np.sqrt(fourth / second)
    shorter = (1 / np.pi - ratio * (np.pi / 2 - np.arctan(np.pi * ratio))) / (np.pi * second)
    return angle, stiffness, 1 / (second * angle**2 + fourth * angle**4), float(shorter)


def _response(weights: Array, angle: Array) -> Array:
    """Response of a stencil to a wave of amplitude 1, by the wave's angle from node to node."""
    return np.asarray(weights @ _differences(angle))


def _differences(angle: Array) -> Array:
    """Minus the symmetric differences over one, two and three nodes of waves of amplitude 1: (3, waves)."""
    return np.asarray(2 - 2 * np.cos(np.outer((1, 2, 3), angle)))


def _seen(weights: Array, angle: Array) -> Array:
    """Power of each wave at points among four nodes, from their weights (points, 4): (points, waves)."""
    return np.asarray(np.abs(weights @ np.exp(1j * np.outer(np.arange(4), angle))) ** 2)


def spring_levels(stiffness: Any, damping: Any, step: float, share: Any = 0.25) -> Array:
    """Weights of springs (N/m) and dampers (N s/m) on three time levels, newest first (N/m), (..., 3).

    share: of the newest and of the oldest displacement in a spring's force. With a quarter it is stable for
    any stiffness.
    """
    mean = np.stack([share, 1 - 2 * np.asarray(share), share], axis=-1)
    change = np.multiply.outer(damping, np.array([1.0, 0.0, -1.0])) / (2 * step)
    return np.asarray(np.asarray(stiffness)[..., None] * mean + change)


def stencil_weights(wire: Wire, dx: float, step: float, beta: float) -> Array:
    """Weights of the three nearest nodes on either side in the wire's force, as a displacement in a step.

    Exact for long waves, and by least squares nearest to ``exact_answer`` for waves of up to ``FITTED`` from
    node to node: so the errors of the step, of tension, of bending and of damping cancel. beta: damping in
    proportion to the stiffness (s).
    """
    courant = wire.tension / wire.mass * (step / dx) ** 2
    angle, differences = _fitted(1.0)
    frequency = _frequency(wire, angle / dx)
    # On a fine grid damping lets no short wave swing that need be fitted.
    swinging = beta * frequency < 1
    if not swinging.all():
        angle, differences = _fitted(max(float(angle[swinging].max(initial=angle[0])) / angle[-1], 0.1))
        frequency = _frequency(wire, angle / dx)
    # Relative to what is wanted, so that long and short waves count alike.
    one, two, three = differences / exact_answer(frequency, step, beta)
    far, *_ = np.linalg.lstsq(np.array([two - 4 * one, three - 9 * one]).T, 1 - courant * one)
    return np.array([courant - 4 * far[0] - 9 * far[1], *far])


@remembered
def _fitted(share: float) -> tuple[Array, Array]:
    """Angles from node to node of fitted waves, up to a share of ``FITTED``, and their ``_differences``."""
    angle = (np.arange(64) + 0.5) / 64 * FITTED * share
    return angle, _differences(angle)


def _frequency(wire: Wire, number: Any) -> Any:
    return np.sqrt((wire.tension * number**2 + wire.bending_stiffness * number**4) / wire.mass)


def exact_answer(frequency: Array, step: float, beta: float) -> Array:
    """Response of a stencil to waves with which the leapfrog moves each at its own frequency (rad/s).

    Its damping takes the increment of the step before, so that a wave turns in a step by the angle a with
    2 sqrt(1 - lag g) cos a = 2 - (1 + lag) g, with the response g and lag = beta / dt.
    """
    lag = beta / step
    turned = frequency * np.sqrt(np.maximum(1 - (beta * frequency / 2) ** 2, 0.75)) * step
    sine = np.sin(turned) ** 2
    root = np.cos(turned) * np.sqrt(np.maximum(1 - lag**2 * sine, 0.0))
    return np.asarray(2 * (1 + lag * sine - root) / (1 + lag) ** 2)


def second_differences(weights: Array) -> Array:
    """The same stencil by second differences at a node, at its neighbours, and at those beyond them."""
    return np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 2.0], [0.0, 0.0, 1.0]]) @ weights


CARRIED_HZ, CARRIED_NODES = 50.0, 2.4
"""Frequency (Hz) up to which a grid carries the waves ahead, and its nodes per wave at this frequency.
Impacts hold such frequencies, and what they do to the contact shows in figures below 20 Hz."""
CLAMP_HZ, CLAMP_ERROR = 60.0, 8.0
"""Frequency (Hz) of the waves that a clamp must reflect, and a limit of what is missing of their
reflection: the clamp's reactance over the wire's, times the square of the phase from node to node."""


def wave_ahead(wire: Wire, speed: float, frequency: float) -> float:
    """Wavenumber (rad/m) of the wave that a train below the wave speed sends ahead at a frequency (Hz).

    speed: m/s.
    """
    # (2 pi f + k v)^2 = (T k^2 + EI k^4) / mass, whose coefficients change sign once: one root is positive.
    mass, shaken = wire.mass, 2 * math.pi * frequency
    squared = wire.tension - mass * speed**2
    roots = np.roots([wire.bending_stiffness, 0.0, squared, -2 * mass * speed * shaken, -mass * shaken**2])
    return float(roots.real[(roots.real > 0) & (np.abs(roots.imag) < 1e-6 * np.abs(roots.real))].max())


def carrying_grid(data: FlexibleCatenaryData, speed: float) -> float:
    """Spacing (m) of the coarsest grid that carries the waves ahead of a train at a speed (m/s).

    0 from the wave speed on, where every grid is too coarse.
    """
    wire = data.contact_wire
    if speed >= wire.wave_speed:
        return 0.0
    carried = 2 * math.pi / wave_ahead(wire, speed, CARRIED_HZ) / CARRIED_NODES
    mass, number = max(data.layout(1).of_droppers("contact_clamp_mass")), wave_ahead(wire, speed, CLAMP_HZ)
    share = (2 * math.pi * CLAMP_HZ + speed * number) * mass / (2 * wire.impedance)
    return min(carried, math.sqrt(CLAMP_ERROR / share) / number if share > 0 else math.inf)
