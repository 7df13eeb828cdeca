"""Waves of the contact wire that run ahead of a train, and the grid that carries them.

A force that changes at f Hz and travels at v sends waves ahead whose length shrinks with the train's distance
from the wave speed: omega(k) = 2 pi f + k v, without bending 2 pi / k = (c - v) / f. Two errors of a grid
grow with k: it carries no wave of less than two nodes, and a clamp, which hangs on two nodes, reflects too
little. Both limits were set where figures of the catalogue's lines and of drawn ones leave their bounds,
those of ``fine_enough`` in ``resolution``.
"""

from __future__ import annotations

import math

import numpy as np

from ..schema import Wire
from .schema import FlexibleCatenaryData

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
    return min(carried, _clamp_grid(data, speed))


def _clamp_grid(data: FlexibleCatenaryData, speed: float) -> float:
    """Spacing (m) on which a contact wire's clamp reflects waves well enough."""
    wire, mass = data.contact_wire, max(own.contact_clamp_mass for own in data.dropper_tables)
    number = wave_ahead(wire, speed, CLAMP_HZ)
    share = (2 * math.pi * CLAMP_HZ + speed * number) * mass / (2 * wire.impedance)
    return math.sqrt(CLAMP_ERROR / share) / number if share > 0 else math.inf
