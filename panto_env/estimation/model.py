"""The linear model behind an estimator: a pantograph's chain of masses, and an unknown contact force."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from ..plant.pantograph.build import exponential, matrices
from ..plant.pantograph.schema import PantographData
from .force import ForceProcess
from .settings import EstimatorSettings

START_HEIGHT, START_VELOCITY, START_SUSPENSION = 1.0, 1.0, 10.0
"""How far a state may be from its mean when a record begins, rms: m, m/s, N of the suspension's error."""


class Model(NamedTuple):
    """z(k+1) = transition z(k) + inputs u(k) + w(k), y(k) = observed z(k) + v(k), at equal steps.

    The state z, N entries: displacements of n masses, head first (m), their velocities (m/s), the states of
    the force process (N), and the error of the head suspension's force (N) where there is one. With two
    masses, a random walk and no such error z is [x_a, x_q, v_a, v_q, F_C], paper 2's Eq. 7. The input u is
    the known force on the lowest mass and that between head and the mass below, (2,) (N).
    """

    time_step: float  # s
    transition: Array  # (N, N)
    inputs: Array  # (N, 2)
    process_noise: Array  # (N, N): covariance of w
    observed: Array  # (m, N): rows of what is measured
    measurement_noise: Array  # (m, m): covariance of v
    force: Array  # (N,): the contact force is force @ z (N)
    start_covariance: Array  # (N, N): of the state when a record begins

    @property
    def linear(self) -> tuple[Array, Array, Array, Array]:
        """Transition, observed, process noise and measurement noise: all that a steady gain depends on."""
        return self.transition, self.observed, self.process_noise, self.measurement_noise

    def start(self, first: Array, lift: float) -> Array:
        """Mean of the state when a record begins, (N,): where its first sample, (m,), shows it, not moving.

        The contact force is as large as the lift (N).
        """
        state = self.observed.T @ first
        state[int(np.flatnonzero(self.force)[0])] = lift
        return np.asarray(state)


def build_model(
    pantograph: PantographData, force: ForceProcess, settings: EstimatorSettings, time_step: float
) -> Model:
    """The model of any chain of masses, discretised exactly for inputs held over ``time_step`` (s).

    The covariance of what noise adds over a step is Van Loan's integral (IEEE Trans. Automatic Control
    23:395, 1978, recalled).
    """
    from scipy.linalg import block_diag  # slow to import

    chain, forces = matrices(pantograph)  # inputs: contact, frame, head pair
    size, order = len(chain), len(force.output)
    suspension = int(settings.suspension_drift > 0)
    total = size + order + suspension
    drift = np.zeros((total, total))
    drift[:size, :size] = chain
    drift[:size, size : size + order] = np.outer(forces[:, 0], force.output)
    drift[size : size + order, size : size + order] = force.drift
    if suspension:
        drift[:size, -1] = forces[:, 2]
    on_frame = settings.frame_intensity * forces[:, 1]
    noise = block_diag(
        np.outer(on_frame, on_frame), force.noise, settings.suspension_drift**2 * np.eye(suspension)
    )
    known = np.zeros((total, 2))
    known[:size] = forces[:, 1:]
    transition, inputs, process_noise = _discretise(drift, known, noise, time_step)
    rows = _observed(size, settings)
    rms = [settings.displacement_noise] * 2 + [settings.velocity_noise] * 2
    masses = size // 2
    start = block_diag(
        START_HEIGHT**2 * np.eye(masses),
        START_VELOCITY**2 * np.eye(masses),
        force.start_covariance,
        START_SUSPENSION**2 * np.eye(suspension),
    )
    return Model(
        time_step=time_step,
        transition=transition,
        inputs=inputs,
        process_noise=process_noise,
        observed=np.eye(total)[rows],
        measurement_noise=np.diag(np.square(rms[: len(rows)])),
        force=np.concatenate([np.zeros(size), force.output, np.zeros(suspension)]),
        start_covariance=start,
    )


def _observed(size: int, settings: EstimatorSettings) -> list[int]:
    """Places in the state of what is measured: of the first and the last mass."""
    masses = size // 2
    if settings.observation == "displacements":
        return [0, masses - 1]
    return [0, masses - 1, masses, size - 1]


def _discretise(drift: Array, inputs: Array, noise: Array, step: float) -> tuple[Array, Array, Array]:
    """Transition, (N, N), inputs held over a step, (N, 2), and covariance that noise adds to it, (N, N)."""
    n, m = inputs.shape
    held = np.zeros((n + m, n + m))
    held[:n, :n], held[:n, n:] = drift, inputs
    whole = exponential(step * held)
    transition = whole[:n, :n]
    pair = np.block([[-drift, noise], [np.zeros((n, n)), drift.T]])
    covariance = transition @ exponential(step * pair)[:n, n:]
    return transition, whole[:n, n:], (covariance + covariance.T) / 2
