"""Wind across the track in the finite elements: cosines in time and along the track that push both wires."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from panto_env.plant.catenary.schema import Wire

from .hermite import Array, matrices
from .newmark import Newmark
from .system import LineSystem

AIR, DRAG, COPPER, STRAND = 1.225, 1.2, 8900.0, 0.76


def resistance(wire: Wire, wind: float, filled: float) -> float:
    """Vertical force of the air per metre and per m/s between it and a round copper wire (N s/m^2)."""
    diameter = np.sqrt(4 * wire.mass / (np.pi * COPPER * filled))
    return 0.5 * AIR * diameter * DRAG * wind


@dataclass(frozen=True)
class SideWind:
    """Gusts, and the matrices by which they act; of a line with one pair of wires and no stitch wires."""

    gusts: Array  # shape (n, 4): amplitude (m/s), frequency (Hz), wavenumber (1/m), phase (turns)
    nodes: Array
    by_air: sparse.csr_array
    """Force (N) of the air on all unknowns by its vertical speed (m/s) over the wires' nodes."""
    free: Array
    before: float  # time that wires are blown upon before the train starts (s)

    def push(self, time: float) -> Array:
        """Force on all unknowns (N) at a time after the train's start (s)."""
        amplitude, frequency, wavenumber, phase = self.gusts.T
        angle = 2 * np.pi * (np.outer(self.nodes, wavenumber) + (frequency * time + phase))
        speeds = np.zeros(self.free.size)
        speeds[0::4] = speeds[2::4] = np.cos(angle) @ amplitude
        speeds[1::4] = speeds[3::4] = -np.sin(angle) @ (2 * np.pi * wavenumber * amplitude)
        return self.free * (self.by_air @ speeds)

    def settle(self, wires: Newmark, solve: Callable[[Array], Array]) -> None:
        """Blow on the wires alone; all droppers stay taut."""
        steps = round(self.before / wires.step)
        for n in range(-steps + 1, 1):
            wires.load = self.push(n * wires.step)
            wires.correct(solve(wires.predict()[:, None])[:, 0])


def blown_upon(
    system: LineSystem, wires: tuple[Wire, Wire], wind: float, gusts: Array, before: float
) -> tuple[LineSystem, SideWind]:
    """A system whose wires a wind (m/s) damps, and its gusts; wires: contact and messenger."""
    contact, messenger = wires
    by_air = sparse.csr_array((system.free.size, system.free.size))
    _, mass = matrices(system.nodes, contact.model_copy(update={"mass": 1.0}))
    for first, strength in ((0, resistance(messenger, wind, STRAND)), (2, resistance(contact, wind, 1.0))):
        place = np.ravel(4 * np.arange(system.nodes.size)[:, None] + [first, first + 1])
        put = sparse.csr_array(
            (np.ones(place.size), (place, np.arange(place.size))), (system.free.size, place.size)
        )
        by_air = by_air + put @ (strength * mass) @ put.T
    keep = sparse.diags_array(system.free)
    damping = (system.damping + keep @ by_air @ keep).tocsr()
    return replace(system, damping=damping), SideWind(gusts, system.nodes, by_air, system.free, before)
