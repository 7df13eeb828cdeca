"""Servomotors that press through a gearbox and an arm (paper 2, section 4.3).

Paper 2 turns the arms of the collector head by armature-controlled DC motors with gearboxes, inside the
joints between pan-head and arms, driven in force mode. ``schema`` says what such a drive is made of,
``current`` solves the armature and its current loop, ``gear`` is friction, inertia and backlash, ``step``
joins them in the plant's step, ``power`` gives current, voltage and watts.

All motors of a place are alike and count as one. Kernels see them from where they press: a force e = K i (N)
by the current i of each motor, with K = motors * ratio / arm * torque constant, and a speed w (m/s) at which
the two ends move apart, the shaft turning by ratio / arm * w.

The rotors turn with the head: their inertia J (ratio / arm)^2 is a mass m between the two ends. As a force,
-m times the acceleration of the step before, it would make speeds grow by m / M in each step, M being the
mass of the ends (M dw = -m dw of the step before), at any time step: unstable from m = M on. So it is a mass
of the chain, in the pantograph's own equations, which are solved exactly
(``ActuatorSettings.reflected_masses``). With backlash the rotors are loose at times; they then have a speed
of their own, and the flanks of the teeth push by the plant's contact law, implicit in what both sides yield.
"""

from . import step as step
from .schema import MotorActuator

__all__ = ["KIND", "MotorActuator"]

KIND = MotorActuator
