"""Wind across the track on the wires of a flexible line: what gusts push, and what still air would not damp.

A wire of diameter D in a wind U with a vertical gust w, which moves up with v, has the vertical force
rho D C_D U (w - v) / 2 per metre (quasi-steady, gusts and motion small beside U). Gusts are computed at
points some nodes apart, and every few steps; between these they are interpolated.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import DTypeLike

from ....backend import WIDTH, bind, called, kernel, load_row, open_packed, pack, store_row
from ....base.arrays import Array
from ...functions import cosine_of_turns, sine_of_turns
from ...wind import SHORTEST_WAVE, SIDE_ROWS
from ..protocol import advance_wire, end_step
from ..schema import Wire
from .arrays import PAD, STENCIL, Air, FlexibleLine, FlexibleWire, Gusts

AIR_DENSITY = 1.225  # kg/m^3, at 15 degrees and sea level
DRAG = 1.2  # C_D of a wire: that of a smooth cylinder at Reynolds numbers from 1e3 to 1e5
COPPER, ICE = 8900.0, 900.0  # kg/m^3
STRAND = 0.76  # share of a strand's circle that is metal, for a messenger (nineteen wires)
HEAVIEST = 1.6  # metal of one wire (kg/m); a heavier one stands for two side by side, each in the wind
POINTS_PER_WAVE = 6  # of the shortest gusts along the track
INTERVAL = 0.01  # time between two computations of the gusts (s): ten in the quickest one at 30 m/s
SETTLED = 2.0
"""Time for which wires are blown upon before a run, in time constants of the damping by wind and wire: their
variance is within 2 % of its steady value. A time constant is 1 / (alpha / 2 + drag / 2)."""
NO_AIR = Air(np.zeros(0), 1, 1)


def diameter(wire: Wire, strand: bool, ice: float) -> float:
    """Of a wire (m), or of those that it stands for in sum: their mass as copper, ice (kg/m) in a coat."""
    metal = wire.mass - ice
    count = math.ceil(metal / HEAVIEST)
    area = metal / (COPPER * (STRAND if strand else 1.0)) + ice / ICE
    return math.sqrt(4 * count * area / math.pi)


def air_about(line: FlexibleLine, wires: tuple[Wire, Wire], ice: float, time_step: float) -> Air:
    """Air about contact and messenger wire, as heavy as they are with ice (kg/m)."""
    drag = [
        AIR_DENSITY * diameter(wire, strand, ice) * DRAG / (2 * wire.mass)
        for wire, strand in zip(wires, (False, True), strict=True)
    ]
    return Air(
        drag=np.array(drag * line.pairs),
        block=max(1, int(SHORTEST_WAVE / POINTS_PER_WAVE / line.spacing)),
        every=max(1, round(INTERVAL / time_step)),
    )


def still(air: Air, rows: int, lanes: int, real: DTypeLike) -> Gusts:
    """Gusts of lanes before any is drawn, over segments of so many rows."""
    windy = bool(air.drag.size)
    points = (math.ceil(rows / air.block) + 1) * windy
    return Gusts(
        table=np.zeros((lanes, SIDE_ROWS * windy)),
        step=np.zeros(lanes, dtype=np.int64),
        past=np.zeros((lanes, points, WIDTH), dtype=real),
        coming=np.zeros((lanes, points, WIDTH), dtype=real),
        turning=np.zeros((lanes, 2, WIDTH), dtype=real),
    )


def start_wind(line: FlexibleLine, wire: FlexibleWire, lane: int, rows: Array) -> None:
    """Let a wind, (SIDE_ROWS,), blow on a lane's wires at rest, until they move as in a steady one."""
    gusts, every = wire.gusts, line.air.every
    gusts.table[lane] = rows
    gusts.past[lane] = gusts.coming[lane] = 0.0
    steps = 0
    if rows[1:].any():
        keep = float(line.stencil[0, 0, STENCIL.KEEP])
        slowest = (1 - keep) / 2 + float(line.air.drag.min()) * rows[0] / 2
        steps = math.ceil(SETTLED / slowest / every) * every
    # In the first interval the wind rises to its gusts.
    gusts.step[lane] = -steps - every
    bind(blow_alone, pack(line, wire), 0, 0)(lane, steps + every)


@kernel
def blow_alone(packed, lane, steps):
    """Advance a lane's wires without a train; packed: line and wire."""
    line, wire = open_packed(packed)
    for _ in range(steps):
        advance_wire(line, wire, lane)
        end_step(line, wire, lane)


@called
def find_gusts(line, gusts, lane, steps):
    """Compute the gusts at all points after a number of steps."""
    table, coming, turning = gusts.table[lane], gusts.coming[lane], gusts.turning[lane]
    for q in range(coming.shape[0]):
        store_row(coming, q, 0.0 * load_row(coming, q))
    for k in range(1, table.size, 4):
        amplitude, wavenumber = table[k], table[k + 2]
        if amplitude != 0.0:
            for j in range(WIDTH):
                x = j * line.rows * line.spacing
                turns = table[k + 1] * steps + wavenumber * x + table[k + 3]
                turning[0, j] = amplitude * cosine_of_turns(turns)
                turning[1, j] = amplitude * sine_of_turns(turns)
            cosine, sine = load_row(turning, 0), load_row(turning, 1)
            along = wavenumber * line.air.block * line.spacing
            by_cosine, by_sine = cosine_of_turns(along), sine_of_turns(along)
            for q in range(coming.shape[0]):
                store_row(coming, q, load_row(coming, q) + cosine)
                cosine, sine = by_cosine * cosine - by_sine * sine, by_sine * cosine + by_cosine * sine


@called
def blow(line, gusts, lane, d, inertia):
    """Change all wires' increments by the wind of one step; their damping by air is implicit in it."""
    if gusts.table.shape[1] > 0:
        air, past, coming = line.air, gusts.past[lane], gusts.coming[lane]
        since = gusts.step[lane] % air.every
        if since == 0:
            for q in range(past.shape[0]):
                store_row(past, q, load_row(coming, q))
            find_gusts(line, gusts, lane, gusts.step[lane] + air.every)
        part = (since + 0.5) / air.every
        gusts.step[lane] += 1
        for w in range(d.shape[0]):
            held = air.drag[w] * gusts.table[lane, 0]
            share = held / (1.0 + held)
            its_d, its_inertia = d[w], inertia[w]
            for q in range(past.shape[0] - 1):
                begin = load_row(past, q) + part * (load_row(coming, q) - load_row(past, q))
                end = load_row(past, q + 1) + part * (load_row(coming, q + 1) - load_row(past, q + 1))
                rise = (end - begin) / (1.0 * air.block)
                for i in range(q * air.block, min((q + 1) * air.block, line.rows)):
                    gust = begin + (1.0 * (i - q * air.block)) * rise
                    step = share * (gust - load_row(its_d, i + PAD))
                    if its_inertia.shape[0] > 0:
                        step = load_row(its_inertia, i) * step
                    store_row(its_d, i + PAD, load_row(its_d, i + PAD) + step)
