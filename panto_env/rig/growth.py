"""Stability of the rig's loop by simulation: whether a small disturbance grows.

Two runs differ by a load cell's noise of 1e-5 N alone; the contact may pull and the limits of cylinder and
load cell are far away, so that the loop is linear but for slack droppers. Where their difference has grown
far beyond the noise, the loop is not stable, whatever losses of contact and limits would make of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..analysis.simulation import simulate
from ..base.errors import InputError
from ..plant.catenary.rig import RigData
from ..plant.pantograph.schema import PantographData
from .margins import SLOWEST, threshold

NOISE = 1e-5
"""Of the load cell (N)."""
PART = (0.7, 0.95)
"""Of a run, as shares, in which the difference is looked at."""
AMPLIFIED = 100.0
"""Difference over noise beyond which it has grown: a stable loop makes it three to ten times as large."""
WIDE: dict[str, dict[str, Any]] = {
    "cylinder": {"displacement_noise": 0.0, "speed_limit": 20.0, "stroke": 2.0},
    "load_cell": {"noise": NOISE, "force_range": 1e5},
    "computer": {"input_bits": 32, "output_bits": 32},
}


def with_values(rig: RigData, tables: dict[str, dict[str, Any]]) -> RigData:
    """A rig with other values in its tables."""
    changed = {name: getattr(rig, name).model_copy(update=values) for name, values in tables.items()}
    return rig.model_copy(update=changed)


def is_stable(rig: RigData, pantograph: PantographData, speed_kmh: float) -> bool:
    """Whether a small disturbance of the loop does not grow."""
    wide, forces = with_values(rig, WIDE), []
    for seed in (0, 1):
        one = with_values(wide, {"computer": {"seed": seed}})
        try:
            run = simulate(one, pantograph, speed_kmh, bilateral=True, precision="double")
        except InputError:  # it diverged
            return False
        if run.terminated:
            return False
        forces.append(run.contact_force)
    begin, end = (int(share * len(forces[0])) for share in PART)
    return bool(np.std((forces[0] - forces[1])[begin:end]) < AMPLIFIED * NOISE)


def bearable_delay(rig: RigData, pantograph: PantographData, speed_kmh: float, most: float) -> float:
    """Delay (s) on top of its own, not compensated for, that the rig bears; looked for up to ``most``."""
    own = rig.computer.delay if rig.computer.assumed_delay is None else rig.computer.assumed_delay

    def stable(extra: float) -> bool:
        delay = {"delay": rig.computer.delay + extra, "assumed_delay": own}
        return is_stable(with_values(rig, {"computer": delay}), pantograph, speed_kmh)

    return threshold(stable, most, 0.0, share=0.02)


def slowest_cylinder(rig: RigData, pantograph: PantographData, speed_kmh: float) -> float:
    """Natural frequency (Hz) of the cylinder below which the rig is not stable, if it is compensated for as
    one of the rig's own frequency.
    """
    own = rig.cylinder.natural_frequency

    def stable(natural_frequency: float) -> bool:
        tables = {
            "cylinder": {"natural_frequency": natural_frequency},
            "computer": {"assumed_frequency": rig.computer.assumed_frequency or own},
        }
        return is_stable(with_values(rig, tables), pantograph, speed_kmh)

    return threshold(stable, SLOWEST * own, own, share=0.02)
