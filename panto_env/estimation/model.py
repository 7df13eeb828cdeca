"""What a user may choose of an estimator, and the model that it filters with."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field

from ..base.arrays import Array
from ..base.settings import Between, Settings
from ..plant.pantograph.schema import PantographData, exponential, matrices
from .force import ForceModel, ForceProcess, RandomWalk, as_force_model
from .motion import DISPLACEMENT_NOISE, VELOCITY_NOISE


class EstimatorSettings(Settings):
    """A Kalman filter of paper 2's kind: what it observes, believes of the force, and trusts of its model."""

    observation: Literal["displacements and velocities", "displacements"] = Field(
        "displacements and velocities",
        description="of collector head and articulated frame: displacements and velocities, or displacements",
    )
    force_model: Annotated[ForceModel, BeforeValidator(as_force_model)] = Field(
        default_factory=RandomWalk,
        description="what is believed of the contact force: random-walk, shaped, periodic, with values where "
        "needed, as 'shaped:wavelength=5'",
    )
    displacement_noise: Annotated[float, Between(1e-8, 0.1, "m")] = Field(
        DISPLACEMENT_NOISE, description="white noise of a sample of displacement, rms (m)"
    )
    velocity_noise: Annotated[float, Between(1e-8, 10, "m/s")] = Field(
        VELOCITY_NOISE, description="white noise of a sample of velocity, rms (m/s)"
    )
    frame_intensity: Annotated[float, Between(0, 100, "N s^0.5")] = Field(
        0.1,
        description="white force on the frame that the model leaves out, friction or wrong parameters: its "
        "impulse over a second, rms (N s^0.5)",
    )
    suspension_drift: Annotated[float, Between(0, 100, "N/s^0.5")] = Field(
        0.5,
        description="change over a second, rms, of the error of the head suspension's force, from a wrong "
        "spring or zero; 0: no such error, which is paper 2's filter (N/s^0.5)",
    )
    gain: Literal["time-varying", "steady"] = Field(
        "time-varying",
        description="time-varying, which learns from the start of a record, or steady, the limit of it",
    )
    lag: Annotated[float, Between(0, 5, "s")] = Field(
        0.0, description="how long the estimate may wait for later samples; 0: a filter (s)"
    )


PAPER2: dict[str, Any] = {"suspension_drift": 0.0}
"""Settings with which a two-mass pantograph has exactly the state of paper 2's Eq. 7."""
ESTIMATORS: dict[str, EstimatorSettings] = {
    "usual": EstimatorSettings(),
    "displacements": EstimatorSettings(observation="displacements"),
}


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
    on_suspension = settings.suspension_drift**2 * np.eye(suspension)
    noise = block_diag(np.outer(on_frame, on_frame), force.noise, on_suspension)
    known = np.zeros((total, 2))
    known[:size] = forces[:, 1:]
    transition, inputs, process_noise = _discretise(drift, known, noise, time_step)
    masses = size // 2
    seen = 2 if settings.observation == "displacements" else 4
    rows = [0, masses - 1, masses, size - 1][:seen]  # of the first and the last mass
    rms = [settings.displacement_noise] * 2 + [settings.velocity_noise] * 2
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
        measurement_noise=np.diag(np.square(rms[:seen])),
        force=np.concatenate([np.zeros(size), force.output, np.zeros(suspension)]),
        start_covariance=start,
    )


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
