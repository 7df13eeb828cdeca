"""Flexible catenary: two tensioned beams, droppers that go slack, supports and steady arms.

Motion is computed about the static shape by finite differences on a uniform grid, with an explicit
leapfrog in time. The tension term uses the fourth-order modified-wave stencil
delta2 u - (1 - C^2)/12 delta4 u (C: Courant number), whose five points bending needs anyway.
Point loads and droppers act through four nodes by cubic interpolation. Local springs (droppers,
supports, steady arms, contact) act by the mean of two half-steps, which is (1/4, 1/2, 1/4) over three
time levels, each implicitly on its own: they conserve energy and do not bound the step.

The grid covers a window that travels with the train a span at a time, as paper 2's model does. Its ends
are anchors where the line ends and absorb waves elsewhere. A window of all spans is the whole line.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....backend.memory import LINE, aligned_zeros
from ....base.arrays import Array
from ....base.errors import InputError
from ...interpolation import stencil
from ...numerics import Numerics
from ..schema import Wire
from . import step as _motion  # noqa: F401 - its overloads
from .defects import DefectiveLine as DefectiveLine
from .schema import FlexibleCatenaryData
from .state import CONTACT, MESSENGER, PAD, FlexibleLine, FlexibleWire
from .static_shape import StaticShape, solve

SHAPE_SPACING = 0.05  # m, of the table of the static height; EI rounds kinks over about 0.1 m
FINEST, FINE_ENOUGH = 1 / 3, 0.375
"""Grid (m) unless told otherwise, where it is stable, and the coarsest for which the longer time step is
taken: docs/validation.md shows what it costs."""
LONG_STEP, SHORT_STEP = 2.5e-3, 2e-3
"""Time steps (s) unless told otherwise."""
QUIET = 1e-25
"""Load (m a step) that keeps quiet wires away from subnormal numbers; it moves a wire by less than
1e-15 m."""


def wave_speed(data: FlexibleCatenaryData) -> float:
    """Speed of waves along the contact wire (m/s)."""
    return float(np.sqrt(data.contact_wire.tension / data.contact_wire.mass))


def line_length(data: FlexibleCatenaryData, spans: int) -> float:
    """How far a run can go (m): to the far anchor."""
    return spans * data.span_length


def line_end(data: FlexibleCatenaryData, spans: int) -> float:
    """How far a run goes unless told otherwise (m): to the last span, whose anchor reflects waves."""
    return (spans - 1) * data.span_length


def supports(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m) of the supports whose uplift is recorded."""
    return np.asarray(data.span_length * np.arange(1, spans))


def droppers(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m) of the droppers."""
    offsets = np.array(data.droppers.positions)
    return np.asarray(np.add.outer(np.arange(spans) * data.span_length, offsets).ravel())


def static_tension(data: FlexibleCatenaryData, spans: int) -> Array:
    """Static tension (N) of the droppers."""
    return np.tile(solve(data).dropper_tension, spans)


def build(data: FlexibleCatenaryData, spans: int, numerics: Numerics) -> FlexibleLine:
    """Constants of a line of ``spans`` spans.

    Raises InputError where the time step is too long for the grid to be stable.
    """
    shape = solve(data)
    window = min(numerics.window or spans, spans)
    step, beta = time_step(data, numerics), data.damping.beta
    per_span = nodes_per_span(data, numerics.spacing, step)
    dx = data.span_length / per_span
    nodes = window * per_span + 1 + 2 * PAD
    settle = 1.0 + data.damping.alpha * step / 2
    wires = (data.contact_wire, data.messenger_wire)
    first, weights = stencil(droppers(data, window), dx)
    first = first + PAD
    four = first[:, None] + np.arange(4)
    masts = PAD + per_span * np.arange(1, window)

    own = np.array([[wire.mass * dx] for wire in wires])
    mass = own + _added_mass(data, shape, window, nodes, four, weights, masts)
    mobility = step**2 / mass / settle
    mobility[:, : PAD + 1] = mobility[:, -PAD - 1 :] = 0.0  # no force moves the ends
    inertia = own / mass

    stiffness = np.tile(shape.dropper_stiffness, window)
    move = np.stack([mobility[w][four] * weights for w in (CONTACT, MESSENGER)], axis=1)
    relative = 0.5 * (weights * move.sum(axis=1)).sum(axis=1)
    early, late = (0.5 + sign * beta / step for sign in (-1, 1))
    support = np.zeros((len(masts), 2, 3))
    support[:, CONTACT] = levels(data.steady_arm.stiffness, 0.0, step)
    support[:, MESSENGER] = levels(data.support.stiffness, data.support.damping, step)

    real = np.float32 if numerics.precision == "single" else np.float64
    keep = (1.0 - data.damping.alpha * step / 2) / settle
    rows = [[*weights_of(wire, dx, step) / settle, keep, beta / step, QUIET] for wire in wires]
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
        leave=(courant - 1) / (courant + 1),
        inertia=(inertia if inertia.min() < 1 else inertia[:, :0]).astype(real),
        mobility=mobility,
        support_node=masts.astype(np.int64),
        support_spring=support,
        dropper_node=first,
        half=np.array([0.5], dtype=real),
        dropper_weight=weights.astype(real),
        dropper_move=move.astype(real),
        dropper_linear=(
            np.outer(stiffness, (early, late)) / (1 + late * stiffness * relative)[:, None]
        ).astype(real),
        dropper_yield=relative.astype(real),
        dropper_stiffness=stiffness.astype(real),
        dropper_static=np.tile(shape.dropper_tension, (1, window)).astype(real),
        dropper_gap=np.zeros((1, len(first)), dtype=real),
    )


def _added_mass(
    data: FlexibleCatenaryData,
    shape: StaticShape,
    window: int,
    nodes: int,
    four: Any,
    weights: Any,
    masts: Any,
) -> Array:
    """Mass (kg) of clamps, halved droppers and steady arms on the nodes, (2, nodes)."""
    added = np.zeros((2, nodes))
    half = np.tile(shape.dropper_mass / 2, window)
    clamps = (data.droppers.contact_clamp_mass, data.droppers.messenger_clamp_mass)
    for w, clamp in zip((CONTACT, MESSENGER), clamps, strict=True):
        np.add.at(added[w], four, weights * (half + clamp)[:, None])
    added[CONTACT, masts] += data.steady_arm.mass
    return added


def time_step(data: FlexibleCatenaryData, numerics: Numerics) -> float:
    """Time step (s) asked for, or the longer usual one where a grid fine enough is stable with it."""
    if numerics.time_step is not None:
        return numerics.time_step
    grid = numerics.spacing or FINE_ENOUGH
    return LONG_STEP if stable(data, data.span_length / _nodes(data, grid), LONG_STEP) else SHORT_STEP


def nodes_per_span(data: FlexibleCatenaryData, spacing: float | None, step: float) -> int:
    """Nodes a span of the grid asked for (m), or of the finest up to FINEST that is stable."""
    if spacing is not None:
        nodes = _nodes(data, spacing)
        if not stable(data, data.span_length / nodes, step):
            raise InputError(
                f"A time step of {1e3 * step:g} ms is unstable on a grid of {data.span_length / nodes:g} m "
                f"for line '{data.name}'; take a shorter step or a coarser grid."
            )
        return nodes
    for nodes in range(_nodes(data, FINEST), 7, -1):
        if stable(data, data.span_length / nodes, step):
            return nodes
    raise InputError(f"A time step of {1e3 * step:g} ms is too long for line '{data.name}' on any grid.")


def _nodes(data: FlexibleCatenaryData, spacing: float) -> int:
    return int(np.ceil(data.span_length / spacing - 1e-9))


def stable(data: FlexibleCatenaryData, dx: float, step: float) -> bool:
    """Whether no wave of the grid (m) grows: 0 <= omega^2 dt^2 and omega^2 dt^2 (1 + 2 beta/dt) <= 4."""
    angle = np.linspace(0.0, np.pi, 181)  # of a wave from node to node
    for wire in (data.contact_wire, data.messenger_wire):
        near, far = weights_of(wire, dx, step)
        squared = 2 * near * (1 - np.cos(angle)) + 2 * far * (1 - np.cos(2 * angle))
        if squared.min() < -1e-9 or squared.max() * (1 + 2 * data.damping.beta / step) > 4 + 1e-9:
            return False
    return True


def levels(stiffness: float, damping: float, time_step: float) -> Array:
    """Weights of a spring (N/m) and damper (N s/m) on three time levels, newest first (N/m)."""
    mean = stiffness * np.array([0.25, 0.5, 0.25])
    return np.asarray(mean + damping / (2 * time_step) * np.array([1.0, 0.0, -1.0]))


def weights_of(wire: Wire, dx: float, time_step: float) -> Array:
    """Weights of the neighbours and of theirs in the wire's force, as a displacement in a step."""
    courant = np.sqrt(wire.tension / wire.mass) * time_step / dx
    second = wire.tension / dx**2
    fourth = -second * (1 - courant**2) / 12 - wire.bending_stiffness / dx**4
    weights = np.array([second - 4 * fourth, fourth])
    return np.asarray(time_step**2 / wire.mass * weights)


def at_rest(line: FlexibleLine, lanes: int) -> FlexibleWire:
    """Wires of all lanes in their static shape."""
    nodes, count, real = line.mobility.shape[1], len(line.dropper_node), line.stencil.dtype
    return FlexibleWire(
        # The sweep reads and writes these side by side. Were they at the same place of a page, a processor
        # would take a read of one for a read of what it has just written to another, and wait.
        displacement=aligned_zeros((lanes, 2, nodes), real),
        increment=aligned_zeros((lanes, 2, nodes), real, place=21 * LINE),
        blend=aligned_zeros((lanes, nodes), real, place=42 * LINE),
        shifted=np.zeros(lanes, dtype=np.int64),
        support_past=np.zeros((lanes, len(line.support_node), 2)),
        extension=np.zeros((lanes, 2, count), dtype=real),
        change=np.zeros((lanes, count), dtype=real),
    )


def start_point(line: FlexibleLine) -> tuple[float, float, float]:
    """Height (m), compliance of the wire, and of a massless spring (m/N), where a run starts.

    A run starts at the anchor, which does not yield: the pantograph is at rest there exactly.
    """
    return float(line.shape[0]), 0.0, 0.0


def settle(line: FlexibleLine, wire: FlexibleWire, lane: int, force: float) -> None:
    """Put one lane's wires back at rest; a force (N) at the anchor does not move them."""
    for array in (wire.displacement, wire.increment, wire.change):
        array[lane] = 0.0
    gap = line.dropper_gap[min(lane, len(line.dropper_gap) - 1)]
    wire.extension[lane] = 0.0 - gap[: len(line.dropper_node)]
    wire.shifted[lane] = 0
