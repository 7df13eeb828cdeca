"""Finite-element run of a train of lumped-mass pantographs along a flexible line.

Newmark's average acceleration; slack droppers and the unilateral contacts are solved exactly in each
step as one small linear complementarity problem over the factorised line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.pantograph.schema import PantographData

from .contacts import Collector, Contacts
from .figures import Figures, figures, stretch
from .hermite import Array
from .newmark import Newmark
from .side_wind import SideWind
from .static import StaticShape, static_shape
from .system import LineSystem, build

__all__ = [
    "Collector",
    "Figures",
    "Motion",
    "Result",
    "StaticShape",
    "figures",
    "simulate",
    "static_shape",
    "stretch",
]


@dataclass(frozen=True)
class Motion:
    """A train whose speed changes evenly from one time to the next, and stays after the last."""

    times: Array  # shape (n,) (s), from 0
    speeds: Array  # shape (n,) (m/s)

    def until(self, distance: float, step: float) -> tuple[Array, Array, Array]:
        """Times (s), places (m) and speeds (m/s), in steps of ``step`` (s), up to a distance (m)."""
        time = step * np.arange(int((distance / self.speeds.min() + self.times[-1]) / step) + 2)
        both = np.union1d(time, self.times)
        way = cumulative_trapezoid(np.interp(both, self.times, self.speeds), both, initial=0.0)
        places = np.interp(time, both, way)
        there = places <= distance + 1e-9
        return time[there], places[there], np.interp(time[there], self.times, self.speeds)


@dataclass(frozen=True)
class Result:
    """One pass of a collector; n_times steps from the start of the first one at x = 0, heights over nominal
    contact wire height."""

    time: Array  # shape (n_times,) (s)
    position: Array  # position of the collector, shape (n_times,) (m): negative while it waits at the anchor
    contact_force: Array  # unfiltered, of all wires that are touched, shape (n_times,) (N)
    head: Array  # height of the collector head, shape (n_times,) (m)
    wire: Array  # height of the lowest contact wire at the contact point, shape (n_times,) (m)
    uplift: Array
    """Contact wire in use over its static shape at the interior supports, shape (n_times, spans - 1) (m).

    The whole train's, like all that follows but the force on wires."""
    support_position: Array  # where these stand, shape (spans - 1,) (m)
    dropper_tension: Array
    """Shape (n_times, n_droppers), droppers in order along the line, pair of wires by pair (N)."""
    wire_forces: Array  # contact force on each pair's contact wire, shape (n_times, n_pairs) (N)


def simulate(
    line: FlexibleCatenaryData,
    pantograph: PantographData,
    speed_kmh: float,
    spans: int | None = None,
    element: float = 1.0,
    time_step: float = 1e-3,
    distance: float | None = None,
    motion: Motion | None = None,
) -> Result:
    """Run a pantograph from the wire's end at x = 0, all at rest there, at a speed in km/h.

    ``spans`` and ``distance`` (m) are the line's own and the whole line unless given; ``element``
    (m) bounds the elements, ``time_step`` is in s. The spring to the ground is unloaded with the lowest
    mass at nominal contact wire height 0, whatever the height of the first support. ``motion`` gives
    speeds that change, and ``speed_kmh`` is then that at the start.
    """
    system = build(line, line.spans if spans is None else spans, element)
    collectors = [Collector(pantograph)]
    (result,) = ride_together(system, collectors, speed_kmh, time_step, distance, motion=motion)
    return result


def ride(
    system: LineSystem,
    pantograph: PantographData,
    speed_kmh: float,
    time_step: float,
    distance: float | None = None,
    wind: SideWind | None = None,
) -> Result:
    """A run as ``simulate`` makes it, on matrices that are given; wind: on its wires."""
    (result,) = ride_together(system, [Collector(pantograph)], speed_kmh, time_step, distance, wind)
    return result


def ride_together(
    system: LineSystem,
    collectors: Sequence[Collector],
    speed_kmh: float,
    time_step: float,
    distance: float | None = None,
    wind: SideWind | None = None,
    motion: Motion | None = None,
) -> list[Result]:
    """A run of several collectors, one result each; ``distance`` (m) is the first one's.

    Those behind wait at the anchor, pressed against the wire's fixed end, until it is their turn.
    """
    speed, whole = speed_kmh / 3.6, float(system.nodes[-1])
    steps = int(min(distance or whole, whole) / (speed * time_step) + 1e-9)
    time = time_step * np.arange(steps + 1)
    places, speeds = speed * time, np.full(steps + 1, speed)
    if motion is not None:
        time, places, speeds = motion.until(min(distance or whole, whole), time_step)
        steps = len(time) - 1
    wires = Newmark(system.mass, system.damping, system.stiffness, time_step)
    solver = Contacts(system, wires, collectors, speed)
    if wind is not None:
        wind.settle(wires, solver.solve)

    forces = np.zeros((steps + 1, len(collectors), len(system.pairs)))
    heads, lowest = np.zeros((2, steps + 1, len(collectors)))
    tension = np.zeros((steps + 1, system.dropper_tension.size))
    uplift = np.zeros((steps + 1, system.supports.size))
    forces[0], heads[0], lowest[0], tension[0] = solver.start()
    for n in range(1, steps + 1):
        if wind is not None:
            wires.load = wind.push(time[n])
        solver.set_speed(speeds[n])
        forces[n], heads[n], lowest[n], tension[n] = solver.advance(places[n])
        uplift[n] = wires.u[system.supports]
    return [
        Result(
            time,
            places - own.behind,
            forces[:, number].sum(axis=1),
            heads[:, number],
            lowest[:, number],
            uplift,
            system.support_position,
            tension,
            forces[:, number],
        )
        for number, own in enumerate(collectors)
    ]
