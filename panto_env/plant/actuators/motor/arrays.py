"""Arrays of the motors: their constants and the state of all lanes."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ....backend import constants
from ....base.arrays import Array, Index, Lanes
from ...state import Place


class MotorRow(IntEnum):
    """Rows of the table, for each place."""

    FORCE = 0  # e = K i at the step's end (N)
    HEAT = 1  # mean square of e over the winding's time constant (N^2)
    SUPPLIED = 2  # net energy from the supply since the start (J)
    COPPER = 3  # energy lost in the armatures since the start (J)
    GAP = 4  # of loose rotors ahead of the ends, from the middle of the play (m)
    SPEED = 5  # of loose rotors (m/s)


MOTOR_ROW = constants(MotorRow)
MOTOR_ROWS = len(MotorRow)


class MotorArrays(NamedTuple):
    """Motors of all lanes, reflected to the point where they act."""

    table: Array  # (collectors, lanes, places of ``MotorRow``)
    places: Index  # (used,): where there are motors, each a ``Place``
    time_step: float  # s
    command_limit: float  # maximum force that is requested (N)
    peak_force: float  # N
    continuous_force: float  # N
    heat_share: float  # weight of the present square of the force in HEAT, per step
    largest_speed: float  # maximum speed (m/s)
    stall_force: float  # N
    shorted_damping: float  # N s/m
    armature_time: float  # L / R (s)
    armature_left: float  # share of a deviation that remains after a step at constant voltage
    armature_mean: float  # mean of that share over the step
    bandwidth: float  # of the current loop (1/s)
    lead: float  # bandwidth * armature_time
    decay_halvings: int
    age_halvings: int
    dry_friction: float  # N
    lost_share: float  # of the load on the teeth that is friction
    mass: float  # of rotors and gears (kg)
    play: float  # from flank to flank (m), 0 for teeth that are never loose
    tooth_compliance: float  # m/N
    tooth_damping: float  # N s/m divided by the step, so N/m

    def energy(self, lanes: Lanes, collector: int = 0) -> Array:
        """Energy from the supply since the start and, of it, losses in the armatures (J), (..., places, 2).

        lanes: a number, or (n,). Energy that driven motors give back is subtracted from the supply's.
        """
        rows = self.table[collector, lanes]
        rows = rows.reshape(*rows.shape[:-1], len(Place), MOTOR_ROWS)
        return np.array(rows[..., [MotorRow.SUPPLIED, MotorRow.COPPER]])
