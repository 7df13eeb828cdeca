"""Static shape of a flexible line: the dropper tensions and lengths that give the wanted sag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, Indices, matrices, span_nodes, uniform_load

GRAVITY = 9.81


@dataclass(frozen=True)
class StaticShape:
    """One span of an endless line; heights over the contact wire's nominal height, up positive."""

    x: Array
    """Node positions (m), shape (n_nodes,); both supports are nodes."""
    contact: Array
    """Contact wire height (m), shape (n_nodes,)."""
    contact_slope: Array
    """Contact wire slope (-), shape (n_nodes,)."""
    messenger: Array
    """Messenger wire height (m), shape (n_nodes,)."""
    messenger_slope: Array
    """Messenger wire slope (-), shape (n_nodes,)."""
    dropper_tension: Array
    """Tension above the contact-wire clamp (N), shape (n_droppers,)."""
    dropper_length: Array
    """Distance of the loaded wires at each dropper (m), shape (n_droppers,)."""


def static_shape(line: FlexibleCatenaryData, element: float = 0.25) -> StaticShape:
    """Shape under gravity in elements of at most ``element`` (m).

    A dropper's mass sits half on either wire. The messenger's support, unloaded, stands at the encumbrance
    and yields under the load. The steady arm carries none of the wire, unless the catalogue says that it
    holds it: then the contact wire is at height 0 at the support.
    """
    droppers = line.droppers
    x = span_nodes(line.span_length, droppers.positions, element)
    at = np.searchsorted(x, np.array(droppers.positions) - 1e-9)
    held, heights = at, -np.array(droppers.sag)
    if line.steady_arm.holds_wire:
        held, heights = np.append(at, 0), np.append(heights, 0.0)
    length, top = np.full(at.size, line.encumbrance), np.array([line.encumbrance])
    for _ in range(50):
        half = droppers.mass * length / 2
        clamped = half + droppers.contact_clamp_mass
        contact, reaction = _hang(x, line.contact_wire, held, heights, at, clamped)
        tension = reaction[: at.size]
        load = tension / GRAVITY + half + droppers.messenger_clamp_mass
        messenger, carried = _hang(x, line.messenger_wire, np.array([0]), top, at, load)
        top = line.encumbrance - carried / line.support.stiffness
        old, length = length, messenger[at, 0] - contact[at, 0]
        if np.max(np.abs(length - old)) < 1e-12:
            break
    return StaticShape(x, *contact.T, *messenger.T, tension, length)


def _hang(
    x: Array, wire: Wire, held: Indices, heights: Array, loaded: Indices, masses: Array
) -> tuple[Array, Array]:
    """Periodic wire held at nodes ``held`` at ``heights``, with ``masses`` (kg) at ``loaded``.

    Returns height and slope at every node, shape (n_nodes, 2), and the upward forces that hold it.
    """
    stiffness, _ = matrices(x, wire)
    force = uniform_load(x, -wire.mass * GRAVITY)
    force[2 * loaded] -= GRAVITY * masses
    # The last node is the first one again: fold its two unknowns onto those of the first.
    size = 2 * x.size - 2
    fold = sparse.csr_array(
        (np.ones(size + 2), (np.arange(size + 2), np.arange(size + 2) % size)), (size + 2, size)
    )
    stiffness, force = sparse.csr_array(fold.T @ stiffness @ fold), fold.T @ force
    shape = np.zeros(size)
    shape[2 * held] = heights
    free = np.setdiff1d(np.arange(size), 2 * held)
    shape[free] = spsolve(stiffness[free][:, free].tocsc(), (force - stiffness @ shape)[free])
    reaction = (stiffness @ shape - force)[2 * held]
    return (fold @ shape).reshape(-1, 2), reaction
