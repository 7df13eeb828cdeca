"""Energy of the wires and droppers of a discrete line, which the leapfrog keeps without damping."""

import numpy as np

from panto_env.plant.catenary.flexible.arrays import PAD, STENCIL


def of_wire(old, new, stencil, mass, bare, step):
    """Energy (J) of one wire between two steps, from displacements of all its nodes (m).

    mass: of each node (kg), 0 for one that does not move. bare: of a node of bare wire.
    """
    kinetic = (mass * (new - old) ** 2).sum() / (2 * step**2)
    bend = np.diff(old, 2)
    weights = stencil[[STENCIL.BEYOND, STENCIL.NEXT, STENCIL.HERE, STENCIL.NEXT, STENCIL.BEYOND]]
    pull = np.convolve(bend, weights, mode="valid")
    return kinetic - (new[PAD:-PAD] * pull).sum() * bare / (2 * step**2)


def of_droppers(old, new, stiffness, static):
    """Energy (J) of droppers between two steps, from extensions (m) beyond the static ones (N).

    Exact where they stay taut. Where they go slack, the mean of that before and after, which only swings
    about the energy that is kept.
    """

    def stored(extension):
        slack = -static * extension - static**2 / stiffness / 2
        return np.where(stiffness * extension > -static, stiffness * extension**2 / 2, slack)

    taut = stiffness * np.minimum(old, new) > -static
    return np.where(taut, stiffness * old * new / 2, (stored(old) + stored(new)) / 2).sum()
