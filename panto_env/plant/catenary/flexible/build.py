"""Constants of a flexible catenary on its grid: wires, springs to the ground, and links between wires."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....backend import CACHE_LINE, aligned_zeros
from ....base.arrays import Array, Index
from ....base.errors import InputError
from ...interpolation import stencil
from ...numerics import Numerics
from ...state import CONTACTS
from ...valid_range import LARGEST_SPEED
from .grid import nodes_per_span, spring_levels, stencil_weights
from .line import CONTACT, LOWER, MESSENGER, PAD, UPPER, FlexibleLine, FlexibleWire
from .resolution import Resolution
from .schema import FlexibleCatenaryData
from .static_shape import StaticShape

SHAPE_SPACING = 0.05  # m, of the table of the static height; EI rounds kinks over about 0.1 m
MOST_NODES = 1_000_000
"""Of a wire on its grid: more would take the memory of a machine, and a run of them days."""
QUIET = 1e-25
"""Load (m per step) that keeps wires at rest away from subnormal numbers, which are slow; it moves a wire by
less than 1e-15 m."""


class Springs(NamedTuple):
    """What holds wires to the ground."""

    wire: Index  # (springs,)
    node: Index  # (springs,): of that wire
    levels: Array  # (springs, 3): weights of three time levels, newest first (N/m)
    mass: Array  # (springs,): that moves with the wire (kg)


class Links(NamedTuple):
    """What joins two wires at one place along the line, and pulls only."""

    wires: Index  # (links, 2): the lower and the upper one
    position: Array  # (links,): m
    stiffness: Array  # (links,): in tension (N/m)
    mass: Array  # (links, 2): that moves with its lower and upper end (kg)


def constants(
    data: FlexibleCatenaryData, shape: StaticShape, spans: int, numerics: Numerics, resolution: Resolution
) -> FlexibleLine:
    """Constants of an intact line of ``spans`` spans, each of a static shape, at a stable resolution.

    Raises InputError where the nodes are too many.
    """
    window = min(numerics.window_in_use or spans, spans)
    step, damping = resolution.time_step, data.damping
    per_span = nodes_per_span(data, resolution.spacing)
    dx = data.span_length / per_span
    nodes = window * per_span + 1 + 2 * PAD
    if nodes > MOST_NODES:
        raise InputError(
            f"A grid of {dx:g} m over {window} spans of line '{data.name}' has {nodes:,} nodes a wire; "
            f"{MOST_NODES:,} at most can be computed, so take a coarser spacing or a smaller window."
        )
    wires = (data.contact_wire, data.messenger_wire)
    masts = PAD + per_span * np.arange(1, window)
    springs, links = _springs(data, masts, step), _droppers(data, shape, window)
    room = shape.messenger.height(links.position) - shape.contact.height(links.position)
    first, weights = stencil(links.position, dx)
    four = (first + PAD)[:, None] + np.arange(4)

    # Masses hang on the two nearest nodes: the cubic weights would make some nodes lighter than bare wire,
    # or of negative mass, and waves grow there.
    right = (links.position / dx - (first + 1))[:, None]
    shares = np.concatenate([0 * right, 1 - right, right, 0 * right], axis=1)
    own = np.array([[wire.mass * dx] for wire in wires])
    added = np.zeros((len(wires), nodes))
    for end in (LOWER, UPPER):
        np.add.at(added, (links.wires[:, end, None], four), shares * links.mass[:, end, None])
    np.add.at(added, (springs.wire, springs.node), springs.mass)
    mass = own + added
    settle = 1.0 + damping.alpha * step / 2
    mobility = step**2 / mass / settle
    mobility[:, : PAD + 1] = mobility[:, -PAD - 1 :] = 0.0  # no force moves the ends
    inertia = own / mass

    move = np.stack([mobility[links.wires[:, end, None], four] * weights for end in (LOWER, UPPER)], axis=1)
    relative = 0.5 * (weights * move.sum(axis=1)).sum(axis=1)
    early, late = (0.5 + sign * damping.beta / step for sign in (-1, 1))
    linear = np.outer(links.stiffness, (early, late)) / (1 + late * links.stiffness * relative)[:, None]

    real = np.float32 if numerics.precision == "single" else np.float64
    keep = (1.0 - damping.alpha * step / 2) / settle
    rows = [[*stencil_weights(wire, dx, step) / settle, keep, damping.beta / step, QUIET] for wire in wires]
    courant = np.array([np.sqrt(wire.tension / wire.mass) for wire in wires]) * step / dx
    table = int(np.ceil(data.span_length / SHAPE_SPACING)) + 1
    return FlexibleLine(
        spacing=dx,
        span=data.span_length,
        spans=spans,
        window=window,
        shape=shape.contact.height(np.linspace(0, data.span_length, table)),
        rise=np.zeros((1, 0, 4)),
        rise_breaks=np.zeros(0),
        rise_decay=0.0,
        stencil=np.array(rows, dtype=real),
        absorbing=(courant - 1) / (courant + 1),
        inertia=(inertia if inertia.min() < 1 else inertia[:, :0]).astype(real),
        mobility=mobility,
        uplift_node=CONTACT * nodes + masts.astype(np.int64),
        free_uplift=data.free_uplift,
        largest_move=LARGEST_SPEED * step,
        spring_node=springs.wire * nodes + springs.node,
        spring_mobility=mobility[springs.wire, springs.node],
        spring_levels=springs.levels,
        half=np.array([0.5], dtype=real),
        link_node=links.wires * nodes + (first + PAD)[:, None],
        link_weight=weights.astype(real),
        link_move=move.astype(real),
        link_linear=linear.astype(real),
        link_yield=relative.astype(real),
        link_stiffness=links.stiffness.astype(real),
        link_room=room.astype(real),
        link_static=np.tile(shape.dropper_tension, (1, window)).astype(real),
        link_gap=np.zeros((1, len(first)), dtype=real),
    )


def dropper_positions(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m), (droppers,), of the droppers of so many spans."""
    offsets = np.array(data.droppers.positions)
    return np.asarray(np.add.outer(np.arange(spans) * data.span_length, offsets).ravel())


def _springs(data: FlexibleCatenaryData, masts: Index, step: float) -> Springs:
    """At each mast the steady arm of the contact wire, then the support of the messenger."""
    arm, support = data.steady_arm, data.support
    levels = [
        spring_levels(arm.stiffness, 0.0, step),
        spring_levels(support.stiffness, support.damping, step),
    ]
    return Springs(
        wire=np.tile(np.array([CONTACT, MESSENGER], dtype=np.int64), len(masts)),
        node=np.repeat(masts.astype(np.int64), 2),
        levels=np.tile(levels, (len(masts), 1)),
        mass=np.tile([arm.mass, 0.0], len(masts)),
    )


def _droppers(data: FlexibleCatenaryData, shape: StaticShape, spans: int) -> Links:
    droppers, half = data.droppers, np.tile(shape.dropper_mass / 2, spans)
    return Links(
        wires=np.tile(np.array([CONTACT, MESSENGER], dtype=np.int64), (len(half), 1)),
        position=dropper_positions(data, spans),
        stiffness=np.tile(shape.dropper_stiffness, spans),
        mass=np.stack([half + droppers.contact_clamp_mass, half + droppers.messenger_clamp_mass], axis=1),
    )


def at_rest(line: FlexibleLine, lanes: int) -> FlexibleWire:
    """Wires of all lanes in their static shape."""
    (wires, nodes), links, real = line.mobility.shape, len(line.link_node), line.stencil.dtype
    # The leapfrog reads and writes these side by side. Were they at the same place of a page, a processor
    # would take a read of one for a read of what it has just written to another, and wait.
    displacement = aligned_zeros((lanes, wires, nodes), real)
    increment = aligned_zeros((lanes, wires, nodes), real, place=21 * CACHE_LINE)
    return FlexibleWire(
        displacement=displacement,
        increment=increment,
        all_displacement=displacement.reshape(lanes, wires * nodes),
        all_increment=increment.reshape(lanes, wires * nodes),
        blend=aligned_zeros((lanes, nodes), real, place=42 * CACHE_LINE),
        first_span=np.zeros(lanes, dtype=np.int64),
        contact_node=np.zeros((lanes, CONTACTS), dtype=np.int64),
        contact_weight=np.zeros((lanes, CONTACTS, 4)),
        unmoved_height=np.zeros((lanes, CONTACTS)),
        spring_past=np.zeros((lanes, len(line.spring_node))),
        extension=np.zeros((lanes, 2, links), dtype=real),
        change=np.zeros((lanes, links), dtype=real),
    )
