"""A pantograph's equations of motion, discretised exactly with the matrix exponential."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...backend import aligned_zeros
from ...base.arrays import Array, Lanes
from ...base.errors import InputError, beside
from ..catenary.protocol import CatenaryModel
from ..state import PerCollector, per_collector
from .schema import PantographData
from .step import Part

STRIP_STIFFNESS = 50e3
"""Contact spring (N/m) of a 'rigid' collector strip on a wire with mass: EN 50318's."""
LARGEST_PART, TERMS, TINY = 0.25, 11, 1e-300
"""Norm up to which this number of terms of the exponential's series is enough: the next one is 1e-16."""
MOST_COMPRESSED = 0.3
"""Change of length at rest (m) beyond which a spring between two masses cannot be a pantograph's: heads have
strokes of 40 to 100 mm (recalled), and a head as a whole works within 300 mm."""
STABILITY_MARGIN = 0.3
"""Contact stiffness with the explicit contact law, as a share of the stiffness at which it gets unstable."""


ReflectedMasses = tuple[float, float]
"""Masses of actuators that move with a pantograph (kg), by ``Place``; see ``ActuatorSettings``."""
NONE_REFLECTED: ReflectedMasses = (0.0, 0.0)


class Pantographs(NamedTuple):
    """Constants of the pantographs: the same in all lanes, or each lane's own.

    With n masses the state is n displacements, then n velocities.
    """

    sizes: PerCollector  # 2n: entries of each collector's state
    table: Array  # (collectors, lanes, rows of ``Part``); one row for all lanes where they are alike

    def set_lanes(
        self,
        collector: int,
        lanes: Lanes,
        pantograph: PantographData,
        catenary: CatenaryModel,
        reflected: ReflectedMasses = NONE_REFLECTED,
    ) -> None:
        """Set the pantograph of a collector in some lanes."""
        own = parts(pantograph, catenary, reflected)
        self.table[collector, lanes, : len(own)] = own


def parts(
    pantograph: PantographData, catenary: CatenaryModel, reflected: ReflectedMasses = NONE_REFLECTED
) -> Array:
    """Constants of a pantograph, as rows of ``Part``; under a massless wire a strip can be rigid."""
    time_step = catenary.time_step
    transition, inputs = discretise(pantograph, time_step, reflected)
    rigid = 0.0 if catenary.massless else 1 / STRIP_STIFFNESS
    stiffness = pantograph.contact_stiffness
    compliance = rigid if stiffness == "rigid" else 1 / stiffness
    bearable, gain = STABILITY_MARGIN * compliance, catenary.contact_gain
    share = max(catenary.contact_share, 1.0 - bearable / gain if gain else 0.0)
    damping = pantograph.contact_damping / time_step
    scalars = [compliance, damping, share, pantograph.frame_friction, pantograph.local_spring]
    return np.concatenate([scalars, inputs.T.ravel(), transition.ravel()])


def pantographs(sizes: list[int], lanes: int) -> Pantographs:
    """Arrays for the pantographs of ``lanes`` lanes, all zero; sizes: entries of each collector's state."""
    largest = max(sizes)
    rows = Part.CONTACT_INPUT + 3 * largest + largest**2
    return Pantographs(per_collector(sizes, int, len(sizes)), aligned_zeros((len(sizes), lanes, rows)))


def matrices(pantograph: PantographData, reflected: ReflectedMasses = NONE_REFLECTED) -> tuple[Array, Array]:
    """State matrix A, (2n, 2n), and inputs [contact, frame, head pair], (2n, 3), of x' = Ax + Bf."""
    n = len(pantograph.masses)
    stiffness, damping = _chain(pantograph.stiffnesses), _chain(pantograph.dampings)
    inverse_mass: Array = np.diag(1 / np.array(pantograph.masses))
    if any(reflected):
        inverse_mass = np.linalg.inv(np.diag(pantograph.masses) + _between_ends(n, reflected))
    forces = np.zeros((n, 3))
    forces[0, 0] = -1.0
    forces[-1, 1] = 1.0
    forces[0, 2] += 1.0
    if n > 1:
        forces[1, 2] -= 1.0
    a, b = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 3))
    a[:n, n:] = np.eye(n)
    a[n:, :n], a[n:, n:], b[n:] = -inverse_mass @ stiffness, -inverse_mass @ damping, inverse_mass @ forces
    return a, b


def _chain(values: tuple[float, ...]) -> Array:
    """Matrix, (n, n), of springs or dampers between each mass and the next, the last to the ground."""
    matrix = np.diag(values).astype(float)
    for i, value in enumerate(values[:-1]):
        matrix[i + 1, i + 1] += value
        matrix[i, i + 1] = matrix[i + 1, i] = -value
    return matrix


def _between_ends(n: int, reflected: ReflectedMasses) -> Array:
    """Mass matrix, (n, n), of the reflected masses between the two ends of each ``Place``."""
    frame, head = np.zeros(n), np.zeros(n)
    frame[-1] = head[0] = 1.0
    if n > 1:
        head[1] = -1.0
    matrix: Array = reflected[0] * np.outer(frame, frame) + reflected[1] * np.outer(head, head)
    return matrix


def discretise(
    pantograph: PantographData, time_step: float, reflected: ReflectedMasses = NONE_REFLECTED
) -> tuple[Array, Array]:
    """Exact transition, (2n, 2n), and inputs, (2n, 3), for forces held over ``time_step`` (s)."""
    a, b = matrices(pantograph, reflected)
    n, m = b.shape
    augmented = np.zeros((n + m, n + m))
    augmented[:n, :n], augmented[:n, n:] = a * time_step, b * time_step
    whole = exponential(augmented)
    return whole[:n, :n].copy(), whole[:n, n:].copy()


def exponential(matrix: Array) -> Array:
    """Exp of a square matrix by scaling and squaring, with Taylor's series.

    SciPy's takes a hundred times as long for such small matrices, and even longer to import.
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
    pantographs: PantographData | Sequence[PantographData],
    nominal_forces: Array,
    wire_heights: Array,
    compliance: float,
) -> Array:
    """States, (lanes, 2n), in static equilibrium between nominal forces (N) and the wire.

    wire_heights: where the wire is without contact (m). compliance: of wire and contact spring (m/N).
    pantographs: one for all lanes, or each lane's own.
    """
    if isinstance(pantographs, PantographData):
        flexibility = _flexibility(pantographs.stiffnesses, compliance)[None]
    else:
        flexibility = np.array([_flexibility(own.stiffnesses, compliance) for own in pantographs])
    forces = nominal_forces[:, None], (wire_heights / compliance)[:, None]
    heights = flexibility[:, :, -1] * forces[0] + flexibility[:, :, 0] * forces[1]
    return np.concatenate([heights, np.zeros_like(heights)], axis=1)


def check_at_rest(pantograph: PantographData) -> None:
    """Raise InputError where a spring between two masses gives way under the static force."""
    force = np.array([pantograph.static_force])
    check_compression(pantograph.name, rest_state(pantograph, force, np.zeros(1), 1 / STRIP_STIFFNESS))


def check_compression(name: str, states: Array) -> None:
    """Raise InputError where a spring between two masses gives way in states at rest, (lanes, 2n)."""
    size = states.shape[1] // 2
    pressed = np.abs(np.diff(states[:, :size], axis=1))
    if pressed.size and pressed.max() > MOST_COMPRESSED:
        spring = int(pressed.max(axis=0).argmax())
        most = beside(float(pressed.max()), MOST_COMPRESSED, ".3g")
        raise InputError(
            f"At rest spring {spring + 1} of pantograph '{name}' would be compressed by "
            f"{most} m, more than {MOST_COMPRESSED:g} m, and no pantograph has that room: give "
            f"number {spring + 1} of its stiffnesses in N/m (10 N/mm are 10e3), and forces in N."
        )


@lru_cache(maxsize=64)
def _flexibility(stiffnesses: tuple[float, ...], compliance: float) -> Array:
    """Flexibility matrix (m/N), (n, n), of the chain with its head held by ``compliance`` (m/N)."""
    stiffness = _chain(stiffnesses)
    stiffness[0, 0] += 1 / compliance
    return np.linalg.inv(stiffness)
