"""Kernels of the flexible catenary: one step of the wires and all that hangs on them.

The state of a wire is its displacement u and its increment over the last step d. A step is
d <- b d + S (u + lag d), u <- u + d: the leapfrog, with the stencil S, damping b in proportion to the
mass and lag in proportion to the stiffness. Forces at points then move both by mobility times force.
"""

from __future__ import annotations

from numba.extending import overload

from ....backend.compile import PART
from ... import step as coupling
from .parts import (
    absorb,
    anchor,
    defect_row,
    first_dropper,
    hold_supports,
    locate,
    pull_droppers,
    push,
    remember,
    rise_by_defects,
    static_height,
    sweep,
    travel,
)
from .state import CONTACT, FlexibleLine


@overload(coupling.move_wire, jit_options=PART)
def _move_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def move(line, wire, lane, x0, x1, force):
        ahead = int(x0 / line.span) - wire.shifted[lane]
        if 2 * ahead > line.window - 1 and wire.shifted[lane] + line.window < line.spans:
            travel(line, wire, lane)
        u, d, q = wire.displacement[lane], wire.increment[lane], wire.blend[lane]
        past, now, support_past = wire.extension[lane, 0], wire.extension[lane, 1], wire.support_past[lane]
        mobility = line.mobility
        row, first = defect_row(line.dropper_static, lane), first_dropper(line, wire.shifted[lane])
        static, gap = line.dropper_static[row, first:], line.dropper_gap[row, first:]
        remember(line, u, d, support_past, past, now, gap)
        for w in range(2):
            sweep(u[w], d[w], q, line.inertia[w], line.stencil[w])
        # The wire takes at each time level the mean of the forces before and after it.
        start = wire.shifted[lane] * line.span
        first_0, weights_0 = locate(x0 - start, line.spacing, u.shape[1])
        push(u, d, mobility, first_0, weights_0, 0.5 * force)
        hold_supports(line.support_node, line.support_spring, mobility, u, d, support_past)
        pull_droppers(line, u, d, past, now, static, wire.change[lane])
        first_1, weights_1 = locate(x1 - start, line.spacing, u.shape[1])
        height = static_height(line.shape, line.span, x1)
        if line.rise.shape[1] > 0:
            height += rise_by_defects(line.rise[row], line.rise_breaks, line.rise_decay, x1)
        compliance = 0.0
        for k in range(4):
            height += weights_1[k] * u[CONTACT, first_1 + k]
            j = first_1 + k - first_0
            if 0 <= j < 4:
                compliance += 0.5 * weights_1[k] * weights_0[j] * mobility[CONTACT, first_1 + k]
        return height, compliance, 0.0

    return move


@overload(coupling.load_wire, jit_options=PART)
def _load_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def load(line, wire, lane, x0, x1, force):
        u, d = wire.displacement[lane], wire.increment[lane]
        shifted, last = wire.shifted[lane], u.shape[1] - 1
        first, weights = locate(x0 - shifted * line.span, line.spacing, u.shape[1])
        push(u, d, line.mobility, first, weights, 0.5 * force)
        for w in range(2):
            if shifted == 0:
                anchor(u[w], 0, 1)
                anchor(d[w], 0, 1)
            else:
                absorb(u[w], d[w], line.leave[w], 0, 1)
            if shifted + line.window >= line.spans:
                anchor(u[w], last, -1)
                anchor(d[w], last, -1)
            else:
                absorb(u[w], d[w], line.leave[w], last, -1)

    return load


@overload(coupling.record_wire, jit_options=PART)
def _record_wire(line, wire, lane, uplift, tension):
    if getattr(line, "instance_class", None) is not FlexibleLine:
        return None

    def record(line, wire, lane, uplift, tension):
        shifted = wire.shifted[lane]
        for s in range(line.support_node.size):
            if shifted + s < uplift.size:
                uplift[shifted + s] = wire.displacement[lane, CONTACT, line.support_node[s]]
        if tension.size > 0:
            first = shifted * (line.dropper_node.size // line.window)
            static = line.dropper_static[defect_row(line.dropper_static, lane)]
            begin = first_dropper(line, shifted)
            for k in range(line.dropper_node.size):
                tension[first + k] = static[begin + k] + wire.change[lane, k]

    return record
