"""Linear matrices of a whole line about its static shape, every dropper taken as taut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData

from .hermite import Array, Indices, matrices, shape_functions
from .rest import at_rest


@dataclass(frozen=True)
class LineSystem:
    """Unknowns per node: messenger height and slope, contact wire height and slope (m, -)."""

    nodes: Array
    """Node positions (m), shape (n_nodes,)."""
    free: Array
    """1 for an unknown, 0 for a fixed wire end, shape (4 n_nodes,)."""
    static: Array
    """Static height and slope of the contact wire (m, -), shape (n_nodes, 2)."""
    mass: sparse.csr_array
    damping: sparse.csr_array
    stiffness: sparse.csr_array
    """Matrices (kg, N s/m, N/m), shape (4 n_nodes, 4 n_nodes); unit mass at fixed unknowns."""
    extension: sparse.csr_array
    """Messenger less contact height at each dropper, shape (n_droppers, 4 n_nodes)."""
    dropper_stiffness: Array
    """Shape (n_droppers,) (N/m)."""
    dropper_damping: Array
    """Shape (n_droppers,) (N s/m)."""
    dropper_tension: Array
    """Static tension, shape (n_droppers,) (N)."""
    supports: Indices
    """Unknowns that are the contact wire's height at the interior supports, integers."""
    support_position: Array
    """Where the interior supports stand, shape (spans - 1,) (m)."""

    def contact_point(self, x: float) -> tuple[Indices, Array, Array, float, float]:
        """Unknowns, values and slopes of the contact wire's height at ``x`` (m), shapes (4,);
        then its static height (m) and slope (-) there."""
        i = min(max(int(np.searchsorted(self.nodes, x, side="right")) - 1, 0), self.nodes.size - 2)
        h = self.nodes[i + 1] - self.nodes[i]
        values, slopes = shape_functions((x - self.nodes[i]) / h, h)
        ends = self.static[i : i + 2].ravel()
        unknowns = 4 * i + np.array([2, 3, 6, 7])
        free = self.free[unknowns]
        return unknowns, free * values, free * slopes, float(values @ ends), float(slopes @ ends)


def build(line: FlexibleCatenaryData, spans: int, element: float) -> LineSystem:
    """Line of ``spans`` spans in elements up to ``element`` (m), both wires fixed at its ends."""
    rest = at_rest(line, spans, element)
    count, at, masts = rest.nodes.size, rest.droppers, rest.masts
    tables = [span.droppers for span in rest.spans for _ in span.droppers.positions]
    stands = rest.spans[1:]  # each interior support is its following span's

    size = 4 * count
    on_messenger = _placement(size, 4 * np.arange(count)[:, None] + [0, 1])
    on_contact = _placement(size, 4 * np.arange(count)[:, None] + [2, 3])
    k_messenger, m_messenger = matrices(rest.nodes, line.messenger_wire)
    k_contact, m_contact = matrices(rest.nodes, line.contact_wire)
    stiffness = on_messenger @ k_messenger @ on_messenger.T + on_contact @ k_contact @ on_contact.T
    mass = on_messenger @ m_messenger @ on_messenger.T + on_contact @ m_contact @ on_contact.T

    k = np.array(
        [
            each.stiffness if each.axial_stiffness is None else each.axial_stiffness / length
            for each, length in zip(tables, rest.dropper_length, strict=True)
        ]
    )
    extension = (_placement(size, 4 * at) - _placement(size, 4 * at + 2)).T.tocsr()
    stiffness = stiffness + extension.T @ sparse.diags_array(k) @ extension
    # Rayleigh damping is the wires' (and taut droppers'), so it is taken before what follows.
    damping = line.damping.alpha * mass + line.damping.beta * stiffness

    half = np.array([each.mass for each in tables]) * rest.dropper_length / 2
    point_mass, point_spring, point_damper = np.zeros((3, size))
    point_mass[4 * at] += half + [each.messenger_clamp_mass for each in tables]
    point_mass[4 * at + 2] += half + [each.contact_clamp_mass for each in tables]
    point_mass[4 * masts + 2] += [each.steady_arm.mass for each in stands]
    point_spring[4 * masts] += [each.support.stiffness for each in stands]
    point_spring[4 * masts + 2] += [each.steady_arm.stiffness for each in stands]
    point_damper[4 * masts] += [each.support.damping for each in stands]

    free = np.ones(size)
    free[[0, 2, size - 4, size - 2]] = 0.0
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
        dropper_damping=line.damping.beta * k,
        dropper_tension=rest.dropper_tension,
        supports=4 * masts + 2,
        support_position=rest.nodes[masts],
    )  # fmt: skip


def _placement(size: int, unknowns: Indices) -> sparse.csr_array:
    """Columns that put a local unknown onto a global one, shape (size, n_unknowns)."""
    rows = np.ravel(unknowns)
    return sparse.csr_array((np.ones(rows.size), (rows, np.arange(rows.size))), (size, rows.size))
