"""EN 50317's low-pass of the contact force: a Butterworth filter of sixth order at 20 Hz."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError

CUTOFF = 20.0
"""Hz."""


@cache
def low_pass_sections(time_step: float) -> tuple[Array, Array]:
    """The filter as second-order sections, (3, 6), and its state settled at 1, (3, 2).

    Every caller gets the same two arrays. Raises InputError where samples, ``time_step`` (s) apart, are
    too far apart to carry 20 Hz.
    """
    from scipy.signal import butter, sosfilt_zi  # slow to import

    if not time_step < 0.5 / CUTOFF:
        raise InputError(
            f"Samples {1e3 * time_step:g} ms apart cannot be low-passed at {CUTOFF:g} Hz; "
            f"take a time step below {0.5e3 / CUTOFF:g} ms."
        )
    sections = butter(6, CUTOFF, fs=1 / time_step, output="sos")
    return sections, sosfilt_zi(sections)


def low_pass(force: Array, time_step: float) -> Array:
    """Contact force (N) as EN 50317 looks at it: low-passed causally, settled at its first value.

    Raises InputError where the samples, ``time_step`` (s) apart, are too far apart.
    """
    from scipy.signal import sosfilt  # slow to import

    sections, settled = low_pass_sections(time_step)
    filtered, _ = sosfilt(sections, force, zi=settled * force[0])
    return np.asarray(filtered)
