"""The gearbox between armature and arm: friction, and backlash of the teeth."""

from __future__ import annotations

from ....backend import inlined
from ...contact import contact_force
from .current import clip


@inlined
def friction(motors, load, stopping):
    """Dry friction (N) of motors and gears.

    stopping: force that would bring the motion to rest in this step (N); where the friction can provide it,
    the gear sticks. Part of the friction is proportional to the load on the teeth (N): a driving motor passes
    on its torque times the efficiency, and a load that drives the motor has the same loss to overcome.
    """
    maximum = motors.dry_friction + motors.lost_share * abs(load)
    return clip(stopping, -maximum, maximum)


@inlined
def tooth_force(motors, gap, way, gain):
    """Mean force of the teeth over a step (N): a spring and a damper at either end of the play.

    gap: lead of the rotors over the ends, from the middle of the play, at the step's start (m). way: its
    growth over the step without this force (m), which 1 N reduces by ``gain`` (m/N).
    """
    compliance, damping, half = motors.tooth_compliance, motors.tooth_damping, 0.5 * motors.play
    middle = gap + 0.5 * way
    up = contact_force(compliance, middle - half, way, damping, 0.5 * gain, gain, 0.0)
    down = contact_force(compliance, -middle - half, -way, damping, 0.5 * gain, gain, 0.0)
    return up - down
