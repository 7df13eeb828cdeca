"""Linear matrices of a whole line about its static shape, every dropper taken as taut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData, Rayleigh
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, Indices, matrices, shape_functions
from .rest import PairAtRest, at_rest
from .stitch import Upper, stitches_at


@dataclass(frozen=True)
class LineSystem:
    """Unknowns of a pair of wires per node: messenger height and slope, contact wire height and slope (m, -).

    After those of its nodes come the heights of its stitch wires; then the next pair's.
    """

    nodes: Array  # node positions (m), shape (n_nodes,), pair after pair
    free: Array  # 1 for an unknown, 0 for a fixed wire end, shape (n_unknowns,)
    static: Array  # static height and slope of the contact wire (m, -), shape (n_nodes, 2)
    mass: sparse.csr_array
    damping: sparse.csr_array
    stiffness: sparse.csr_array
    """Matrices (kg, N s/m, N/m), shape (n_unknowns, n_unknowns); unit mass at fixed unknowns."""
    extension: sparse.csr_array
    """Height of each dropper's upper end less that of its lower one, shape (n_droppers, n_unknowns)."""
    dropper_stiffness: Array  # shape (n_droppers,) (N/m)
    dropper_damping: Array  # shape (n_droppers,) (N s/m)
    dropper_tension: Array  # static tension, shape (n_droppers,) (N)
    supports: Indices
    """Unknowns that are the height of the contact wire in use at the interior supports, integers."""
    support_position: Array  # where the interior supports stand, shape (spans - 1,) (m)
    pairs: tuple[tuple[int, int, int], ...]
    """First node, node after the last, and first unknown of each pair of wires."""

    def contact_point(self, x: float, pair: int = 0) -> tuple[Indices, Array, Array, float, float]:
        """Unknowns, values and slopes of a contact wire's height at ``x`` (m), shapes (4,);
        then its static height (m) and slope (-) there. Beyond its anchors the wire is as if cut off."""
        first, last, unknown = self.pairs[pair]
        i = min(max(int(np.searchsorted(self.nodes[first:last], x, side="right")) - 1, 0), last - first - 2)
        here = first + i
        h = self.nodes[here + 1] - self.nodes[here]
        values, slopes = shape_functions((x - self.nodes[here]) / h, h)
        ends = self.static[here : here + 2].ravel()
        unknowns = unknown + 4 * i + np.array([2, 3, 6, 7])
        free = self.free[unknowns]
        return unknowns, free * values, free * slopes, float(values @ ends), float(slopes @ ends)

    def hangs_over(self, x: float) -> list[int]:
        """Numbers of the pairs of wires whose anchors lie on either side of ``x`` (m)."""
        ends = [(self.nodes[first], self.nodes[last - 1]) for first, last, _ in self.pairs]
        return [k for k, (begin, end) in enumerate(ends) if begin - 1e-9 <= x <= end + 1e-9]


def build(line: FlexibleCatenaryData, spans: int, element: float) -> LineSystem:
    """Line of ``spans`` spans in elements up to ``element`` (m), all wires fixed at their ends."""
    return joined([of_pair(rest, line.wires, line.damping) for rest in at_rest(line, spans, element)])


def joined(systems: Sequence[LineSystem]) -> LineSystem:
    """Pairs of wires in the order of travel as one line; nothing but a train joins them."""
    if len(systems) == 1:
        return systems[0]
    nodes = np.cumsum([0, *(each.nodes.size for each in systems)]).tolist()
    unknowns = np.cumsum([0, *(each.free.size for each in systems)]).tolist()

    def chained(key: str) -> Array:
        return np.concatenate([getattr(each, key) for each in systems])

    def blocks(key: str) -> sparse.csr_array:
        return sparse.csr_array(sparse.block_diag([getattr(each, key) for each in systems]))

    chains = ("nodes", "free", "static", "dropper_stiffness", "dropper_damping", "dropper_tension")
    return LineSystem(
        **{key: chained(key) for key in (*chains, "support_position")},
        **{key: blocks(key) for key in ("mass", "damping", "stiffness", "extension")},
        supports=np.concatenate([each.supports + at for each, at in zip(systems, unknowns, strict=False)]),
        pairs=tuple(zip(nodes[:-1], nodes[1:], unknowns[:-1], strict=True)),
    )


def of_pair(rest: PairAtRest, wires: tuple[Wire, Wire], rayleigh: Rayleigh) -> LineSystem:
    """A pair of wires (contact, messenger) between its anchors, where no stitch wire is."""
    count, at, masts = rest.nodes.size, rest.droppers, rest.masts
    tables = [span.droppers for span in rest.spans for _ in span.droppers.positions]
    stands = rest.spans[1:]  # each interior support is its following span's
    contact_wire, messenger_wire = wires

    stitches = stitches_at(rest.nodes[masts].tolist(), [each.stitch_wire for each in stands])
    upper = Upper(rest.nodes, messenger_wire, stitches)
    size = 2 * count + upper.size
    own = np.append(4 * np.arange(count)[:, None] + [0, 1], np.arange(4 * count, size))
    on_messenger = _placement(size, own)
    on_contact = _placement(size, 4 * np.arange(count)[:, None] + [2, 3])
    k_contact, m_contact = matrices(rest.nodes, contact_wire)
    stiffness = on_messenger @ upper.stiffness @ on_messenger.T + on_contact @ k_contact @ on_contact.T
    mass = on_messenger @ upper.mass @ on_messenger.T + on_contact @ m_contact @ on_contact.T

    k = np.array(
        [
            each.stiffness if each.axial_stiffness is None else each.axial_stiffness / length
            for each, length in zip(tables, rest.dropper_length, strict=True)
        ]
    )
    hung = own[upper.under[at]]
    extension = (_placement(size, hung) - _placement(size, 4 * at + 2)).T.tocsr()
    stiffness = stiffness + extension.T @ sparse.diags_array(k) @ extension
    # Rayleigh damping is the wires' (and taut droppers'), so it is taken before what follows.
    damping = rayleigh.alpha * mass + rayleigh.beta * stiffness

    half = np.array([each.mass for each in tables]) * rest.dropper_length / 2
    point_mass, point_spring, point_damper = np.zeros((3, size))
    point_mass[4 * np.arange(count)] += upper.clamps
    point_mass[hung] += half + [each.messenger_clamp_mass for each in tables]
    point_mass[4 * at + 2] += half + [each.contact_clamp_mass for each in tables]
    point_mass[4 * masts + 2] += [each.steady_arm.mass for each in stands]
    point_spring[4 * masts] += [each.support.stiffness for each in stands]
    point_spring[4 * masts + 2] += [each.steady_arm.stiffness for each in stands]
    point_damper[4 * masts] += [each.support.damping for each in stands]

    free = np.ones(size)
    free[[0, 2, 4 * count - 4, 4 * count - 2]] = 0.0
    keep = sparse.diags_array(free)
    return LineSystem(
        nodes=rest.nodes,
        free=free,
        static=rest.contact,
        mass=(keep @ (mass + sparse.diags_array(point_mass)) @ keep
              + sparse.diags_array(1 - free)).tocsr(),
        damping=(keep @ (damping + sparse.diags_array(point_damper)) @ keep).tocsr(),
        stiffness=(keep @ (stiffness + sparse.diags_array(point_spring)) @ keep).tocsr(),
        extension=extension,
        dropper_stiffness=k,
        dropper_damping=rayleigh.beta * k,
        dropper_tension=rest.dropper_tension,
        supports=4 * rest.in_use + 2,
        support_position=rest.nodes[rest.in_use],
        pairs=((0, count, 0),),
    )  # fmt: skip


def _placement(size: int, unknowns: Indices) -> sparse.csr_array:
    """Columns that put a local unknown onto a global one, shape (size, n_unknowns)."""
    rows = np.ravel(unknowns)
    return sparse.csr_array((np.ones(rows.size), (rows, np.arange(rows.size))), (size, rows.size))
