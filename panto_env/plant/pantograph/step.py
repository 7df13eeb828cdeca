"""The contact law between any pantograph and any catenary."""

from __future__ import annotations

from enum import IntEnum

from ...backend import constants, inlined
from ..state import PLACE, ROW, own_row


@inlined
def contact_force(compliance, gap, change, damping, gap_yield, change_yield, lowest):
    """Mean contact force over one step (N), implicit and without sub-iteration.

    ``gap`` is head height minus wire height (m, positive in contact), its mean over the step, and ``change``
    its growth over the step (m), both without this force, which reduces them by ``gap_yield`` and
    ``change_yield`` per newton (m/N). The force is the gap over the contact's ``compliance`` (m/N) plus
    ``damping`` (N s/m divided by the step, so N/m) times its change.

    ``lowest`` is 0 for a contact that can only push, -inf for papers that let it pull.
    """
    damped = compliance * damping
    force = (gap + damped * change) / (compliance + gap_yield + damped * change_yield)
    return max(force, lowest)


@inlined
def shared_forces(first, second, through_head):
    """Mean contact forces (N) of one head with two wires, neither of which pulls.

    first, second: of each wire, the numerator and the denominator of ``contact_force`` (m, m/N).
    through_head: by how much a newton on one wire takes the head from the other (m/N), as the denominators
    count it.
    """
    one, other = max(first[0] / first[1], 0.0), max(second[0] / second[1], 0.0)
    if one > 0.0 and other > 0.0:
        both = first[1] * second[1] - through_head * through_head
        with_other = (first[0] * second[1] - through_head * second[0]) / both
        with_one = (second[0] * first[1] - through_head * first[0]) / both
        if with_other < 0.0:
            one = 0.0
        elif with_one < 0.0:
            other = 0.0
        else:
            one, other = with_other, with_one
    return one, other


class Part(IntEnum):
    """Rows of the table of pantograph constants; n: entries of the state.

    The n rows with the change of the state by 1 N of contact force over a step are followed by the same for
    1 N up on the frame (the lowest mass), and for 1 N up on the head and down on the mass below it; then by
    the transition matrix of the state, exp(A dt), row by row.
    """

    STRIP_COMPLIANCE = 0  # of the contact spring (m/N)
    STRIP_DAMPING = 1  # of the damper parallel to it, divided by the time step (N/m)
    IMPLICIT_SHARE = 2  # of the wire's height in the contact law, 0 explicit, 1 implicit
    FRAME_FRICTION = 3  # maximum dry friction of the frame (N)
    LOCAL_SPRING = 4  # to the ground, about the contact wire's local height (N/m)
    ROLL_FREE = 5  # angle and rate of a rolling head after a step from both before it: 4 rows
    ROLL_INPUT = 9  # both after a step, by 1 N on the head 1 m to its right; 0 for a head that does not roll
    CONTACT_INPUT = 11  # n rows


PART = constants(Part)


@inlined
def rub(frame_input, friction, free_state, size):
    """Apply the frame's dry friction (N): as much as stops the motion, up to the maximum."""
    stopping = free_state[size - 1] / frame_input[size - 1]
    force = -min(friction, max(-friction, stopping))
    for r in range(size):
        free_state[r] = free_state[r] + frame_input[r] * force


@inlined
def free_value(size, own, parts, r, on_frame, on_head):
    """Entry ``r`` of a collector's state after a step with the contact force of the previous step."""
    state = own[ROW.STATE :]
    row = parts[PART.CONTACT_INPUT + 3 * size + r * size :]
    total = parts[PART.CONTACT_INPUT + r] * own[ROW.CONTACT_FORCE]
    total += parts[PART.CONTACT_INPUT + size + r] * on_frame
    total += parts[PART.CONTACT_INPUT + 2 * size + r] * on_head
    for j in range(size):
        total += row[j] * state[j]
    return total


@inlined
def move_apart(pantographs, collector, own, place, first, lane):
    """Distance (m) or relative speed (m/s) of the two ends of an actuator, over a step without its force.

    first: 0 for the distance, or half the entries of the state for the speed. Returns the value at the step's
    start; the value at its end, with the contact force of the previous step; and the change at the end by
    1 N of the actuator, held over the step.
    """
    size = pantographs.sizes[collector]
    parts = pantographs.table[collector, own_row(pantographs.table[collector], lane)]
    on_frame, on_head = own[ROW.LIFT] + own[ROW.WIND] + own[ROW.BY_HEIGHT], 0.0
    upper, inputs = first, PART.CONTACT_INPUT + 2 * size
    if place == PLACE.FRAME:
        upper, inputs = first + size // 2 - 1, PART.CONTACT_INPUT + size
        on_head += own[ROW.HEAD_FORCE]
    else:
        on_frame += own[ROW.FRAME_FORCE]
    now, free = own[ROW.STATE + upper], free_value(size, own, parts, upper, on_frame, on_head)
    gain = parts[inputs + upper]
    if place == PLACE.HEAD and size > 2:
        now = now - own[ROW.STATE + upper + 1]
        free = free - free_value(size, own, parts, upper + 1, on_frame, on_head)
        gain = gain - parts[inputs + upper + 1]
    return now, free, gain


@inlined
def move_freely(pantographs, collector, own, lane):
    """Write the state of a lane's pantograph after a step without contact force behind its present state."""
    size = pantographs.sizes[collector]
    parts = pantographs.table[collector, own_row(pantographs.table[collector], lane)]
    frame_input = parts[PART.CONTACT_INPUT + size :]
    head_input = parts[PART.CONTACT_INPUT + 2 * size :]
    transition, state = parts[PART.CONTACT_INPUT + 3 * size :], own[ROW.STATE :]
    on_frame = (own[ROW.LIFT] + own[ROW.WIND] + own[ROW.BY_HEIGHT]) + own[ROW.FRAME_FORCE]
    on_head = own[ROW.HEAD_FORCE]
    free_state = own[ROW.STATE + size :]
    for r in range(0, size, 2):  # in pairs, which a processor computes side by side
        total = frame_input[r] * on_frame + head_input[r] * on_head
        other = frame_input[r + 1] * on_frame + head_input[r + 1] * on_head
        first, second = transition[r * size :], transition[(r + 1) * size :]
        for j in range(size):
            total += first[j] * state[j]
            other += second[j] * state[j]
        free_state[r] = total
        free_state[r + 1] = other
    if parts[PART.FRAME_FRICTION] > 0.0:
        rub(frame_input, parts[PART.FRAME_FRICTION], free_state, size)


@inlined
def roll_freely(parts, own):
    """Angle (rad) and rate (rad/s) of a rolling head after a step without contact force."""
    angle, rate = own[own.size - 2], own[own.size - 1]
    free = PART.ROLL_FREE
    return parts[free] * angle + parts[free + 1] * rate, parts[free + 2] * angle + parts[free + 3] * rate


@inlined
def add_contact_force(pantographs, collector, own, lane):
    """End the step: add the effect of the contact force to the free motion."""
    parts = pantographs.table[collector, own_row(pantographs.table[collector], lane)]
    state, force = own[ROW.STATE :], own[ROW.CONTACT_FORCE]
    size, contact_input = pantographs.sizes[collector], parts[PART.CONTACT_INPUT :]
    free_state = own[ROW.STATE + size :]
    for r in range(size):
        state[r] = free_state[r] + contact_input[r] * force
