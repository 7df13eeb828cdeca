"""The contact force without a belief about it: inertia-corrected, or a minimum-variance unbiased input.

The first is what the head's suspension carries less the head's inertia, as a load cell below the strips is
corrected. The second is S. Gillijns and B. De Moor's filter (Automatica 43:111, 2007, recalled): the force
over the step before each sample is what least squares needs to explain it.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.low_pass import low_pass
from ..plant.pantograph.schema import PantographData
from .estimate import model_of
from .force import RandomWalk
from .kalman import CONVERGED, corrected, correction
from .model import EstimatorSettings, Model
from .motion import Motion, check_motion

CUTOFF, ORDER = 60.0, 2
"""Of a causal Butterworth low-pass, for estimates that are too noisy without one. The cut-off frequency (Hz)
is own choice: about the minimum error over all frequencies at 150 to 350 km/h (80 Hz where velocities are
measured, 50 Hz else). It delays by 3.8 ms.
"""


def inertia_corrected(
    motion: Motion, pantograph: PantographData, *, velocities: bool = True, cutoff: float = CUTOFF
) -> Array:
    """Contact force (N), (n,): k (x_q - x_a) + c (v_q - v_a) + head force - m_a a, low-passed.

    cutoff: of the low-pass (Hz). velocities: whether they are measured; else they are displacements
    differentiated. The acceleration is the velocity of the head differentiated. Differences look back only,
    so that the estimate is causal. Raises InputError for a pantograph of other than two masses, whose
    suspension is not between head and frame.
    """
    if len(pantograph.masses) != 2:
        raise InputError(
            f"Pantograph '{pantograph.name}' has {len(pantograph.masses)} masses; inertia-corrected "
            "measurement needs two, since the motion of those between head and frame is not measured; take "
            "a Kalman filter."
        )
    if velocities and motion.head_velocity is not None and motion.frame_velocity is not None:
        head, frame = motion.head_velocity, motion.frame_velocity
    elif velocities:
        raise InputError("The motion has no velocities; take velocities=False.")
    else:
        head, frame = (_difference(height, motion.time_step) for height in (motion.head, motion.frame))
    carried = pantograph.stiffnesses[0] * (motion.frame - motion.head)
    carried += pantograph.dampings[0] * (frame - head) + motion.head_force
    force = carried - pantograph.masses[0] * _difference(head, motion.time_step)
    return low_pass(force, motion.time_step, cutoff, ORDER)


def _difference(values: Array, time_step: float) -> Array:
    """Rate of change since the sample before, (n,); 0 at the first."""
    return np.diff(values, prepend=values[:1]) / time_step


_HELD = RandomWalk(intensity=0.01)  # hardly moves: what the force does over a step is no noise of the state


def unknown_input(
    motion: Motion,
    pantograph: PantographData,
    settings: EstimatorSettings | None = None,
    *,
    cutoff: float | None = CUTOFF,
) -> Array:
    """Contact force (N), (n,), low-passed at ``cutoff`` (Hz), or raw where that is None.

    settings: whose force model is not used. Raises InputError as ``estimate`` does.
    """
    check_motion(motion, pantograph)
    held = (settings or EstimatorSettings()).model_copy(update={"force_model": _HELD})
    system, contact = _system(model_of(motion, pantograph, held))
    measured, known = motion.measured(len(system.observed)), motion.inputs @ system.inputs.T
    state, covariance = system.observed.T @ measured[0], system.start_covariance
    converged = False
    raw = np.empty(len(measured))
    for k, sample in enumerate(measured):
        if not converged:
            gain, of_force, after = _gain(system, contact, covariance)
            following = system.transition @ after @ system.transition.T + system.process_noise
            converged = bool(np.abs(following - covariance).max() <= CONVERGED * np.abs(covariance).max())
            covariance = following
        innovation = sample - system.observed @ state
        raw[k] = of_force @ innovation
        state = system.transition @ (state + gain @ innovation) + known[k]
    raw[0] = motion.lift  # of the step before the first sample nothing is known
    return raw if cutoff is None else low_pass(raw, motion.time_step, cutoff, ORDER)


def _system(model: Model) -> tuple[Model, Array]:
    """The model whose contact force is no state, but held over a step, and unknown; and what 1 N changes.

    The latter is the change of the state, (N,).
    """
    states, force = np.flatnonzero(model.force == 0), np.flatnonzero(model.force)
    square = np.ix_(states, states)
    system = model._replace(
        transition=model.transition[square],
        inputs=model.inputs[states],
        process_noise=model.process_noise[square],
        observed=model.observed[:, states],
        force=model.force[states],
        start_covariance=model.start_covariance[square],
    )
    return system, model.transition[states, force]


def _gain(system: Model, contact: Array, covariance: Array) -> tuple[Array, Array, Array]:
    """Gains of state, (N, m), and force, (m,); covariance of the corrected state, by the predicted one's."""
    observed = system.observed
    known, innovation = correction(covariance, observed, system.measurement_noise)
    through = observed @ contact
    weight = np.linalg.solve(innovation, through)
    force = weight / (through @ weight)
    gain = known + np.outer(contact - known @ through, force)
    return gain, force, corrected(covariance, gain, observed, system.measurement_noise)
