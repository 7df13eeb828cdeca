"""A pantograph's equations of motion, discretised exactly with the matrix exponential."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...base.arrays import Array, Index
from ..catenary.protocol import CatenaryModel
from .schema import PantographData

STRIP_STIFFNESS = 50e3
"""Contact spring (N/m) of a 'rigid' collector strip on a wire that has mass of its own: EN 50318's."""
LARGEST_PART, TERMS, TINY = 0.25, 11, 1e-300
"""Norm up to which so many terms of the exponential's series are enough: the next one is 1e-16."""
STABILITY_MARGIN = 0.3
"""Share of the stiffest contact that an explicit contact law could bear, which is used."""


class Pantographs(NamedTuple):
    """What the pantographs of all lanes are made of: all alike, or each a variant of its own.

    n masses: the state is n displacements, then n velocities.
    """

    variant: Index  # (lanes,): which of the variants a lane has
    transition: Array  # (variants, 2n, 2n): exp(A dt)
    contact_input: Array  # (variants, 2n): change of the state by 1 N of contact force over a step
    frame_input: Array  # (variants, 2n): by 1 N up on the frame (the lowest mass)
    head_input: Array  # (variants, 2n): by 1 N up on the head and down on the mass below it
    strip_compliance: Array  # (variants,): of the contact spring (m/N)
    strip_damping: Array  # (variants,): of the damper beside it, divided by the time step (N/m)
    implicit_share: Array  # (variants,): of the wire's height in the contact law, 0 explicit, 1 implicit

    def set_variant(self, variant: int, pantograph: PantographData, catenary: CatenaryModel) -> None:
        """Make one variant this pantograph; under a massless wire a strip can be rigid."""
        time_step = catenary.time_step
        transition, inputs = discretise(pantograph, time_step)
        self.transition[variant] = transition
        self.contact_input[variant] = inputs[:, 0]
        self.frame_input[variant] = inputs[:, 1]
        self.head_input[variant] = inputs[:, 2]
        rigid = 0.0 if catenary.massless else 1 / STRIP_STIFFNESS
        stiffness = pantograph.contact_stiffness
        self.strip_compliance[variant] = rigid if stiffness == "rigid" else 1 / stiffness
        self.strip_damping[variant] = pantograph.contact_damping / time_step
        bearable, gain = STABILITY_MARGIN * self.strip_compliance[variant], catenary.contact_gain
        self.implicit_share[variant] = 0.0 if bearable >= gain else 1.0 - bearable / gain


def pantographs(size: int, lanes: int, variants: int = 1) -> Pantographs:
    """Arrays for the pantographs of ``lanes`` lanes, of ``size`` entries of state each, all zero."""
    return Pantographs(
        variant=np.zeros(lanes, dtype=np.int64),
        transition=np.zeros((variants, size, size)),
        contact_input=np.zeros((variants, size)),
        frame_input=np.zeros((variants, size)),
        head_input=np.zeros((variants, size)),
        strip_compliance=np.zeros(variants),
        strip_damping=np.zeros(variants),
        implicit_share=np.zeros(variants),
    )


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
    a, b = matrices(pantograph)
    n, m = b.shape
    augmented = np.zeros((n + m, n + m))
    augmented[:n, :n], augmented[:n, n:] = a * time_step, b * time_step
    whole = exponential(augmented)
    return whole[:n, :n].copy(), whole[:n, n:].copy()


def exponential(matrix: Array) -> Array:
    """Exp of a square matrix: Taylor's series of a small part of it, squared as often as that takes.

    SciPy's takes a hundred times as long for such small ones, and longer still to import.
    """
    halvings = max(0, math.ceil(math.log2(max(np.abs(matrix).sum(axis=1).max(), TINY) / LARGEST_PART)))
    part = matrix / 2.0**halvings
    result = term = np.eye(len(matrix))
    for k in range(1, TERMS + 1):
        term = term @ part / k
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result


def with_scatter(pantograph: PantographData, scatter: float, random: np.random.Generator) -> PantographData:
    """A pantograph whose masses, springs and dampers differ at random, by ``scatter`` rms (relative)."""

    def drawn(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(np.asarray(values) * np.exp(scatter * random.standard_normal(len(values))))

    chain = {name: drawn(getattr(pantograph, name)) for name in ("masses", "stiffnesses", "dampings")}
    return pantograph.model_copy(update=chain)


def rest_state(
    pantograph: PantographData, nominal_force: float, wire_height: float, compliance: float
) -> Array:
    """State, (2n,), in static equilibrium under the nominal force (N) against a point of the wire.

    The point stands at ``wire_height`` (m) and yields ``compliance`` (m/N), contact spring included.
    """
    flexibility = _flexibility(pantograph.stiffnesses, compliance)
    heights = flexibility[:, -1] * nominal_force + flexibility[:, 0] * (wire_height / compliance)
    return np.concatenate([heights, np.zeros(len(heights))])


@lru_cache(maxsize=64)
def _flexibility(stiffnesses: tuple[float, ...], compliance: float) -> Array:
    """Displacement of each mass (m) by 1 N on each, (n, n), the head held by ``compliance`` (m/N)."""
    stiffness = _chain(stiffnesses)
    stiffness[0, 0] += 1 / compliance
    return np.linalg.inv(stiffness)
