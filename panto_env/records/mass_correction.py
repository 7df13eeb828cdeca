"""Contact force from the force sensors below the strips: EN 50317's correction by the strips' inertia.

The standard was not at hand; as recalled, it has the contact force as the sum of the sensors' forces, the
inertia of the mass between sensors and contact, and an aerodynamic part, which is left to the user here.

    contact wire      F_c down on the strips
    ===========
      strips, m       m a = F_s - F_c - m g,  a: upward acceleration
    ===========
    force sensors     F_s up on the strips

The sensors are set to zero under the strips at rest, so that F_s does not hold m g. What remains is
F_c = F_s - m a: where the strips accelerate upwards, part of the sensors' force does so, and the wire feels
less. With accelerations that are positive downwards it would be F_s + m a.

Force and acceleration are corrected before any filter: the sum goes through EN 50317's low-pass as a whole,
so both parts have the same delay. What is recorded must not have been filtered differently before.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .columns import NUMBERS

HEAVIEST = 50.0
"""Maximum mass of strips (kg): far beyond any collector head's."""


def contact_force(values: Mapping[str, Array], mass: float | None) -> tuple[Array, list[str]]:
    """Contact force (N), (n,), of a record's columns in SI units, and notes on how it was made.

    mass: between sensors and contact (kg), shared equally among the accelerometers; None: no correction. Of
    each accelerometer the mean is left out, which over a run is gravity and the sensor's offset. A sample
    that any sensor lacks is nan. Raises InputError for no force, for two kinds of it, for a mass that no
    strips have, and for one without accelerations.
    """
    force = _measured(values)
    seen = [values[f"acceleration_{k}"] for k in NUMBERS if f"acceleration_{k}" in values]
    if mass is None:
        without = "Accelerations were recorded, but no mass is given: the strips' inertia is not corrected."
        return force, [without] if seen else []
    if not 0 < mass <= HEAVIEST:
        raise InputError(f"The mass of the strips must lie above 0 and up to {HEAVIEST:g} kg, not {mass:g}.")
    if not seen:
        raise InputError(
            "A mass is given, but the record has no accelerations; name their columns acceleration_1 (m/s2), "
            "acceleration_2 and so on, or leave the mass out."
        )
    upward = sum(each - _mean(each) for each in seen) / len(seen)
    sensors = "1 accelerometer" if len(seen) == 1 else f"{len(seen)} accelerometers"
    note = f"The force is corrected for the inertia of {mass:g} kg above the sensors, by {sensors}."
    return np.asarray(force - mass * upward), [note]


def _measured(values: Mapping[str, Array]) -> Array:
    strips = [values[f"force_{k}"] for k in NUMBERS if f"force_{k}" in values]
    if "force" in values and strips:
        raise InputError(
            "The record has both force and force_1; keep the whole force, or those of the strips."
        )
    if "force" in values:
        return values["force"]
    if not strips:
        raise InputError(
            "The record has no contact force; name the column force (N), or those of the strips force_1 (N), "
            "force_2 (N) and so on."
        )
    return np.asarray(np.sum(strips, axis=0))


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else 0.0
