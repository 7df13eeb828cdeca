"""Waves of the contact wire that run ahead of a train, and the grid that carries them.

A force that changes at f Hz and travels at v sends waves ahead whose length shrinks with the train's distance
from the wave speed: omega(k) = 2 pi f + k v, without bending 2 pi / k = (c - v) / f. Three errors of a grid
grow with k: it carries no wave of less than two nodes; its bending term is of second order, so that a wave
comes back from the next dropper too early or too late; and a clamp, which hangs on two nodes, reflects
too little. All three limits were set where figures of the catalogue's lines and of drawn ones leave their
bounds, those of ``fine_enough`` in ``resolution``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..schema import Wire
from .schema import FlexibleCatenaryData

CARRIED_HZ, CARRIED_NODES = 100.0, 2.4
"""Frequency (Hz) up to which a grid carries the waves ahead, and its nodes per wave at this frequency.
Impacts hold such frequencies, and what they do to the contact shows in figures below 20 Hz."""
FILTER_HZ = 20.0
"""Frequency (Hz) to which forces are filtered."""
PHASE = 0.115
"""Maximum error of phase of a wave of ``FILTER_HZ`` on its way to the next dropper (rad)."""
CLAMP_HZ, CLAMP_ERROR = 60.0, 1.35
"""Frequency (Hz) of the waves that a clamp must reflect, and a limit of what is missing of their
reflection: the clamp's reactance over the wire's, times the square of the phase from node to node."""


class Wave(NamedTuple):
    """A wave of a wire."""

    number: float  # rad/m
    omega: float  # rad/s, at a place of the wire
    group: float  # speed of its energy (m/s)


def wave_ahead(wire: Wire, speed: float, frequency: float) -> Wave:
    """The wave that a train below the wave speed sends ahead at a frequency (Hz); speed: m/s."""
    # (2 pi f + k v)^2 = (T k^2 + EI k^4) / mass, whose coefficients change sign once: one root is positive.
    mass, shaken = wire.mass, 2 * math.pi * frequency
    squared = wire.tension - mass * speed**2
    roots = np.roots([wire.bending_stiffness, 0.0, squared, -2 * mass * speed * shaken, -mass * shaken**2])
    number = float(roots.real[(roots.real > 0) & (np.abs(roots.imag) < 1e-6 * np.abs(roots.real))].max())
    slope = wire.tension * number + 2 * wire.bending_stiffness * number**3
    omega = shaken + speed * number
    return Wave(number, omega, slope / (mass * omega))


def carrying_grid(data: FlexibleCatenaryData, speed: float) -> float:
    """Spacing (m) of the coarsest grid that carries the waves ahead of a train at a speed (m/s).

    0 from the wave speed on, where every grid is too coarse.
    """
    wire = data.contact_wire
    if speed >= wire.wave_speed:
        return 0.0
    carried = 2 * math.pi / wave_ahead(wire, speed, CARRIED_HZ).number / CARRIED_NODES
    return min(carried, _phase_grid(data, speed), _clamp_grid(data, speed))


def _phase_grid(data: FlexibleCatenaryData, speed: float) -> float:
    """Spacing (m) on which a wave's error of phase at the next dropper is ``PHASE``.

    The stencil of the bending term, EI k^4, misses the share (k dx)^2 / 6, and omega half of that share of
    the term; at a fixed frequency the wavenumber is wrong by the error of omega over the speed at which the
    wave leaves the train. Damping takes the wave away: its error counts up to where it has fallen to 1 / e.
    """
    wire, damping = data.contact_wire, data.damping
    k, omega, group = wave_ahead(wire, speed, FILTER_HZ)
    leaving = group - speed
    lost = wire.bending_stiffness * k**6 / (12 * wire.mass * omega)  # of omega, per square of the spacing
    decay = (damping.alpha + damping.beta * omega**2) / (2 * leaving)  # 1/m
    gaps = np.concatenate([np.diff(own.positions) for own in data.dropper_tables])
    way = float(gaps.max()) if len(gaps) else data.span_length
    if decay * way > 1:
        way = 1 / decay
    error = lost / leaving * way * math.exp(-decay * way)
    return math.sqrt(PHASE / error) if error > 0 else math.inf


def _clamp_grid(data: FlexibleCatenaryData, speed: float) -> float:
    """Spacing (m) on which a contact wire's clamp reflects waves well enough."""
    wire, mass = data.contact_wire, max(own.contact_clamp_mass for own in data.dropper_tables)
    k, omega, _ = wave_ahead(wire, speed, CLAMP_HZ)
    share = omega * mass / (2 * wire.impedance)
    return math.sqrt(CLAMP_ERROR / share) / k if share > 0 else math.inf
