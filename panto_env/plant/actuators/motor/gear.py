"""What lies between armature and arm: friction, and teeth that may be loose."""

from __future__ import annotations

from ....backend import inlined
from ...contact import contact_force
from .current import clip


@inlined
def friction(motors, load, stopping):
    """Friction (N) of motors and gears against a force that would bring their motion to rest in this step.

    Dry, of the shaft and of a share of the load on the teeth, so that a motor that drives passes on the
    efficiency's share of its torque, and a load that drives it has as much more to overcome. It sticks where
    it is larger than what would stop the motion.
    """
    most = motors.dry_friction + motors.lost_share * abs(load)
    return clip(stopping, -most, most)


@inlined
def tooth_force(motors, gap, way, gain):
    """Mean force of the teeth over a step (N): of a spring and a damper beyond either end of the play.

    gap: of the rotors ahead of the ends, from the middle of the play, at the step's start; way: by which it
    would grow in the step without this force, of which 1 N takes ``gain`` (m, m, m/N).
    """
    compliance, damping, half = motors.tooth_compliance, motors.tooth_damping, 0.5 * motors.play
    middle = gap + 0.5 * way
    up = contact_force(compliance, middle - half, way, damping, 0.5 * gain, gain, 0.0)
    down = contact_force(compliance, -middle - half, -way, damping, 0.5 * gain, gain, 0.0)
    return up - down
