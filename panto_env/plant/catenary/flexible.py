"""Flexible catenary: two tensioned beams, droppers that go slack, supports and steady arms.

Motion is computed about the static shape by finite differences on a uniform grid, with an explicit
leapfrog in time. The tension term uses the fourth-order modified-wave stencil
delta2 u - (1 - C^2)/12 delta4 u (C: Courant number), whose five points bending needs anyway.
Point loads and droppers act through four nodes by cubic interpolation. Local springs (droppers,
supports, steady arms, contact) act by the mean of two half-steps, which is (1/4, 1/2, 1/4) over three
time levels, each implicitly on its own: they conserve energy and do not bound the step.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...catalog.schema import FlexibleCatenaryData, Wire
from ...errors import InputError
from ..interpolation import stencil
from .flexible_motion import CONTACT, MESSENGER, PAD, FlexibleLine, FlexibleWire
from .static_shape import solve

SHAPE_SPACING = 0.05  # m, of the table of the static height; EI rounds kinks over about 0.1 m


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


def grid(data: FlexibleCatenaryData, spacing: float) -> tuple[int, float]:
    """Nodes a span and their distance (m), the largest up to ``spacing`` that divides the span."""
    nodes = int(np.ceil(data.span_length / spacing - 1e-9))
    return nodes, data.span_length / nodes


def build(data: FlexibleCatenaryData, spans: int, spacing: float, time_step: float) -> FlexibleLine:
    """Constants of a line of ``spans`` spans.

    Raises InputError where the time step (s) is too long for the grid (m) to be stable.
    """
    shape = solve(data)
    per_span, dx = grid(data, spacing)
    nodes = spans * per_span + 1 + 2 * PAD
    alpha, beta = data.damping.alpha, data.damping.beta
    settle = 1.0 + alpha * time_step / 2
    wires = (data.contact_wire, data.messenger_wire)

    added = np.zeros((2, nodes))  # mass of clamps, droppers and steady arms at the nodes (kg)
    first, weights = stencil(droppers(data, spans), dx)
    first = first + PAD
    half_dropper = np.tile(shape.dropper_mass / 2, spans)
    for k in range(4):
        np.add.at(
            added[CONTACT],
            first + k,
            weights[:, k] * (half_dropper + data.droppers.contact_clamp_mass),
        )
        np.add.at(
            added[MESSENGER],
            first + k,
            weights[:, k] * (half_dropper + data.droppers.messenger_clamp_mass),
        )
    masts = PAD + per_span * np.arange(1, spans)
    added[CONTACT, masts] += data.steady_arm.mass

    own = np.array([[wire.mass * dx] for wire in wires])
    inertia = own / (own + added)
    mobility = time_step**2 / (own + added) / settle
    inertia[:, : PAD + 1] = inertia[:, -PAD - 1 :] = 0.0
    mobility[:, : PAD + 1] = mobility[:, -PAD - 1 :] = 0.0  # the ends are anchored

    stiffness = np.tile(shape.dropper_stiffness, spans)
    squares = np.zeros(len(first))
    for k in range(4):
        squares += weights[:, k] ** 2 * (mobility[0, first + k] + mobility[1, first + k])

    support = np.zeros((len(masts), 3, 2))
    support[:, :, CONTACT] = levels(data.steady_arm.stiffness, 0.0, time_step)
    support[:, :, MESSENGER] = levels(data.support.stiffness, data.support.damping, time_step)

    table = int(np.ceil(data.span_length / SHAPE_SPACING)) + 1
    line = FlexibleLine(
        spacing=dx,
        span=data.span_length,
        shape=shape.contact.height(np.linspace(0, data.span_length, table)),
        level=np.tile([2.0 / settle, (1.0 - alpha * time_step / 2) / settle], (2, 1)),
        inner=np.array([_stencil(wire, dx, time_step) for wire in wires]) / settle,
        lag=beta / time_step,
        inertia=inertia,
        mobility=mobility,
        support_node=masts.astype(np.int64),
        support_spring=support,
        dropper_node=first,
        dropper_weight=weights,
        dropper_stiffness=stiffness,
        dropper_damping=beta * stiffness / time_step,
        dropper_yield=squares,
        dropper_static=np.tile(shape.dropper_tension, spans),
    )
    _check_stable(line, dx, time_step, data.name)
    return line


def levels(stiffness: float, damping: float, time_step: float) -> Array:
    """Weights of a spring (N/m) and damper (N s/m) on three time levels, newest first (N/m)."""
    mean = stiffness * np.array([0.25, 0.5, 0.25])
    return np.asarray(mean + damping / (2 * time_step) * np.array([1.0, 0.0, -1.0]))


def _stencil(wire: Wire, dx: float, time_step: float) -> Array:
    """Weights (centre, neighbours, second neighbours) of the wire's force, as a displacement."""
    courant = np.sqrt(wire.tension / wire.mass) * time_step / dx
    second = wire.tension / dx**2
    fourth = -second * (1 - courant**2) / 12 - wire.bending_stiffness / dx**4
    weights = np.array([-2 * second + 6 * fourth, second - 4 * fourth, fourth])
    return np.asarray(time_step**2 / wire.mass * weights)


def _check_stable(line: FlexibleLine, dx: float, time_step: float, name: str) -> None:
    """The shortest wave of the grid must not grow: omega^2 dt^2 (1 + 2 lag) <= 4."""
    for weights in line.inner:
        shortest = -(weights[0] - 2 * weights[1] + 2 * weights[2]) * line.inertia.max()
        if shortest * (1 + 2 * line.lag) > 4:
            raise InputError(
                f"A time step of {1e3 * time_step:g} ms is unstable on a grid of {dx:g} m for line "
                f"'{name}'; take a shorter step or a coarser grid."
            )


def at_rest(line: FlexibleLine, lanes: int) -> FlexibleWire:
    """Wires of all lanes in their static shape."""
    nodes, droppers = line.inertia.shape[1], len(line.dropper_node)
    return FlexibleWire(
        displacement=np.zeros((lanes, 2, 2, nodes)),
        now=np.zeros(lanes, dtype=np.int64),
        blend=np.zeros((lanes, 2, nodes)),
        support_past=np.zeros((lanes, len(line.support_node), 2)),
        extension_past=np.zeros((lanes, droppers)),
        tension=np.tile(line.dropper_static, (lanes, 1)),
    )


def start_point(line: FlexibleLine) -> tuple[float, float, float]:
    """Height (m), compliance of the wire, and of a massless spring (m/N), where a run starts.

    A run starts at the anchor, which does not yield: the pantograph is at rest there exactly.
    """
    return float(line.shape[0]), 0.0, 0.0


def settle(line: FlexibleLine, wire: FlexibleWire, lane: int, force: float) -> None:
    """Put one lane's wires back at rest; a force (N) at the anchor does not move them."""
    wire.displacement[lane] = 0.0
    wire.support_past[lane] = 0.0
    wire.extension_past[lane] = 0.0
    wire.tension[lane] = line.dropper_static
