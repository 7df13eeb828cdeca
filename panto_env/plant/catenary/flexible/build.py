"""Constants of a flexible catenary on its grid, and its wires at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....backend import CACHE_LINE, WIDTH, aligned_zeros
from ....base.arrays import Array
from ....base.errors import InputError
from ....base.remember import remembered
from ...interpolation import stencil
from ...numerics import Numerics
from ...valid_range import LARGEST_SPEED
from .arrays import CONTACT, LOWER, PAD, UPPER, FlexibleLine, FlexibleWire
from .attached import Sets, links_of, springs_of
from .grid import missing_yield, nodes_per_span, stencil_weights
from .resolution import Resolution
from .schema import FlexibleCatenaryData
from .segments import lay_out, places
from .static import StaticShape
from .wire_defects import NO_DEFECTS, WireDefects

SHAPE_SPACING = 0.05  # m, of the table of the static height; EI rounds kinks over about 0.1 m
STIFFEST = 1e8
"""Maximum stiffness of a link on the grid (N/m), in tension."""
MOST_NODES = 1_000_000
"""Maximum number of nodes of a wire: more would fill the memory, and a run would take days."""
QUIET = 1e-25
"""Load (m per step) that keeps wires at rest away from subnormal numbers, which are slow; it moves a wire by
less than 1e-15 m."""


@remembered
def constants(
    data: FlexibleCatenaryData,
    shape: StaticShape,
    spans: int,
    numerics: Numerics,
    resolution: Resolution,
    own: WireDefects = NO_DEFECTS,
) -> FlexibleLine:
    """Constants of a line of ``spans`` spans with the same static shape, at a stable resolution.

    own: defects of the contact wire itself, at positions along the whole line; a travelling window cannot
    have any. Raises InputError for more nodes than ``MOST_NODES``.
    """
    window = min(resolution.window or spans, spans)
    step, damping = resolution.time_step, data.damping
    per_span = nodes_per_span(data, resolution.spacing)
    dx = data.span_length / per_span
    nodes = window * per_span + 1 + 2 * PAD
    if nodes > MOST_NODES:
        raise InputError(
            f"A grid of {dx:g} m over {window} spans of line '{data.name}' has {nodes:,} nodes per wire; "
            f"the maximum is {MOST_NODES:,}, so take a coarser spacing or a smaller window."
        )
    wires = (data.contact_wire, data.messenger_wire)
    masts = PAD + per_span * np.arange(1, window)
    x = dx * (np.arange(nodes) - PAD)
    springs, links = springs_of(data, masts, step, own.springs_of_nodes(x, dx)), links_of(data, shape, window)
    room = shape.messenger.height(links.position) - shape.contact.height(links.position)
    first, weights = stencil(links.position, dx)
    four = (first + PAD)[:, None] + np.arange(4)

    # Masses hang on the two nearest nodes: with cubic weights some nodes would be lighter than bare wire, or
    # have negative mass, and be unstable.
    right = (links.position / dx - (first + 1))[:, None]
    shares = np.concatenate([0 * right, 1 - right, right, 0 * right], axis=1)
    bare = np.array([[wire.mass * dx] for wire in wires])
    added = np.zeros((len(wires), nodes))
    for end in (LOWER, UPPER):
        np.add.at(added, (links.wires[:, end, None], four), shares * links.mass[:, end, None])
    np.add.at(added, (springs.wire, springs.node), springs.mass)
    added[CONTACT] += own.mass_of_nodes(x, dx, data.contact_wire)
    mass = bare + added
    settle = 1.0 + damping.alpha * step / 2
    mobility = step**2 / mass / settle
    mobility[:, : PAD + 1] = mobility[:, -PAD - 1 :] = 0.0  # no force moves the ends
    inertia = bare / mass

    # The compliance that the wires lack on the grid is added to the links.
    ends = [(links.wires == w).sum(axis=1) for w in range(len(wires))]
    missing = sum(
        count * missing_yield(wire, dx, step, weights) for wire, count in zip(wires, ends, strict=True)
    )
    stiffness = 1 / np.maximum(1 / links.stiffness + missing, 1 / STIFFEST)
    move = np.stack([mobility[links.wires[:, end, None], four] * weights for end in (LOWER, UPPER)], axis=1)
    relative = 0.5 * (weights * move.sum(axis=1)).sum(axis=1)
    early, late = (0.5 + sign * damping.beta / step for sign in (-1, 1))
    linear = np.outer(stiffness, (early, late)) / (1 + late * stiffness * relative)[:, None]

    real = np.float32 if numerics.precision == "single" else np.float64
    tensioned = of_tension(data, shape, dx, step)
    rows = per_span * window // WIDTH
    mast_row, mast_segment = places(per_span * np.arange(1, window), rows)
    held = Sets(springs.wire[:, None], springs.node - PAD, rows)
    joined = Sets(links.wires, first, rows)
    yielding = mobility[springs.wire, springs.node, None]
    pull = yielding * springs.levels / (1 + springs.levels[:, :1] * yielding)
    return FlexibleLine(
        spacing=dx,
        alignment=data.alignment(spans).arrays,
        window=window,
        rows=rows,
        shape=tensioned.shape[None],
        rise=np.zeros((1, 0, 5)),
        rise_breaks=np.zeros(0),
        rise_decay=np.zeros(1),
        stencil=tensioned.stencil[None].astype(real),
        absorbing=tensioned.absorbing[None],
        inertia=np.ascontiguousarray(
            lay_out(inertia, rows, real)[:, PAD : -PAD if (inertia != 1).any() else PAD]
        ),
        mobility=lay_out(mobility, rows, float),
        mast_row=mast_row,
        mast_segment=mast_segment,
        free_uplift=data.free_uplift,
        largest_move=LARGEST_SPEED * step,
        spring_wire=held.wires[:, 0],
        spring_row=held.row,
        spring_pull=held.of(pull, real),
        link_wire=joined.wires,
        link_row=joined.row,
        link_weight=joined.of(weights, real),
        link_move=joined.of(move.reshape(-1, 8), real),
        link_linear=joined.of(linear, real),
        link_yield=joined.of(relative, real, 1.0),
        link_stiffness=joined.of(stiffness, real, 1.0),
        link_room=joined.of(room, real, 1.0),
        link_set=joined.number,
        link_segment=joined.segment,
        link_static=np.tile(shape.dropper_tension, (1, window)).astype(real),
        link_gap=np.zeros((1, len(first)), dtype=real),
    )


class Tensioned(NamedTuple):
    """Constants of a line that depend on the wires' tension: one row of each in ``FlexibleLine``."""

    shape: Array  # (n,)
    stencil: Array  # (wires, 5)
    absorbing: Array  # (wires,)


def of_tension(data: FlexibleCatenaryData, shape: StaticShape, dx: float, step: float) -> Tensioned:
    """Constants that depend on tension, for a grid of spacing ``dx`` (m) and a time step (s)."""
    damping, wires = data.damping, (data.contact_wire, data.messenger_wire)
    settle = 1.0 + damping.alpha * step / 2
    keep = (1.0 - damping.alpha * step / 2) / settle
    stencil = [
        [*stencil_weights(wire, dx, step) / settle, keep, damping.beta / step, QUIET] for wire in wires
    ]
    courant = np.array([wire.wave_speed for wire in wires]) * step / dx
    table = int(np.ceil(data.span_length / SHAPE_SPACING)) + 1
    return Tensioned(
        shape=shape.contact.height(np.linspace(0, data.span_length, table)),
        stencil=np.array(stencil),
        absorbing=(courant - 1) / (courant + 1),
    )


def at_rest(line: FlexibleLine, lanes: int, collectors: int) -> FlexibleWire:
    """Wires of all lanes in their static shape."""
    wires, real, sets = line.mobility.shape, line.stencil.dtype, line.link_yield.shape
    wire = FlexibleWire(
        # The leapfrog reads and writes both side by side. Were they at the same place of a page, a processor
        # would take a read of one for a read of what it has just written to the other, and wait.
        displacement=aligned_zeros((lanes, *wires), real, place=0),
        increment=aligned_zeros((lanes, *wires), real, place=21 * CACHE_LINE),
        first_span=np.zeros(lanes, dtype=np.int64),
        contact_row=np.zeros((lanes, collectors), dtype=np.int64),
        contact_segment=np.zeros((lanes, collectors), dtype=np.int64),
        contact_weight=np.zeros((lanes, collectors, 4)),
        unmoved_height=np.zeros((lanes, collectors)),
        spring_past=np.zeros((lanes, len(line.spring_row), WIDTH), dtype=real),
        past_extension=np.zeros((lanes, *sets), dtype=real),
        extension=np.zeros((lanes, *sets), dtype=real),
        change=np.zeros((lanes, *sets), dtype=real),
        static=np.ones((lanes, *sets), dtype=real),  # where there is no link, none is ever slack
        gap=np.zeros((lanes, *sets), dtype=real),
    )
    _take_links(line, wire, slice(None))
    return wire


def settle(line: FlexibleLine, wire: FlexibleWire, lane: int) -> None:
    """Put one lane's wires at rest at the line's start."""
    for array in (wire.displacement, wire.increment, wire.change):
        array[lane] = 0.0
    _take_links(line, wire, slice(lane, lane + 1))
    wire.first_span[lane] = 0


def _take_links(line: FlexibleLine, wire: FlexibleWire, lanes: slice) -> None:
    """Put the links of these lanes at rest, as they are in the line's first window."""
    rows, links = lanes if len(line.link_static) > 1 else slice(None), len(line.link_set)
    wire.static[lanes][:, line.link_set, line.link_segment] = line.link_static[rows, :links]
    wire.gap[lanes][:, line.link_set, line.link_segment] = line.link_gap[rows, :links]
    wire.extension[lanes] = 0.0 - wire.gap[lanes]
