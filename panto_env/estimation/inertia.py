"""The contact force without any filter's model: what the head's suspension carries, less the head's inertia.

This is how a load cell below the strips is corrected, with the suspension as the load cell.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.low_pass import low_pass
from ..plant.pantograph.schema import PantographData
from .motion import Motion

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
