"""The step of a pantograph, in a kernel: its free motion, and what the contact force adds to it."""

from __future__ import annotations

from enum import IntEnum

from ...backend import any_of, columns, constants, inlined, larger, rows_from, smaller
from ..state import ROW


class Part(IntEnum):
    """Rows of the table of what pantographs are made of; n: entries of the state.

    Behind the change of the state by 1 N of contact force over a step, n rows, come those by 1 N up on the
    frame (the lowest mass) and by 1 N up on the head and down on the mass below it; then the transition of
    the state exp(A dt), row by row.
    """

    STRIP_COMPLIANCE = 0  # of the contact spring (m/N)
    STRIP_DAMPING = 1  # of the damper beside it, divided by the time step (N/m)
    IMPLICIT_SHARE = 2  # of the wire's height in the contact law, 0 explicit, 1 implicit
    FRAME_FRICTION = 3  # largest dry friction of the frame (N)
    CONTACT_INPUT = 4  # n rows


PART = constants(Part)


@inlined
def rub(frame_input, friction, free_state, size):
    """Hold the frame by dry friction (N): at rest by as much as that takes, in motion by all of it."""
    stopping = free_state[size - 1] / frame_input[size - 1]
    force = -smaller(larger(stopping, -friction), friction)
    for r in range(size):
        free_state[r] = free_state[r] + frame_input[r] * force


@inlined
def move_freely(pantographs, own, free_state, lane):
    """State of a group after a step without contact force, into ``free_state``."""
    size, parts = pantographs.size, columns(own, pantographs.table, lane)
    frame_input = rows_from(parts, PART.CONTACT_INPUT + size)
    head_input = rows_from(parts, PART.CONTACT_INPUT + 2 * size)
    transition, state = rows_from(parts, PART.CONTACT_INPUT + 3 * size), rows_from(own, ROW.STATE)
    on_frame, on_head = own[ROW.NOMINAL_FORCE] + own[ROW.FRAME_FORCE], own[ROW.HEAD_FORCE]
    for r in range(0, size, 2):  # in pairs, that a processor has more to do at once
        total = frame_input[r] * on_frame + head_input[r] * on_head
        other = frame_input[r + 1] * on_frame + head_input[r + 1] * on_head
        first, second = rows_from(transition, r * size), rows_from(transition, (r + 1) * size)
        for j in range(size):
            total += first[j] * state[j]
            other += second[j] * state[j]
        free_state[r] = total
        free_state[r + 1] = other
    if any_of(parts[PART.FRAME_FRICTION] > 0.0):
        rub(frame_input, parts[PART.FRAME_FRICTION], free_state, size)


@inlined
def add_contact_force(pantographs, own, free_state, lane):
    """End the step: the free motion and what the contact force adds to it."""
    contact_input = rows_from(columns(own, pantographs.table, lane), PART.CONTACT_INPUT)
    state, force = rows_from(own, ROW.STATE), own[ROW.CONTACT_FORCE]
    for r in range(pantographs.size):
        state[r] = free_state[r] + contact_input[r] * force
