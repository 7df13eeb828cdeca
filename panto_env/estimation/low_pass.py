"""A causal low-pass of second order, for estimates that are too noisy without one."""

from __future__ import annotations

from ..base.arrays import Array
from ..base.errors import InputError

CUTOFF = 60.0
"""Hz. Own choice: about the least error at all frequencies at 150 to 350 km/h (80 Hz where velocities are
measured, 50 Hz else); it delays by 3.8 ms.
"""


def low_pass(values: Array, cutoff: float, time_step: float) -> Array:
    """Butterworth's of second order at ``cutoff`` (Hz), settled at the first of the values, (n,).

    Raises InputError where the samples are too far apart to carry the cut-off frequency.
    """
    from scipy.signal import butter, sosfilt, sosfilt_zi  # slow to import

    if not cutoff < 0.5 / time_step:
        raise InputError(
            f"Samples {1e3 * time_step:g} ms apart cannot be low-passed at {cutoff:g} Hz; record more "
            "often, or take a lower cut-off frequency."
        )
    sections = butter(2, cutoff, fs=1 / time_step, output="sos")
    filtered, _ = sosfilt(sections, values, zi=sosfilt_zi(sections) * values[0])
    return filtered  # type: ignore[no-any-return]
