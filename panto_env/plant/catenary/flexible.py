"""Flexible catenary: two tensioned beams, droppers that go slack, supports and steady arms.

Motion is computed about the static shape by finite differences on a uniform grid, with an explicit
leapfrog in time. The tension term uses the fourth-order modified-wave stencil
delta2 u - (1 - C^2)/12 delta4 u (C: Courant number), whose five points bending needs anyway.
Point loads and droppers act through four nodes by cubic interpolation. Local springs (droppers,
supports, steady arms, contact) act by the mean of two half-steps, which is (1/4, 1/2, 1/4) over three
time levels, each implicitly on its own: they conserve energy and do not bound the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from ...catalog.schema import FlexibleCatenaryData, Wire
from ...errors import InputError
from .. import coupling
from ..interpolation import cubic_weights, stencil
from ..jit import kernel
from .static_shape import solve

Array = NDArray[np.float64]
Index = NDArray[np.int64]

PAD = 2  # ghost nodes beyond each end, for the five-point stencil
SHAPE_SPACING = 0.05  # m, of the table of the static height; EI rounds kinks over about 0.1 m
CONTACT, MESSENGER = 0, 1


class FlexibleLine(NamedTuple):
    """Constants of a line on its grid; the first axis of a pair is contact wire, messenger."""

    spacing: float  # of the grid (m)
    span: float  # m
    shape: Array  # static height of the contact wire over one span, every span/(n - 1) m (m)
    level: Array  # (2, 2): weights of the present and the previous displacement
    inner: Array  # (2, 3): stencil weights of a node, its neighbours, and theirs
    lag: float  # stiffness-proportional damping over the time step (-)
    inertia: Array  # (2, nodes): mass of the bare wire over the mass of the node (-)
    mobility: Array  # (2, nodes): displacement in one step by 1 N at the node (m/N)
    support_node: Index  # (supports,)
    support_spring: Array  # (supports, 3, 2): weights of the three time levels, newest first (N/m)
    dropper_node: Index  # (droppers,): first of four nodes
    dropper_weight: Array  # (droppers, 4)
    dropper_stiffness: Array  # (droppers,): in tension (N/m)
    dropper_damping: Array  # (droppers,): in tension, over the time step (N/m)
    dropper_yield: Array  # (droppers,): relative displacement of the ends by 1 N (m/N)
    dropper_static: Array  # (droppers,): static tension (N)


class FlexibleWire(NamedTuple):
    """Moving state of all lanes."""

    displacement: Array  # (lanes, 2 times, 2 wires, nodes): about the static shape (m)
    now: Index  # (lanes,): which of the two times is the present
    blend: Array  # (lanes, 2 wires, nodes): what the stencil acts on, scratch (m)
    support_past: Array  # (lanes, supports, 2 wires): displacement a step ago (m)
    extension_past: Array  # (lanes, droppers): extension about the static one a step ago (m)
    tension: Array  # (lanes, droppers): dropper tension over the last step (N)


def wave_speed(data: FlexibleCatenaryData) -> float:
    """Speed of waves along the contact wire (m/s)."""
    return float(np.sqrt(data.contact_wire.tension / data.contact_wire.mass))


def line_end(data: FlexibleCatenaryData, spans: int) -> float:
    """How far a run goes unless told otherwise (m): to the last span, whose anchor reflects waves."""
    return (spans - 1) * data.span_length


def supports(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m) of the supports whose uplift is recorded."""
    return data.span_length * np.arange(1, spans)


def droppers(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m) of the droppers."""
    offsets = np.array(data.droppers.positions)
    return np.add.outer(np.arange(spans) * data.span_length, offsets).ravel()


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
            added[CONTACT], first + k, weights[:, k] * (half_dropper + data.droppers.contact_clamp_mass)
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


@kernel
def static_height(line, x):
    """Static height (m) of the contact wire at x (m)."""
    intervals = line.shape.size - 1
    ratio = (x / line.span - np.floor(x / line.span)) * intervals
    k = min(int(ratio), intervals - 1)
    return line.shape[k] + (ratio - k) * (line.shape[k + 1] - line.shape[k])


@kernel
def locate(line, x):
    """First of the four nodes around x (m), kept on the line, and their weights."""
    ratio = x / line.spacing
    left = min(max(int(np.floor(ratio)), 0), line.inertia.shape[1] - 2 * PAD - 2)
    return left - 1 + PAD, cubic_weights(ratio - left)


@kernel
def swing(line, wire, lane):
    """Leapfrog of both bare wires: the next displacement takes the place of the previous one."""
    now = wire.displacement[lane, wire.now[lane]]
    new = wire.displacement[lane, 1 - wire.now[lane]]
    for w in range(2):
        u, p, q, r = now[w], new[w], wire.blend[lane, w], line.inertia[w]
        a, b = line.level[w, 0], line.level[w, 1]
        c0, c1, c2 = line.inner[w, 0], line.inner[w, 1], line.inner[w, 2]
        for i in range(u.size):
            q[i] = u[i] + line.lag * (u[i] - p[i])
        # Indices only ever add to i: a negative one would make Numba check for wrap-around, and the
        # loop would not be vectorised.
        for i in range(u.size - 2 * PAD):
            force = c0 * q[i + 2] + c1 * (q[i + 1] + q[i + 3]) + c2 * (q[i] + q[i + 4])
            p[i + 2] = a * u[i + 2] - b * p[i + 2] + r[i + 2] * force


@kernel
def anchor(displacement):
    """Hold both ends of both wires: no displacement, no moment (odd continuation)."""
    last = displacement.shape[1] - 1
    for w in range(2):
        u = displacement[w]
        u[0], u[1], u[2] = -u[4], -u[3], 0.0
        u[last], u[last - 1], u[last - 2] = -u[last - 4], -u[last - 3], 0.0


@kernel
def push(line, new, first, weights, force):
    """Add a force (N) on the contact wire, spread over four nodes."""
    for k in range(4):
        new[CONTACT, first + k] += line.mobility[CONTACT, first + k] * weights[k] * force


@kernel
def hold_supports(line, wire, lane, now, new):
    """Springs and dampers of messenger supports and steady arms, each implicit at its node."""
    for s in range(line.support_node.size):
        i = line.support_node[s]
        for w in range(2):
            spring = line.support_spring[s]
            past = wire.support_past[lane, s, w]
            mobility = line.mobility[w, i]
            pull = spring[0, w] * new[w, i] + spring[1, w] * now[w, i] + spring[2, w] * past
            new[w, i] -= mobility * pull / (1.0 + spring[0, w] * mobility)
            wire.support_past[lane, s, w] = now[w, i]


@kernel
def dropper_change(stiffness, damping, static, past, free, yielding):
    """Change of a dropper's tension about the static one (N), over the two half-steps it acts in.

    Its extension, averaged over a step, goes from ``past`` to ``free - yielding * change`` (m). The
    force is the change of the spring's energy over the change of extension (a discrete gradient), so
    that going slack and taut again conserves energy: for a taut dropper it is the mean spring force.
    """
    slack = static / stiffness  # extensions below -slack carry no tension
    a, b = past + slack, free + slack + yielding * static  # b: were the tension 0
    if a >= 0.0:
        change = (0.5 * stiffness * (past + free) + damping * (free - past)) / (
            1.0 + (0.5 * stiffness + damping) * yielding
        )
        if free - yielding * change >= -slack:
            return max(change, -static)
        # from taut to slack: T = k a^2 / (2 (a - b + yielding T))
        fall = a - b
        tension = (np.sqrt(fall * fall + 2 * yielding * stiffness * a * a) - fall) / (2 * yielding)
        return tension - static
    if b <= 0.0:
        return -static
    # from slack to taut, at the extension e > 0: k e^2 = 2 T (e - a), e = b - yielding T
    stiff = 1.0 + 0.5 * stiffness * yielding
    e = (a + b + np.sqrt((a + b) ** 2 - 4 * stiff * a * b)) / (2 * stiff)
    return (b - e) / yielding - static


@kernel
def pull_droppers(line, wire, lane, now, new):
    """Droppers: each one scalar equation for its tension, which is never negative."""
    for d in range(line.dropper_node.size):
        i = line.dropper_node[d]
        weight, static = line.dropper_weight[d], line.dropper_static[d]
        present, free = 0.0, 0.0
        for k in range(4):
            present += weight[k] * (now[MESSENGER, i + k] - now[CONTACT, i + k])
            free += weight[k] * (new[MESSENGER, i + k] - new[CONTACT, i + k])
        change = dropper_change(
            line.dropper_stiffness[d],
            line.dropper_damping[d],
            static,
            0.5 * (wire.extension_past[lane, d] + present),
            0.5 * (present + free),
            0.5 * line.dropper_yield[d],
        )
        wire.extension_past[lane, d] = present
        wire.tension[lane, d] = static + change
        for k in range(4):
            new[CONTACT, i + k] += line.mobility[CONTACT, i + k] * weight[k] * change
            new[MESSENGER, i + k] -= line.mobility[MESSENGER, i + k] * weight[k] * change


@overload(coupling.move_wire)
def _move_wire(line, wire, lane, x0, x1, force):  # type: ignore[no-untyped-def]
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def move(line, wire, lane, x0, x1, force):  # type: ignore[no-untyped-def]
        now = wire.displacement[lane, wire.now[lane]]
        new = wire.displacement[lane, 1 - wire.now[lane]]
        swing(line, wire, lane)
        # The wire takes at each time level the mean of the forces before and after it.
        first_0, weights_0 = locate(line, x0)
        push(line, new, first_0, weights_0, 0.5 * force)
        hold_supports(line, wire, lane, now, new)
        pull_droppers(line, wire, lane, now, new)
        first_1, weights_1 = locate(line, x1)
        height = static_height(line, x1)
        compliance = 0.0
        for k in range(4):
            height += weights_1[k] * new[CONTACT, first_1 + k]
            j = first_1 + k - first_0
            if 0 <= j < 4:
                compliance += 0.5 * weights_1[k] * weights_0[j] * line.mobility[CONTACT, first_1 + k]
        return height, compliance, 0.0

    return move


@overload(coupling.load_wire)
def _load_wire(line, wire, lane, x0, x1, force):  # type: ignore[no-untyped-def]
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def load(line, wire, lane, x0, x1, force):  # type: ignore[no-untyped-def]
        new = wire.displacement[lane, 1 - wire.now[lane]]
        first, weights = locate(line, x0)
        push(line, new, first, weights, 0.5 * force)
        anchor(new)
        wire.now[lane] = 1 - wire.now[lane]

    return load


@overload(coupling.record_wire)
def _record_wire(line, wire, lane, uplift, tension):  # type: ignore[no-untyped-def]
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def record(line, wire, lane, uplift, tension):  # type: ignore[no-untyped-def]
        for s in range(uplift.size):
            uplift[s] = wire.displacement[lane, wire.now[lane], CONTACT, line.support_node[s]]
        for d in range(tension.size):
            tension[d] = wire.tension[lane, d]

    return record
