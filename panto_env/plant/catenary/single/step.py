"""The step of a single wire or rail: Hermite elements, implicit midpoint, a window that goes with the train.

Each node has a height and a slope over those at rest. With the mean rates v of a step of length dt,

    S v = 2/dt M v0 - K u0 + f,  S = 2/dt M + C + dt/2 K;  u1 = u0 + dt v,  v1 = 2 v - v0,

so the energy changes by exactly what the force f, at its place at mid-step, works and what C takes, for steps
of any length. S is tridiagonal in blocks of 2 x 2, S = L D L^T, and is factorised anew whenever the window
moves on by a span. Its ends are held in height; before them a layer damps waves, but not at the line's own
ends. A unit force at a contact point moves the nodes about it; those that it moves by less than rounding are
left out.
"""

from __future__ import annotations

from typing import NamedTuple

from ....backend import NOT_NEGATIVE, called, implements, inlined
from ....base.arrays import Array, Index
from ...alignment import AlignmentArrays, span_index
from ...state import ENDING, LARGEST_SPEED
from ..protocol import (
    advance_wire,
    apply_force,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)

NOTHING = 1e-17  # share of a movement at the contact point that counts as none


class SingleLine(NamedTuple):
    """Constants of the line."""

    alignment: AlignmentArrays
    elements: int  # of each span
    window: int  # spans that are computed
    behind: int  # of these, spans behind the one that the last collector is in
    train: float  # length of the train (m)
    time_step: float  # s
    mass: float  # kg/m
    tension: float  # N
    bending: float  # N m^2
    alpha: float  # 1/s
    beta: float  # s
    support: Array  # (2,): stiffness (N/m) and damping (N s/m)
    layer: Array  # (window * elements,): more alpha towards the window's ends (1/s)
    rest: Array  # (spans * elements + 1, 2): height (m) and slope (-) at rest
    free_uplift: float  # m


class SingleWire(NamedTuple):
    """State of the wire in all lanes; of nodes, height (m) and slope (-) come last."""

    first: Index  # (lanes,): number of the window's first span from 0 up, -1 before the first step
    element: Index  # (lanes, collectors): in which each contact point lies
    affected: Index  # (lanes, collectors, 2): first and last node that its force moves
    weight: Array  # (lanes, collectors, 4): of its nodes' heights and slopes
    moved: Array  # (lanes, nodes, 2): over the shape at rest
    rate: Array  # (lanes, nodes, 2): 1/s
    mean: Array  # (lanes, nodes, 2): rate at mid-step without the forces of this step (1/s)
    pivot: Array  # (lanes, nodes, 3): inverse of D: of height, of both, of slope
    lower: Array  # (lanes, nodes, 4): L beside the diagonal, row by row
    response: Array  # (lanes, collectors, nodes, 2): mean rate by 1 N at the contact point (1/(N s))


@inlined
def element_length(line, wire, lane, element):
    """Length (m) of an element of the window."""
    supports, span = line.alignment.supports, (wire.first[lane] + element // line.elements) & NOT_NEGATIVE
    return (supports[span + 1] - supports[span]) / line.elements


@inlined
def stiffness_terms(line, h):
    """Entries a, b, c, d of the stiffness of an element of length h: [a b -a b; b c -b d; ...]."""
    pull, bend = line.tension / (30.0 * h), line.bending / (h * h * h)
    a, b = 36.0 * pull + 12.0 * bend, (3.0 * pull + 6.0 * bend) * h
    return a, b, (4.0 * pull + 4.0 * bend) * h * h, (2.0 * bend - pull) * h * h


@called
def factorise(line, wire, lane):
    """Write the factors of S for a lane's window."""
    pivot, lower = wire.pivot[lane], wire.lower[lane]
    last, dt = pivot.shape[0] - 1, line.time_step
    hold = line.support[1] + 0.5 * dt * line.support[0]
    at_start = wire.first[lane] == 0
    at_end = wire.first[lane] + line.window == line.alignment.supports.size - 1
    s00, s01, s11 = 0.0, 0.0, 0.0  # block of a node, first without the element behind it
    for e in range(last):
        h = element_length(line, wire, lane, e)
        a, b, c, d = stiffness_terms(line, h)
        open_end = not (at_start if 2 * e < last else at_end)
        alpha = line.alpha + (line.layer[e] if open_end else 0.0)
        m, k = (2.0 / dt + alpha) * line.mass * h / 420.0, line.beta + 0.5 * dt
        s00 += 156.0 * m + k * a + (hold if e % line.elements == 0 else 0.0)
        s01 += 22.0 * h * m + k * b
        s11 += 4.0 * h * h * m + k * c
        inverse = 1.0 / (s00 * s11 - s01 * s01)
        p00, p01, p11 = s11 * inverse, -s01 * inverse, s00 * inverse
        if e == 0:  # held, but free to turn
            p00, p01, p11 = 0.0, 0.0, 1.0 / s11
        pivot[e, 0], pivot[e, 1], pivot[e, 2] = p00, p01, p11
        # Rows of the next node, columns of this one.
        n00, n01 = 54.0 * m - k * a, 13.0 * h * m - k * b
        n10, n11 = -13.0 * h * m + k * b, -3.0 * h * h * m + k * d
        l00, l01 = n00 * p00 + n01 * p01, n00 * p01 + n01 * p11
        l10, l11 = n10 * p00 + n11 * p01, n10 * p01 + n11 * p11
        lower[e + 1, 0], lower[e + 1, 1], lower[e + 1, 2], lower[e + 1, 3] = l00, l01, l10, l11
        s00 = 156.0 * m + k * a - (l00 * n00 + l01 * n01)
        s01 = -22.0 * h * m - k * b - (l00 * n10 + l01 * n11)
        s11 = 4.0 * h * h * m + k * c - (l10 * n10 + l11 * n11)
    pivot[last, 0], pivot[last, 1], pivot[last, 2] = 0.0, 0.0, 1.0 / s11


@called
def move_window(line, wire, lane, first):
    """Let a lane's window begin at another span; what comes into it is at rest."""
    moved, rate = wire.moved[lane], wire.rate[lane]
    nodes, shift = moved.shape[0], (first - max(wire.first[lane], 0)) * line.elements
    for i in range(nodes if shift > 0 else 0):
        for k in range(2):
            moved[i, k] = moved[i + shift, k] if i + shift < nodes else 0.0
            rate[i, k] = rate[i + shift, k] if i + shift < nodes else 0.0
    moved[0, 0], rate[0, 0] = 0.0, 0.0  # what is held now may have moved before
    wire.first[lane] = first
    factorise(line, wire, lane)


@inlined
def locate(line, wire, lane, x):
    """Element of the window at x (m), its length (m), and how far into it x lies, from 0 to 1."""
    supports, first = line.alignment.supports, max(wire.first[lane], 0)
    span = min(max(span_index(line.alignment, x), first), first + line.window - 1) & NOT_NEGATIVE
    h = (supports[span + 1] - supports[span]) / line.elements
    ratio = min(max((x - supports[span]) / h, 0.0), 1.0 * line.elements)
    part = min(int(ratio), line.elements - 1)
    return ((span - first) * line.elements + part) & NOT_NEGATIVE, h, ratio - part


@inlined
def weights(s, h):
    """Weights of height and slope at both nodes of an element of length h (m), at a share s of it."""
    t = 1.0 - s
    return t * t * (1.0 + 2.0 * s), h * s * t * t, s * s * (1.0 + 2.0 * t), -h * s * s * t


@inlined
def between(table, node, w):
    """Height between a node and the next, by a table of heights and slopes."""
    low = table[node:]
    return w[0] * low[0, 0] + w[1] * low[0, 1] + w[2] * low[1, 0] + w[3] * low[1, 1]


@inlined
def height(line, wire, lane, element, w):
    """Height (m) of the wire in an element."""
    first = max(wire.first[lane], 0) * line.elements
    return between(line.rest, (first + element) & NOT_NEGATIVE, w) + between(wire.moved[lane], element, w)


@implements(place_contact, SingleLine)
def _place(line, wire, lane, contact, x):
    if contact == 0:
        most = line.alignment.supports.size - 1 - line.window
        first = min(max(span_index(line.alignment, max(x - line.train, 0.0)) - line.behind, 0), most)
        if first > wire.first[lane]:
            move_window(line, wire, lane, first)
    element, h, s = locate(line, wire, lane, x)
    w, own = weights(s, h), wire.weight[lane, contact]
    wire.element[lane, contact] = element
    own[0], own[1], own[2], own[3] = w
    # Mid-step is the mean of both ends: with a contact_share of 1 nothing reads the second value.
    return height(line, wire, lane, element, w), 0.0


@implements(advance_wire, SingleLine)
def _advance(line, wire, lane):
    moved, rate, mean = wire.moved[lane], wire.rate[lane], wire.mean[lane]
    pivot, lower = wire.pivot[lane], wire.lower[lane]
    last, dt = moved.shape[0] - 1, line.time_step
    # Forward: the elements' forces, less at once what the nodes before take of them.
    y0, y1, f0, f1 = 0.0, 0.0, 0.0, 0.0
    for span in range(line.window):
        begin = (span * line.elements) & NOT_NEGATIVE
        h = element_length(line, wire, lane, begin)
        a, b, c, d = stiffness_terms(line, h)
        m = 2.0 / dt * line.mass * h / 420.0
        m1, m2, m3 = 22.0 * h * m, 13.0 * h * m, 4.0 * h * h * m
        m4 = 0.75 * m3
        f0 -= line.support[0] * moved[begin, 0]
        u, v, low, out = moved[begin:], rate[begin:], lower[begin:], mean[begin:]
        for i in range(line.elements):
            u0, u1, u2, u3 = u[i, 0], u[i, 1], u[i + 1, 0], u[i + 1, 1]
            v0, v1, v2, v3 = v[i, 0], v[i, 1], v[i + 1, 0], v[i + 1, 1]
            pull, turn = a * (u2 - u0) - b * (u1 + u3), b * (u2 - u0)
            g0 = f0 + 156.0 * m * v0 + m1 * v1 + 54.0 * m * v2 - m2 * v3 + pull
            g1 = f1 + m1 * v0 + m3 * v1 + m2 * v2 - m4 * v3 + turn - (c * u1 + d * u3)
            z0 = g0 - low[i, 0] * y0 - low[i, 1] * y1
            z1 = g1 - low[i, 2] * y0 - low[i, 3] * y1
            out[i, 0], out[i, 1], y0, y1 = z0, z1, z0, z1
            f0 = 54.0 * m * v0 + m2 * v1 + 156.0 * m * v2 - m1 * v3 - pull
            f1 = turn - m2 * v0 - m4 * v1 - m1 * v2 + m3 * v3 - (d * u1 + c * u3)
    # Backward, from the last node, which is held but may turn.
    x0, x1 = 0.0, pivot[last, 2] * (f1 - lower[last, 2] * y0 - lower[last, 3] * y1)
    mean[last, 1] = x1
    moved[last, 1] += dt * x1
    rate[last, 1] = 2.0 * x1 - rate[last, 1]
    for back in range(last):
        e = (last - 1 - back) & NOT_NEGATIVE
        z0, z1, p01 = mean[e, 0], mean[e, 1], pivot[e, 1]
        n0 = pivot[e, 0] * z0 + p01 * z1 - lower[e + 1, 0] * x0 - lower[e + 1, 2] * x1
        n1 = p01 * z0 + pivot[e, 2] * z1 - lower[e + 1, 1] * x0 - lower[e + 1, 3] * x1
        mean[e, 0], mean[e, 1], x0, x1 = n0, n1, n0, n1
        moved[e, 0] += dt * x0
        moved[e, 1] += dt * x1
        rate[e, 0] = 2.0 * x0 - rate[e, 0]
        rate[e, 1] = 2.0 * x1 - rate[e, 1]


@implements(rise_at_contact, SingleLine)
def _rise(line, wire, lane, contact, x0, x1):
    rise, sign, half = 0.0, -1.0, 0.5 * line.time_step
    for x in (x0, x1):
        element, h, s = locate(line, wire, lane, x)
        w = weights(s, h)
        rise += sign * (height(line, wire, lane, element, w) - half * between(wire.mean[lane], element, w))
        sign = 1.0
    return rise


@implements(look_at_contact, SingleLine)
def _look(line, wire, lane, contact, x):
    element, w = wire.element[lane, contact] & NOT_NEGATIVE, wire.weight[lane, contact]
    pivot, lower, response = wire.pivot[lane], wire.lower[lane], wire.response[lane, contact]
    last, first, y0, y1 = pivot.shape[0] - 1, element, w[0], w[1]
    response[element, 0], response[element, 1] = y0, y1
    for i in range(element, last):
        low = lower[i + 1]
        y0, y1 = -low[0] * y0 - low[1] * y1, -low[2] * y0 - low[3] * y1
        if i == element:
            y0, y1 = y0 + w[2], y1 + w[3]
        elif abs(y0) + abs(y1) < NOTHING:
            last = i
            break
        response[i + 1, 0], response[i + 1, 1] = y0, y1
    x0, x1, largest = 0.0, 0.0, 0.0
    for back in range(last + 1):
        i = (last - back) & NOT_NEGATIVE
        p01, n0, n1 = pivot[i, 1], 0.0, 0.0
        if i >= element:
            y0, y1 = response[i, 0], response[i, 1]
            n0, n1 = pivot[i, 0] * y0 + p01 * y1, p01 * y0 + pivot[i, 2] * y1
        if i < last:
            n0 -= lower[i + 1, 0] * x0 + lower[i + 1, 2] * x1
            n1 -= lower[i + 1, 1] * x0 + lower[i + 1, 3] * x1
        response[i, 0], response[i, 1], x0, x1 = n0, n1, n0, n1
        first, largest = i, max(largest, abs(x0) + abs(x1))
        if i < element and abs(x0) + abs(x1) < NOTHING * largest:
            break
    wire.affected[lane, contact, 0], wire.affected[lane, contact, 1] = first, last
    yields = line.time_step * between(response, element, w)
    return height(line, wire, lane, element, w), yields, 0.5 * yields, 0.0


@implements(apply_force, SingleLine)
def _apply(line, wire, lane, contact, x, force):
    moved, rate, response = wire.moved[lane], wire.rate[lane], wire.response[lane, contact]
    first, last = wire.affected[lane, contact, 0], wire.affected[lane, contact, 1]
    for i in range(first & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
        for k in range(2):
            moved[i, k] += line.time_step * force * response[i, k]
            rate[i, k] += 2.0 * force * response[i, k]


@implements(ending_by_wire, SingleLine)
def _ending(line, wire, lane):
    for support in range(1, line.window):
        node = support * line.elements
        if wire.moved[lane, node, 0] > line.free_uplift:
            return ENDING.STOP if abs(wire.rate[lane, node, 0]) < LARGEST_SPEED else ENDING.DIVERGED
    return ENDING.NONE


@implements(record_wire, SingleLine)
def _record(line, wire, lane, uplift, tension):
    for s in range(1, line.window):
        support = (wire.first[lane] + s - 1) & NOT_NEGATIVE
        if support < uplift.size:
            uplift[support] = wire.moved[lane, s * line.elements, 0]
