"""Pantograph: a chain of lumped masses, discretised exactly with the matrix exponential."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...backend.compile import part
from ...base.arrays import Array, Index
from ..actuators.lagged import FRAME, HEAD
from .schema import PantographData

STRIP_STIFFNESS = 50e3
"""Contact spring (N/m) of a 'rigid' collector strip on a wire that has mass of its own: EN 50318's."""


MAX_STATE = 16
"""Entries of the state of a pantograph at most: the schema allows eight masses."""


class Body(NamedTuple):
    """What the pantographs of all lanes are made of: all the same, or each a variety of its own.

    n masses: the state is n displacements, then n velocities.
    """

    variety: Index  # (lanes,): which of the varieties a lane has
    transition: Array  # (varieties, 2n, 2n): exp(A dt)
    contact_input: Array  # (varieties, 2n): change of the state by 1 N of contact force over a step
    frame_input: Array  # (varieties, 2n): by 1 N up on the frame (the lowest mass)
    head_input: Array  # (varieties, 2n): by 1 N up on the head and down on the mass below it
    strip: Array  # (varieties, 2): compliance of the contact spring (m/N); damper over the step (N/m)


def matrices(pantograph: PantographData) -> tuple[Array, Array]:
    """State matrix A, (2n, 2n), and inputs [contact, frame, head pair], (2n, 3), of x' = Ax + Bf."""
    n = len(pantograph.masses)
    stiffness, damping = _chain(pantograph.stiffnesses), _chain(pantograph.dampings)
    inverse_mass = np.diag(1 / np.array(pantograph.masses))
    forces = np.zeros((n, 3))
    forces[0, 0] = -1.0
    forces[-1, 1] = 1.0
    forces[0, 2] += 1.0
    if n > 1:
        forces[1, 2] -= 1.0
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse_mass @ stiffness, -inverse_mass @ damping]])
    b = np.vstack([np.zeros((n, 3)), inverse_mass @ forces])
    return a, b


def _chain(values: tuple[float, ...]) -> Array:
    """Matrix, (n, n), of springs or dampers between each mass and the next, the last to the ground."""
    matrix = np.diag(values).astype(float)
    for i, value in enumerate(values[:-1]):
        matrix[i + 1, i + 1] += value
        matrix[i, i + 1] = matrix[i + 1, i] = -value
    return matrix


def discretise(pantograph: PantographData, time_step: float) -> tuple[Array, Array]:
    """Exact transition, (2n, 2n), and inputs, (2n, 3), for forces held over ``time_step`` (s)."""
    from scipy.linalg import expm  # slow to import

    a, b = matrices(pantograph)
    n, m = b.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = a * time_step, b * time_step
    whole = expm(block)
    return whole[:n, :n].copy(), whole[:n, n:].copy()


def body(size: int, lanes: int, varieties: int = 1) -> Body:
    """Room for the pantographs of ``lanes`` lanes, of ``size`` entries of state; ``equip`` fills it."""
    return Body(
        variety=np.zeros(lanes, dtype=np.int64),
        transition=np.zeros((varieties, size, size)),
        contact_input=np.zeros((varieties, size)),
        frame_input=np.zeros((varieties, size)),
        head_input=np.zeros((varieties, size)),
        strip=np.zeros((varieties, 2)),
    )


def equip(body: Body, variety: int, pantograph: PantographData, massless: bool, time_step: float) -> None:
    """Make one variety this pantograph; massless: whether the wire is, so that a strip can be rigid."""
    transition, inputs = discretise(pantograph, time_step)
    body.transition[variety] = transition
    body.contact_input[variety] = inputs[:, 0]
    body.frame_input[variety] = inputs[:, 1]
    body.head_input[variety] = inputs[:, 2]
    rigid = 0.0 if massless else 1 / STRIP_STIFFNESS
    stiffness = pantograph.contact_stiffness
    compliance = rigid if stiffness == "rigid" else 1 / stiffness
    body.strip[variety] = compliance, pantograph.contact_damping / time_step


def vary(pantograph: PantographData, scatter: float, random: np.random.Generator) -> PantographData:
    """A pantograph whose masses, springs and dampers differ at random, by ``scatter`` rms (relative)."""

    def drawn(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(np.asarray(values) * np.exp(scatter * random.standard_normal(len(values))))

    chain = {name: drawn(getattr(pantograph, name)) for name in ("masses", "stiffnesses", "dampings")}
    return pantograph.model_copy(update=chain)


def rest(pantograph: PantographData, lift: float, wire: float, compliance: float) -> Array:
    """State, (2n,), in static equilibrium under ``lift`` (N) against a point of the wire.

    The point stands at height ``wire`` (m) and yields ``compliance`` (m/N), contact spring included.
    """
    flexibility = _flexibility(pantograph.stiffnesses, compliance)
    heights = flexibility[:, -1] * lift + flexibility[:, 0] * (wire / compliance)
    return np.concatenate([heights, np.zeros(len(heights))])


@lru_cache(maxsize=64)
def _flexibility(stiffnesses: tuple[float, ...], compliance: float) -> Array:
    """Displacement of each mass (m) by 1 N on each, (n, n), the head held by ``compliance`` (m/N)."""
    stiffness = _chain(stiffnesses)
    stiffness[0, 0] += 1 / compliance
    return np.linalg.inv(stiffness)


@part
def move_free(body, variety, state, free, lift, drive, count):
    """States, (2n, count), after a step without contact force, into ``free``; drive: forces (N)."""
    size = body.transition.shape[1]
    for r in range(size):
        frame_input, head_input = body.frame_input[variety, r], body.head_input[variety, r]
        for i in range(count):
            free[r, i] = frame_input * (lift[i] + drive[FRAME, i]) + head_input * drive[HEAD, i]
        for j in range(0, size, 2):  # in pairs: there are as many velocities as displacements
            a, b = body.transition[variety, r, j], body.transition[variety, r, j + 1]
            for i in range(count):
                free[r, i] += a * state[j, i] + b * state[j + 1, i]


@part
def press(body, variety, state, free, force, count):
    """End the step: the free motion and what the contact force (N) adds to it."""
    for r in range(body.transition.shape[1]):
        contact_input = body.contact_input[variety, r]
        for i in range(count):
            state[r, i] = free[r, i] + contact_input * force[i]
