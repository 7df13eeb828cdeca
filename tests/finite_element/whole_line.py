"""Static shape of a line of unlike spans in Hermite elements: as it is designed, and as its droppers hold it.

The line is closed by its own mirror images about the straight lines of its outermost spans: its ends go on at
these gradients, with half of a support's stiffness and load, and half of a stitch wire.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from panto_env.plant.catenary.flexible.schema import Span
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, Indices, matrices, uniform_load
from .stitch import GRAVITY, Upper, nodes_between, stitches_at


@dataclass(frozen=True)
class LineShape:
    """The line itself, without its mirror images; heights over the nominal one."""

    x: Array  # node positions (m), shape (n_nodes,)
    contact: Array  # contact wire height (m), shape (n_nodes,)
    contact_slope: Array  # contact wire slope (-), shape (n_nodes,)
    messenger: Array  # messenger wire height (m), shape (n_nodes,)
    hanger: Array
    """Height of what a dropper would hang from: a stitch wire, or the messenger (m), shape (n_nodes,)."""
    dropper_tension: Array  # above the contact-wire clamp, shape (n_droppers,) (N)
    dropper_length: Array  # distance of the loaded wires at each dropper, shape (n_droppers,) (m)
    support_force: Array
    """With which supports carry the messenger, shape (n_spans + 1,) (N): half of it at the ends."""


class ClosedLine:
    """Nodes, droppers, supports and stitch wires of a line, and slopes at which it goes on at its ends."""

    def __init__(
        self,
        spans: Sequence[Span],
        end: tuple[float, float],
        wires: tuple[Wire, Wire],
        element: float,
        above: Array | float = 0.0,
    ) -> None:
        """end: contact height and encumbrance at the last support (m). wires: contact, messenger.

        above: wanted heights at droppers over straight lines between supports, less sags, (n_droppers,) (m).
        """
        supports = np.append(0.0, np.cumsum([span.span_length for span in spans]))
        stands = [*spans, spans[-1]]
        stitches = stitches_at(supports.tolist(), [each.stitch_wire for each in stands])
        pieces = [
            nodes_between(begin, begin + span.span_length, span.droppers.positions, stitches, element)[:-1]
            for begin, span in zip(supports.tolist(), spans, strict=False)
        ]
        x = np.concatenate(
            [begin + span.droppers.positions for begin, span in zip(supports, spans, strict=False)]
        )
        self.x = np.concatenate([*pieces, supports[-1:]])
        self.hung, self.masts = self._numbers(x), self._numbers(supports)
        self.upper = Upper(self.x, wires[1], stitches)
        self.low = np.array([*(span.contact_height for span in spans), end[0]])
        self.high = self.low + np.array([*(span.encumbrance for span in spans), end[1]])
        below = np.concatenate([span.droppers.sag for span in spans])
        self.heights = np.interp(x, supports, self.low) + above - below
        self.support = np.array([each.support.stiffness for each in stands])
        self.support[[0, -1]] /= 2
        self.arm = np.array([each.steady_arm.stiffness for each in stands])
        self.holding = np.flatnonzero([each.steady_arm.holds_wire for each in stands])

        def each(key: str) -> Array:
            return np.array([getattr(span.droppers, key) for span in spans for _ in span.droppers.sag])

        self.mass, self.lower_clamp, self.upper_clamp = map(
            each, ("mass", "contact_clamp_mass", "messenger_clamp_mass")
        )
        first, last = ((heights[1:] - heights[:-1]) / np.diff(supports) for heights in (self.low, self.high))
        self._slopes = (first[0], first[-1]), (last[0], last[-1])
        self._wire = wires[0]

    def _numbers(self, positions: Array) -> Indices:
        return np.abs(self.x[:, None] - positions).argmin(axis=0)

    @property
    def ends(self) -> tuple[Indices, Array, Array]:
        """Unknowns that are the ends' slopes, in either wire; the contact wire's slopes, the messenger's."""
        return np.array([1, 2 * self.x.size - 1]), np.array(self._slopes[0]), np.array(self._slopes[1])

    def contact_wire(self) -> tuple[sparse.csr_array, Array]:
        """Stiffness, and forces of the wire's own weight and of its ends."""
        force = uniform_load(self.x, -self._wire.mass * GRAVITY)
        force[[0, -2]] += self._wire.tension * np.array([-1.0, 1.0]) * self._slopes[0]
        return matrices(self.x, self._wire)[0], force

    def messenger(self) -> tuple[sparse.csr_array, Array]:
        """Stiffness, also of stitch wires and supports; forces of these, of own weights and of the ends."""
        springs, lifted = np.zeros((2, self.upper.size))
        springs[2 * self.masts], lifted[2 * self.masts] = self.support, self.support * self.high
        force = self.upper.weight + self.upper.end_forces(self._slopes[1]) + lifted
        return sparse.csr_array(self.upper.stiffness + sparse.diags_array(springs)), force

    def shape(self, contact: Array, messenger: Array, tension: Array) -> LineShape:
        """Of the unknowns of both wires and the droppers' tensions (N)."""
        return LineShape(
            self.x,
            contact[::2],
            contact[1::2],
            messenger[: 2 * self.x.size : 2],
            messenger[self.upper.under],
            tension,
            messenger[self.upper.under[self.hung]] - contact[2 * self.hung],
            self.support * (self.high - messenger[2 * self.masts]),
        )


def designed(line: ClosedLine) -> LineShape:
    """The shape with the contact wire at the wanted heights at its droppers, and at arms that hold it."""
    lower, weight = line.contact_wire()
    upper, above_weight = line.messenger()
    ends, lower_slopes, upper_slopes = line.ends
    held = np.concatenate([2 * line.hung, 2 * line.masts[line.holding], ends])
    fixed = np.concatenate([line.heights, line.low[line.holding], lower_slopes])
    hung, length = line.upper.under[line.hung], np.ones(line.hung.size)
    for _ in range(60):
        half = line.mass * length / 2
        force = weight.copy()
        force[2 * line.hung] -= GRAVITY * (half + line.lower_clamp)
        contact = _held(lower, force, held, fixed)
        tension = (lower @ contact - force)[2 * line.hung]
        force = above_weight.copy()
        force[hung] -= tension + GRAVITY * (half + line.upper_clamp)
        messenger = _held(upper, force, ends, upper_slopes)
        old, length = length, messenger[hung] - contact[2 * line.hung]
        if np.abs(length - old).max() < 1e-12:
            break
    return line.shape(contact, messenger, tension)


def built(
    line: ClosedLine,
    unloaded: Array,
    stiffness: Array,
    pushed: tuple[int, float] = (0, 0.0),
    at_arms: Array | None = None,
) -> LineShape:
    """The shape that droppers of these lengths (m) and stiffnesses (N/m), (n_droppers,), hold the wires in.

    Arms that hold the wire keep it at the support's height. pushed: number of a node of the contact wire, and
    an upward force there (N); at_arms: heights (m) of the contact wire at the supports, (supports,), at which
    the springs of arms are unloaded, without which they are left out.
    """
    lower, weight = line.contact_wire()
    upper, above_weight = line.messenger()
    size, count = weight.size, line.hung.size
    hung = size + line.upper.under[line.hung]
    rows = np.repeat(np.arange(count), 2)
    columns = np.stack([2 * line.hung, hung], axis=1).ravel()
    apart = sparse.csr_array(
        (np.tile([-1.0, 1.0], count), (rows, columns)), (count, size + above_weight.size)
    )
    half = line.mass * unloaded / 2
    force = np.append(weight, above_weight)
    force[2 * line.hung] -= GRAVITY * (half + line.lower_clamp)
    force[hung] -= GRAVITY * (half + line.upper_clamp)
    force += apart.T @ (stiffness * unloaded)
    force[2 * pushed[0]] += pushed[1]
    if at_arms is not None:
        springs = np.zeros(size)
        springs[2 * line.masts] = line.arm
        lower = lower + sparse.diags_array(springs)
        force[2 * line.masts] += line.arm * at_arms
    both = sparse.block_diag([lower, upper]) + apart.T @ sparse.diags_array(stiffness) @ apart
    ends, lower_slopes, upper_slopes = line.ends
    held = np.concatenate([2 * line.masts[line.holding], ends, size + ends])
    state = _held(
        sparse.csr_array(both),
        force,
        held,
        np.concatenate([line.low[line.holding], lower_slopes, upper_slopes]),
    )
    tension = stiffness * (apart @ state - unloaded) + 0.0
    return line.shape(state[:size], state[size:], tension)


def _held(stiffness: sparse.csr_array, force: Array, held: Indices, values: Array) -> Array:
    """Unknowns under forces, with some of them held at values."""
    state = np.zeros(force.size)
    state[held] = values
    free = np.setdiff1d(np.arange(force.size), held)
    state[free] = spsolve(stiffness[free][:, free].tocsc(), (force - stiffness @ state)[free])
    return state
