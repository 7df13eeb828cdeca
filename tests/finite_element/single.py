"""A single wire or rail on point supports as the judge's matrices, with a messenger that nothing moves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from panto_env.plant.catenary.single import SingleData

from .hermite import Array, matrices, uniform_load
from .system import LineSystem

GRAVITY = 9.81


def build_single(line: SingleData, spans: int, element: float, turning: bool = False) -> LineSystem:
    """Line of a number of spans, in elements up to ``element`` (m), held at its ends.

    turning: whether its ends may turn. Beside the wire's own unknowns lie as many that move nothing, as many
    as a messenger has.
    """
    supports = np.array(line.alignment(spans).supports)
    parts = [
        np.linspace(a, b, int(np.ceil((b - a) / element - 1e-9)), endpoint=False)
        for a, b in pairwise(supports)
    ]
    nodes = np.append(np.concatenate(parts), supports[-1])
    masts = np.searchsorted(nodes, supports[1:-1] - 1e-9)
    stiffness, mass = matrices(nodes, line.contact_wire)
    alpha, beta = line.damping.alpha, line.damping.beta
    damping = alpha * mass + beta * stiffness
    size = mass.shape[0]
    held = [0, size - 2] + ([] if turning else [1, size - 1])
    rest = _levelled(stiffness, -GRAVITY * line.contact_wire.mass * uniform_load(nodes, 1.0), masts, held)
    spring, damper = np.zeros((2, size))
    spring[2 * masts], damper[2 * masts] = line.support.stiffness, line.support.damping
    free = np.ones(size)
    free[held] = 0.0

    # Four unknowns a node, of which the wire's own are the last two.
    own = (4 * np.arange(nodes.size)[:, None] + [2, 3]).ravel()
    place = sparse.csr_array((np.ones(size), (own, np.arange(size))), (2 * size, size))
    fixed = np.ones(2 * size)
    fixed[own] = 1 - free
    keep = place @ sparse.diags_array(free)

    def whole(matrix: sparse.csr_array) -> sparse.csr_array:
        return sparse.csr_array(keep @ matrix @ keep.T)

    return LineSystem(
        nodes=nodes,
        free=1 - fixed,
        static=rest.reshape(-1, 2),
        mass=whole(mass) + sparse.diags_array(fixed).tocsr(),
        damping=whole(damping + sparse.diags_array(damper)),
        stiffness=whole(stiffness + sparse.diags_array(spring)),
        extension=sparse.csr_array((0, 2 * size)),
        dropper_stiffness=np.zeros(0),
        dropper_damping=np.zeros(0),
        dropper_tension=np.zeros(0),
        supports=4 * masts + 2,
        support_position=nodes[masts],
        pairs=((0, nodes.size, 0),),
    )


def _levelled(stiffness: sparse.csr_array, load: Array, masts: Array, held: list[int]) -> Array:
    """Heights and slopes at rest under a load, with all supports at height 0."""
    rest = np.zeros(load.size)
    free = np.setdiff1d(np.arange(load.size), [*held, *(2 * masts)])
    rest[free] = spsolve(stiffness[free][:, free].tocsc(), load[free])
    return rest
