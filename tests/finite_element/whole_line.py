"""Static shape of a line of unlike spans in Hermite elements: as it is designed, and as its droppers hold it.

The line is closed by its own mirror image, so that nothing ends: this is what its ends stand for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from panto_env.plant.catenary.flexible.schema import Span
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, Indices, matrices, span_nodes, uniform_load

GRAVITY = 9.81


@dataclass(frozen=True)
class LineShape:
    """The line itself, without its mirror image; heights over the nominal one."""

    x: Array
    """Node positions (m), shape (n_nodes,)."""
    contact: Array
    """Contact wire height (m), shape (n_nodes,)."""
    contact_slope: Array
    """Contact wire slope (-), shape (n_nodes,)."""
    messenger: Array
    """Messenger wire height (m), shape (n_nodes,)."""
    dropper_tension: Array
    """Above the contact-wire clamp, shape (n_droppers,) (N)."""
    dropper_length: Array
    """Distance of the loaded wires at each dropper, shape (n_droppers,) (m)."""
    support_force: Array
    """With which supports carry the messenger, shape (n_spans + 1,) (N): half of it at the ends."""


class ClosedLine:
    """Nodes, droppers and supports of a line and its mirror image."""

    def __init__(
        self, spans: Sequence[Span], end: tuple[float, float], wires: tuple[Wire, Wire], element: float
    ) -> None:
        """end: contact height and encumbrance at the last support (m). wires: contact, messenger."""
        self.wires, self.count = wires, len(spans)
        pieces, x, supports, begin = [], [], [0.0], 0.0
        for span in spans:
            pieces.append(begin + span_nodes(span.span_length, span.droppers.positions, element)[:-1])
            x += [begin + place for place in span.droppers.positions]
            begin += span.span_length
            supports.append(begin)
        line = np.concatenate([*pieces, [begin]])
        self.x = np.append(line, 2 * begin - line[-2::-1])
        self.own = len(line)
        self.droppers = len(x)
        self.hung = self._numbers(np.append(x, 2 * begin - np.array(x)))
        self.masts = self._numbers(np.append(supports, 2 * begin - np.array(supports[-2:0:-1])))
        low = np.array([*(span.contact_height for span in spans), end[0]])
        high = low + np.array([*(span.encumbrance for span in spans), end[1]])
        chord = np.interp(x, supports, low)
        below = np.concatenate([span.droppers.sag for span in spans])
        self.heights = np.tile(chord - below, 2)
        stands = [*spans, spans[-1]]
        self.low, self.high = _mirrored(low), _mirrored(high)
        self.support = _mirrored(np.array([each.support.stiffness for each in stands]))
        self.holds = _mirrored(np.array([each.steady_arm.holds_wire for each in stands]))

        def each(key: str) -> Array:
            return np.tile([getattr(span.droppers, key) for span in spans for _ in span.droppers.sag], 2)

        self.mass, self.lower, self.upper = map(each, ("mass", "contact_clamp_mass", "messenger_clamp_mass"))

    def _numbers(self, positions: Array) -> Indices:
        return np.abs(self.x[:, None] - positions).argmin(axis=0)

    def fold(self) -> sparse.csr_array:
        """The last node is the first one again."""
        size = 2 * self.x.size - 2
        rows = np.arange(size + 2)
        return sparse.csr_array((np.ones(size + 2), (rows, rows % size)), (size + 2, size))

    def wire(self, wire: Wire) -> tuple[sparse.csr_array, Array]:
        """Stiffness, and forces of the wire's own weight."""
        fold = self.fold()
        stiffness, _ = matrices(self.x, wire)
        force = fold.T @ uniform_load(self.x, -wire.mass * GRAVITY)
        return sparse.csr_array(fold.T @ stiffness @ fold), force

    def shape(self, contact: Array, messenger: Array, tension: Array) -> LineShape:
        """The line's own half of the unknowns."""
        apart = messenger[2 * self.hung] - contact[2 * self.hung]
        carried = self.support * (self.high - messenger[2 * self.masts])
        return LineShape(
            self.x[: self.own],
            contact[: 2 * self.own : 2],
            contact[1 : 2 * self.own : 2],
            messenger[: 2 * self.own : 2],
            tension[: self.droppers],
            apart[: self.droppers],
            carried[: self.count + 1] / np.array([2.0, *[1.0] * (self.count - 1), 2.0]),
        )


def designed(line: ClosedLine) -> LineShape:
    """The shape with the contact wire at the wanted heights at its droppers, and at arms that hold it."""
    holding = np.flatnonzero(line.holds)
    held = np.append(line.hung, line.masts[holding])
    fixed = np.append(line.heights, line.low[holding])
    lower, weight = line.wire(line.wires[0])
    upper, above_weight = line.wire(line.wires[1])
    length = np.ones(line.hung.size)
    for _ in range(60):
        half = line.mass * length / 2
        force = weight.copy()
        force[2 * line.hung] -= GRAVITY * (half + line.lower)
        contact = np.zeros(force.size)
        contact[2 * held] = fixed
        free = np.setdiff1d(np.arange(force.size), 2 * held)
        contact[free] = spsolve(lower[free][:, free].tocsc(), (force - lower @ contact)[free])
        tension = (lower @ contact - force)[2 * line.hung]
        force = above_weight.copy()
        force[2 * line.hung] -= tension + GRAVITY * (half + line.upper)
        messenger = spsolve(*_on_springs(upper, force, line))
        old, length = length, messenger[2 * line.hung] - contact[2 * line.hung]
        if np.abs(length - old).max() < 1e-12:
            break
    return line.shape(contact, messenger, tension)


def built(
    line: ClosedLine, unloaded: Array, stiffness: Array, pushed: tuple[int, float] = (0, 0.0)
) -> LineShape:
    """The shape that droppers of these lengths (m) and stiffnesses (N/m), (n_droppers,), hold the wires in.

    Arms that hold the wire keep it at the support's height. pushed: number of a node of the contact wire, and
    an upward force there (N).
    """
    lower, weight = line.wire(line.wires[0])
    upper, above_weight = line.wire(line.wires[1])
    upper, above_weight = _on_springs(upper, above_weight, line)
    size, lengths, k = weight.size, np.tile(unloaded, 2), np.tile(stiffness, 2)
    both = sparse.block_diag([lower, upper]).tocsr()
    count = line.hung.size
    rows = np.repeat(np.arange(count), 2)
    columns = np.stack([2 * line.hung, size + 2 * line.hung], axis=1).ravel()
    apart = sparse.csr_array((np.tile([-1.0, 1.0], count), (rows, columns)), (count, 2 * size))
    half = line.mass * lengths / 2
    force = np.append(weight, above_weight)
    force[2 * line.hung] -= GRAVITY * (half + line.lower)
    force[size + 2 * line.hung] -= GRAVITY * (half + line.upper)
    force += apart.T @ (k * lengths)
    force[2 * pushed[0]] += pushed[1]
    both = both + apart.T @ sparse.diags_array(k) @ apart
    holding = 2 * line.masts[np.flatnonzero(line.holds)]
    state = np.zeros(2 * size)
    state[holding] = line.low[np.flatnonzero(line.holds)]
    free = np.setdiff1d(np.arange(2 * size), holding)
    state[free] = spsolve(both.tocsr()[free][:, free].tocsc(), (force - both @ state)[free])
    tension = k * (apart @ state - lengths) + 0.0
    return line.shape(state[:size], state[size:], tension)


def _on_springs(
    stiffness: sparse.csr_array, force: Array, line: ClosedLine
) -> tuple[sparse.csc_array, Array]:
    springs, force = np.zeros(force.size), force.copy()
    springs[2 * line.masts] = line.support
    force[2 * line.masts] += line.support * line.high
    return (stiffness + sparse.diags_array(springs)).tocsc(), force


def _mirrored(at_supports: Array) -> Array:
    """Values at the supports of the line and of its image, of which the last is the first one again."""
    return np.append(at_supports, at_supports[-2:0:-1])
