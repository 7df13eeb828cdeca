"""Static shape of a flexible line: the dropper tensions and lengths that give the wanted sag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData

from .hermite import Array, Indices, matrices, uniform_load
from .stitch import GRAVITY, Upper, nodes_between, stitches_at

__all__ = ["GRAVITY", "StaticShape", "static_shape"]


@dataclass(frozen=True)
class StaticShape:
    """One span of an endless line; heights over the contact wire's nominal height, up positive."""

    x: Array  # node positions (m), shape (n_nodes,); both supports are nodes
    contact: Array  # contact wire height (m), shape (n_nodes,)
    contact_slope: Array  # contact wire slope (-), shape (n_nodes,)
    messenger: Array  # messenger wire height (m), shape (n_nodes,)
    messenger_slope: Array  # messenger wire slope (-), shape (n_nodes,)
    hanger: Array
    """Height of what a dropper would hang from: a stitch wire, or the messenger (m), shape (n_nodes,)."""
    dropper_tension: Array  # tension above the contact-wire clamp (N), shape (n_droppers,)
    dropper_length: Array  # distance of the loaded wires at each dropper (m), shape (n_droppers,)


def static_shape(line: FlexibleCatenaryData, element: float = 0.25) -> StaticShape:
    """Shape under gravity in elements of at most ``element`` (m).

    A dropper's mass sits half on either wire. The messenger's support, unloaded, stands at the encumbrance
    and yields under the load. The steady arm carries none of the wire, unless the catalogue says that it
    holds it: then the contact wire is at height 0 at the support.
    """
    droppers, ends = line.droppers, (0.0, line.span_length)
    stitches = stitches_at(ends, (line.stitch_wire,) * 2)
    x = nodes_between(*ends, droppers.positions, stitches, element)
    at = np.searchsorted(x, np.array(droppers.positions) - 1e-9)
    upper = Upper(x, line.messenger_wire, stitches)
    hung = upper.under[at]
    around = _repeating(upper.size, upper.under)
    springs = np.zeros(upper.size)
    springs[0] = line.support.stiffness  # at the last node stands the same support again

    held, heights = at, -np.array(droppers.sag)
    if line.steady_arm.holds_wire:
        held, heights = np.append(at, 0), np.append(heights, 0.0)
    stiffness, _ = matrices(x, line.contact_wire)
    fold = _repeating(2 * x.size, 2 * np.arange(x.size))
    weight = uniform_load(x, -line.contact_wire.mass * GRAVITY)
    length = np.full(at.size, line.encumbrance)
    for _ in range(50):
        half = droppers.mass * length / 2
        force = weight.copy()
        force[2 * at] -= GRAVITY * (half + droppers.contact_clamp_mass)
        contact, reaction = _hang(stiffness, force, fold, 2 * held, heights)
        tension = reaction[: at.size]
        force = upper.weight + springs * line.encumbrance
        force[hung] -= tension + GRAVITY * (half + droppers.messenger_clamp_mass)
        above, _ = _hang(upper.stiffness + sparse.diags_array(springs), force, around)
        old, length = length, above[hung] - contact[2 * at]
        if np.max(np.abs(length - old)) < 1e-12:
            break
    messenger = above[: 2 * x.size].reshape(-1, 2)
    return StaticShape(x, *contact.reshape(-1, 2).T, *messenger.T, above[upper.under], tension, length)


def _hang(
    stiffness: sparse.csr_array,
    force: Array,
    fold: sparse.csr_array,
    held: Indices | None = None,
    heights: Array | None = None,
) -> tuple[Array, Array]:
    """Unknowns under forces, folded, with those ``held`` at ``heights``; and the forces that hold these."""
    fixed = np.zeros(0, int) if held is None else fold.indices[held]
    folded, load = sparse.csr_array(fold.T @ stiffness @ fold), fold.T @ force
    shape = np.zeros(load.size)
    shape[fixed] = 0.0 if heights is None else heights
    free = np.setdiff1d(np.arange(load.size), fixed)
    shape[free] = spsolve(folded[free][:, free].tocsc(), (load - folded @ shape)[free])
    return fold @ shape, (folded @ shape - load)[fixed]


def _repeating(size: int, under: Indices) -> sparse.csr_array:
    """Folds the last node's unknowns onto the first one's: height, slope, and what droppers hang from."""
    same = np.arange(size)
    last = 2 * under.size - 2
    same[[last, last + 1, under[-1]]] = 0, 1, under[0]
    _, columns = np.unique(same, return_inverse=True)
    return sparse.csr_array((np.ones(size), (np.arange(size), columns)), (size, int(columns.max()) + 1))
