"""Kernels of the flexible catenary: one step of the wires and all that hangs on them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import overload

from ...arrays import Array, Index
from .. import coupling
from ..interpolation import cubic_weights
from ..jit import kernel

PAD = 2  # ghost nodes beyond each end, for the five-point stencil
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
def _move_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def move(line, wire, lane, x0, x1, force):
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
def _load_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def load(line, wire, lane, x0, x1, force):
        new = wire.displacement[lane, 1 - wire.now[lane]]
        first, weights = locate(line, x0)
        push(line, new, first, weights, 0.5 * force)
        anchor(new)
        wire.now[lane] = 1 - wire.now[lane]

    return load


@overload(coupling.record_wire)
def _record_wire(line, wire, lane, uplift, tension):
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def record(line, wire, lane, uplift, tension):
        for s in range(uplift.size):
            uplift[s] = wire.displacement[lane, wire.now[lane], CONTACT, line.support_node[s]]
        for d in range(tension.size):
            tension[d] = wire.tension[lane, d]

    return record
