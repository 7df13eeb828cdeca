"""Pantograph: a chain of lumped masses, discretised exactly with the matrix exponential."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..catalog.schema import PantographData
from .jit import part

STRIP_STIFFNESS = 50e3
"""Contact spring (N/m) of a 'rigid' collector strip on a wire that has mass of its own: EN 50318's."""


class Body(NamedTuple):
    """Pantographs of all lanes. n masses: the state is n displacements, then n velocities."""

    state: Array  # (lanes, 2n): displacement (m) and velocity (m/s), head first
    free: Array  # (lanes, 2n): state at the end of the step, were there no contact force
    transition: Array  # (2n, 2n): exp(A dt)
    contact_input: Array  # (2n,): change of the state by 1 N of contact force over a step
    frame_input: Array  # (2n,): by 1 N up on the frame (the lowest mass)
    head_input: Array  # (2n,): by 1 N up on the head and down on the mass below it
    lift: Array  # (lanes,): static and aerodynamic uplift on the lowest mass (N)


def matrices(pantograph: PantographData) -> tuple[Array, Array]:
    """State matrix A, (2n, 2n), and inputs [contact, frame, head pair], (2n, 3), of x' = Ax + Bf."""
    n = len(pantograph.masses)
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    chains = zip((stiffness, damping), (pantograph.stiffnesses, pantograph.dampings), strict=True)
    for matrix, values in chains:
        for i, value in enumerate(values):
            matrix[i, i] += value
            if i + 1 < n:
                matrix[i + 1, i + 1] += value
                matrix[i, i + 1] -= value
                matrix[i + 1, i] -= value
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


def discretise(pantograph: PantographData, time_step: float) -> tuple[Array, Array]:
    """Exact transition, (2n, 2n), and inputs, (2n, 3), for forces held over ``time_step`` (s)."""
    from scipy.linalg import expm  # slow to import

    a, b = matrices(pantograph)
    n, m = b.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = a * time_step, b * time_step
    whole = expm(block)
    return whole[:n, :n].copy(), whole[:n, n:].copy()


def body(pantograph: PantographData, time_step: float, lanes: int) -> Body:
    """Pantographs at rest for ``lanes`` lanes; ``rest`` puts them on the wire."""
    transition, inputs = discretise(pantograph, time_step)
    size = len(transition)
    return Body(
        state=np.zeros((lanes, size)),
        free=np.zeros((lanes, size)),
        transition=transition,
        contact_input=inputs[:, 0].copy(),
        frame_input=inputs[:, 1].copy(),
        head_input=inputs[:, 2].copy(),
        lift=np.zeros(lanes),
    )


def rest(pantograph: PantographData, lift: float, wire: float, compliance: float) -> Array:
    """State, (2n,), in static equilibrium under ``lift`` (N) against a point of the wire.

    The point stands at height ``wire`` (m) and yields ``compliance`` (m/N), contact spring included.
    """
    n = len(pantograph.masses)
    a, _ = matrices(pantograph)
    stiffness = -a[n:, :n] * np.array(pantograph.masses)[:, None]
    stiffness[0, 0] += 1 / compliance
    load = np.zeros(n)
    load[-1] = lift
    load[0] += wire / compliance
    return np.concatenate([np.linalg.solve(stiffness, load), np.zeros(n)])


@part
def move_free(body, lane, frame_force, head_force):
    """State of one lane after a step without contact force, into ``body.free``; the head's height."""
    state, free = body.state[lane], body.free[lane]
    lift = body.lift[lane] + frame_force
    for i in range(state.size):
        total = body.frame_input[i] * lift + body.head_input[i] * head_force
        for j in range(state.size):
            total += body.transition[i, j] * state[j]
        free[i] = total
    return free[0]


@part
def press(body, lane, contact_force):
    """End the step of one lane: the free motion and what the contact force adds to it."""
    state, free = body.state[lane], body.free[lane]
    for i in range(state.size):
        state[i] = free[i] + body.contact_input[i] * contact_force
