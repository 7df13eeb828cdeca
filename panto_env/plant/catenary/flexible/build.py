"""Constants of a flexible catenary on its grid, and its wires at rest."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np

from ....backend import CACHE_LINE, WIDTH, aligned_zeros
from ....base.arrays import Array, Index
from ....base.checksums import remembered
from ....base.errors import InputError
from ...numerics import Numerics
from ...state import LARGEST_SPEED
from .arrays import PAD, Beside, FlexibleLine, FlexibleWire
from .blown import NO_AIR, still
from .grid import nodes_per_span, second_differences, stencil_weights
from .near import near_droppers
from .on_grid import OnGrid, on_grid
from .resolution import Resolution
from .scattered_build import begin_window, room_for, scattered
from .schema import FlexibleCatenaryData
from .shape import Located, Profile, heights_of_pair, located
from .static import StaticShape
from .wire_defects import NO_DEFECTS, WireDefects
from .wires import lay_out, places

SHAPE_SPACING = 0.05  # m, of the table of the static height; EI rounds kinks over about 0.1 m
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
    """A line of ``spans`` spans, or of its own sequence, with its static shape, at a stable resolution.

    own: defects of the contact wire itself, at positions along the whole line; a travelling window cannot
    have any. Raises InputError for more nodes than ``MOST_NODES``.
    """
    differ = data.one_by_one
    strides = data.spans if data.sequence else spans
    window = min(resolution.window or strides, strides)
    per_stride = nodes_per_span(data, resolution.spacing)
    dx = data.stride / per_stride
    # Where spans are alike, all windows have the same nodes.
    covered = strides if differ else window
    count = covered * per_stride + 1 + 2 * PAD
    if count > MOST_NODES:
        raise InputError(
            f"A grid of {dx:g} m over {covered} spans of line '{data.name}' has {count:,} nodes per wire; "
            f"the maximum is {MOST_NODES:,}, so take a coarser spacing or a smaller window."
        )
    x = dx * (np.arange(count) - PAD)
    layout = data.layout(covered)
    grid = on_grid(layout, shape, per_stride, x, resolution.time_step, own)
    real = np.float32 if numerics.precision == "single" else np.float64
    rows = per_stride * window // WIDTH
    mast_row, mast_segment = places(per_stride * np.arange(1, 1 if differ else window), rows)
    kept = rows * WIDTH + 1 + 2 * PAD  # nodes of the first window
    inertia, mobility = grid.inertia[:, :kept], grid.mobility[:, :kept].copy()
    mobility[:, -PAD - 1 :] = 0.0
    tensioned = of_tension(data, shape, dx, resolution.time_step)
    return FlexibleLine(
        spacing=dx,
        alignment=data.alignment(spans).arrays,
        stride=data.stride,
        starts=data.stride * np.arange(strides + 1),
        window=window,
        lead=0.0,
        rows=rows,
        shape=tensioned.shape[None],
        shape_length=data.period,
        rise=np.zeros((1, 0, 5)),
        rise_breaks=np.zeros(0),
        rise_decay=np.zeros(1),
        stencil=tensioned.stencil[None].astype(real),
        absorbing=tensioned.absorbing[None],
        inertia=np.ascontiguousarray(
            lay_out(inertia, rows, real)[:, PAD : -PAD if (grid.inertia != 1).any() else PAD]
        ),
        mobility=lay_out(mobility, rows, float),
        mast_row=mast_row,
        mast_segment=mast_segment,
        free_uplift=data.free_uplift,
        largest_move=LARGEST_SPEED * resolution.time_step,
        link_static=shape.over(covered).dropper_tension[None].astype(real),
        link_gap=np.zeros((1, len(grid.links.position)), dtype=real),
        scattered=scattered(grid if differ else None, real),
        pairs=layout.pairs,
        beside=Beside(tensioned.beside[None], np.zeros((1, 0, 5)), np.zeros(0)),
        near=near_droppers(data, grid, dx, resolution.time_step, per_stride, strides if differ else 0),
        air=NO_AIR,
        **_in_equal_rows(grid, differ, rows, real),
    )


class Sets:
    """Things attached to the wires, in sets: at most one per segment, all on the same wires and rows."""

    def __init__(self, wires: Index, node: Index, rows: int) -> None:
        """wires: (things, ends) that each hangs on; node: (things,), the first one's number."""
        row, self.segment = places(node, rows)
        found = dict[tuple[int, ...], int]()  # by row, wires, and how many are in the segment already
        self.number, there = np.zeros(len(node), dtype=np.int64), Counter[tuple[int, ...]]()
        for k, place in enumerate(zip(row.tolist(), *wires.T.tolist(), strict=True)):
            own = (*place, int(self.segment[k]))
            self.number[k] = found.setdefault((*place, there[own]), len(found))
            there[own] += 1
        keys = np.array(list(found), dtype=np.int64).reshape(len(found), 2 + wires.shape[1])
        self.row, self.wires = keys[:, 0].copy(), keys[:, 1:-1].copy()

    def of(self, values: Array, kind: Any, empty: float = 0.0) -> Array:
        """Values, (things, ...), as (sets, ..., WIDTH), ``empty`` where a segment has none of a set."""
        array = np.full((len(self.row), WIDTH, *values.shape[1:]), empty, dtype=kind)
        array[self.number, self.segment] = values
        return np.ascontiguousarray(np.moveaxis(array, 1, -1))


def _in_equal_rows(grid: OnGrid, differ: bool, rows: int, real: Any) -> dict[str, Any]:
    """Fields of ``FlexibleLine`` for springs and links in sets of equal rows.

    differ: whether spans do. All is scattered then.
    """
    some = slice(0, 0) if differ else slice(None)
    springs, links, yielding = grid.springs, grid.links, grid.spring_yield
    held = Sets(springs.wire[some, None], grid.at_springs.first[some] + 1, rows)
    joined = Sets(links.wires[some], grid.at_links.first[some], rows)
    pull = yielding * springs.levels / (1 + springs.levels[:, :1] * yielding)

    def of_links(values: Array, empty: float = 0.0) -> Array:
        return joined.of(values[some], real, empty)

    return {
        "spring_wire": held.wires[:, 0],
        "spring_row": held.row,
        "spring_pull": held.of(pull[some], real),
        "link_wire": joined.wires,
        "link_row": joined.row,
        "link_weight": of_links(grid.at_links.weights),
        "link_move": of_links(grid.move.reshape(len(grid.move), -1)),
        "link_pull": of_links(grid.pull),
        "link_room": of_links(grid.room, 1.0),
        "link_set": joined.number,
        "link_segment": joined.segment,
    }


class Tensioned(NamedTuple):
    """Constants of a line that depend on the wires' tension: one row of each in ``FlexibleLine``."""

    shape: Array  # (n,)
    beside: Array  # (n,), or none: of the second pair
    stencil: Array  # (wires, 6)
    absorbing: Array  # (wires,)


def of_tension(data: FlexibleCatenaryData, shape: StaticShape, dx: float, step: float) -> Tensioned:
    """Constants that depend on tension, for a grid of spacing ``dx`` (m) and a time step (s)."""
    damping, layout = data.damping, data.layout()
    wires = data.wires * layout.pairs
    settle = 1.0 + damping.alpha * step / 2
    damped = (1.0 - damping.alpha * step / 2) / settle, damping.beta / step, QUIET
    weights = [second_differences(stencil_weights(wire, dx, step, damping.beta)) for wire in wires]
    courant = np.array([wire.wave_speed for wire in wires]) * step / dx
    if isinstance(shape.contact, Profile):
        breaks, _, _, repeats = own = shape.contact
        at = _table(data.period, tuple(breaks.tolist()), repeats)
        heights, beside = (
            own.height_at(at),
            np.zeros(0) if shape.second is None else shape.second.height_at(at),
        )
    else:
        heights, beside = (heights_of_pair(layout, shape, k, _table_places(data.period)) for k in (0, 1))
    return Tensioned(
        shape=heights,
        beside=beside,
        stencil=np.array([[*each / settle, *damped] for each in weights]),
        absorbing=(courant - 1) / (courant + 1),
    )


@remembered
def _table(period: float, breaks: tuple[float, ...], repeats: bool) -> Located:
    return located(np.array(breaks), _table_places(period), repeats)


def _table_places(period: float) -> Array:
    return np.linspace(0, period, int(np.ceil(period / SHAPE_SPACING)) + 1)


def at_rest(line: FlexibleLine, lanes: int, collectors: int) -> FlexibleWire:
    """Wires of all lanes in their static shape, at the line's start."""
    wires, real = line.mobility.shape, line.stencil.dtype
    own = room_for(line, lanes)
    apart = own.links.node.shape[1] + own.hung.node.shape[1], 2 * own.masts.node.shape[1]  # sets
    sets, springs = len(line.link_row) + apart[0], len(line.spring_row) + apart[1]
    each, contacts = lanes if line.scattered.mobility.size else 1, collectors * line.pairs

    def at_contacts(kind: Any = float) -> Any:
        return np.zeros((lanes, contacts), dtype=kind)

    def of_links() -> Array:
        return np.zeros((lanes, sets, WIDTH), dtype=real)

    wire = FlexibleWire(
        # The leapfrog reads and writes both side by side. Were they at the same place of a page, a processor
        # would take a read of one for a read of what it has just written to the other, and wait.
        displacement=aligned_zeros((lanes, *wires), real, place=0),
        increment=aligned_zeros((lanes, *wires), real, place=21 * CACHE_LINE),
        travelled=np.zeros(lanes, dtype=np.int64),
        inertia=np.repeat(line.inertia[None], each, axis=0),
        mobility=np.repeat(line.mobility[None], each, axis=0),
        contact_row=at_contacts(int),
        contact_segment=at_contacts(int),
        contact_weight=np.zeros((lanes, contacts, 4)),
        contact_missing=at_contacts(),
        unmoved_height=at_contacts(),
        pressed=at_contacts(),
        near_missing=at_contacts(),
        near_set=np.full((lanes, contacts), -1),
        near_segment=at_contacts(int),
        near_gap=at_contacts(real),
        spring_past=np.zeros((lanes, springs, WIDTH), dtype=real),
        extension=of_links(),
        change=of_links(),
        static=np.ones((lanes, sets, WIDTH), dtype=real),  # where there is no link, none is ever slack
        gap=of_links(),
        scattered=own,
        gusts=still(line.air, line.rows, lanes, real),
    )
    for lane in range(lanes):
        settle(line, wire, lane)
    return wire


def settle(line: FlexibleLine, wire: FlexibleWire, lane: int) -> None:
    """Put one lane's wires at rest at the line's start."""
    for array in (wire.displacement, wire.increment, wire.change):
        array[lane] = 0.0
    wire.travelled[lane] = 0
    wire.pressed[lane] = 0.0
    wire.near_set[lane] = -1
    row, links = min(lane, len(line.link_static) - 1), len(line.link_set)
    wire.static[lane, line.link_set, line.link_segment] = line.link_static[row, :links]
    wire.gap[lane, line.link_set, line.link_segment] = line.link_gap[row, :links]
    wire.extension[lane] = 0.0 - wire.gap[lane]
    if line.scattered.mobility.size:
        begin_window(line, wire, lane)
