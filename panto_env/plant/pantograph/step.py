"""The step of a pantograph, in a kernel: its free motion, and what the contact force adds to it."""

from __future__ import annotations

from ...backend import inlined
from ..state import PLACE


@inlined
def move_freely(pantographs, variant, state, free_state, nominal_force, actuator_force, count):
    """States, (2n, count), after a step without contact force, into ``free_state``; forces in N."""
    size = pantographs.transition.shape[1]
    for r in range(size):
        frame_input, head_input = pantographs.frame_input[variant, r], pantographs.head_input[variant, r]
        a, b = pantographs.transition[variant, r, 0], pantographs.transition[variant, r, 1]
        for i in range(count):
            forced = (
                frame_input * (nominal_force[i] + actuator_force[PLACE.FRAME, i])
                + head_input * actuator_force[PLACE.HEAD, i]
            )
            free_state[r, i] = forced + (a * state[0, i] + b * state[1, i])
        for j in range(2, size, 2):  # in pairs: there are as many velocities as displacements
            a, b = pantographs.transition[variant, r, j], pantographs.transition[variant, r, j + 1]
            for i in range(count):
                free_state[r, i] += a * state[j, i] + b * state[j + 1, i]


@inlined
def add_contact_force(pantographs, variant, state, free_state, force, count):
    """End the step: the free motion and what the contact force (N) adds to it."""
    for r in range(pantographs.transition.shape[1]):
        contact_input = pantographs.contact_input[variant, r]
        for i in range(count):
            state[r, i] = free_state[r, i] + contact_input * force[i]
