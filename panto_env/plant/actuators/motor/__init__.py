"""Servomotors that act through a gearbox and an arm (paper 2, section 4.3).

Paper 2 turns the arms of the collector head by armature-controlled DC motors with gearboxes, inside the
joints between pan-head and arms, driven in force mode. ``schema`` defines the data of such a drive, ``step``
has its armature, current loop, friction, inertia and backlash.

All motors of a place are alike and count as one. Kernels see them at the point where they act: a force
e = K i (N) by the current i of each motor, with K = motors * ratio / arm * torque constant, and a speed w
(m/s) at which the two ends move apart; the shaft turns at ratio / arm * w.

The rotors turn with the head: their inertia J (ratio / arm)^2 is a mass m between the two ends. As a force,
-m times the acceleration of the previous step, it would multiply speeds by m / M in each step, where M is
the mass of the ends (M dw = -m dw of the previous step): unstable from m = M on, at any time step. So it is
a mass of the chain, in the pantograph's own equations, which are solved exactly
(``ActuatorSettings.reflected_masses``). With backlash the rotors are loose at times; they then have a speed
of their own, and the tooth flanks touch under the plant's contact law, implicit in the motion of both sides.
"""

from . import step as step
from .schema import MotorActuator

__all__ = ["KIND", "MotorActuator"]

KIND = MotorActuator
