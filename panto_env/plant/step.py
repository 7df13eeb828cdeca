"""The step that joins pantographs, contacts, catenary and actuators: one source for every line.

Lanes go through it in groups (``backend.columns``): ``own`` are the rows of a group's lanes, each row one
value, a number or a vector, and ``scratch`` is what the step keeps of a contact between its parts.
"""

from __future__ import annotations

from ..backend import (
    NOT_NEGATIVE,
    any_of,
    columns,
    inlined,
    kernel,
    new_columns,
    number_at,
    open_packed,
    put_number,
    rows_from,
    width_of,
)
from .actuators import drive
from .catenary.protocol import (
    advance_wire,
    apply_force,
    end_step,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)
from .contact import contact_force
from .drift import mean_stride, position_after
from .pantograph.step import PART, add_contact_force, move_freely
from .state import (
    ALL_FREE_ROWS,
    ALL_SCRATCH_ROWS,
    CONTACTS,
    MAX_STATE,
    PLACE,
    ROW,
    SAMPLE_ROWS,
    SCRATCH,
    SCRATCH_ROWS,
)
from .trigonometry import cosine_of_turns


@inlined
def irregularity(run, own, x, lane):
    """Height of the contact wire's irregularity (m) at x (m): a sum of cosines."""
    waves, height = columns(own, run.waves, lane), 0.0 * x
    for k in range(0, run.waves.shape[1], 3):
        height += waves[k] * cosine_of_turns(waves[k + 1] * x + waves[k + 2])
    return height


@inlined
def approach(line, wire, pantographs, actuators, run, contact, own, scratch, free_state, lane):
    """Begin the step of one contact's pantographs: all but the contact force."""
    drive(actuators, pantographs, contact, own, rows_from(scratch, SCRATCH.COMMAND), lane)
    move_freely(pantographs, own, free_state, lane)
    x = position_after(run, own, own[ROW.STEP] + 0.5, lane)
    scratch[SCRATCH.IRREGULARITY] = irregularity(run, own, x, lane)
    before, middle = place_contact(line, wire, lane, contact, x)
    scratch[SCRATCH.WIRE_BEFORE] = before
    scratch[SCRATCH.WIRE_MIDDLE] = middle


@inlined
def rise_along(line, wire, run, contact, own, lane):
    """How far the wire rises over the way of the step (m): what a damped contact feels."""
    x0 = position_after(run, own, own[ROW.STEP], lane)
    x1 = position_after(run, own, own[ROW.STEP] + 1.0, lane)
    way = mean_stride(run, own, 1.0, lane)
    uneven = irregularity(run, own, x1, lane) - irregularity(run, own, x0, lane)
    return uneven + rise_at_contact(line, wire, lane, contact, x0, x0 + way)


@inlined
def meet(line, wire, pantographs, run, contact, own, scratch, free_head, lane):
    """The contact force over the step, from head and wire as they would move without it.

    free_head: the head's height at the end of the step then (m).
    """
    parts = columns(own, pantographs.table, lane)
    contact_input, share = parts[PART.CONTACT_INPUT], parts[PART.IMPLICIT_SHARE]
    x = position_after(run, own, own[ROW.STEP] + 0.5, lane)
    rise = 0.0 * x
    if any_of(parts[PART.STRIP_DAMPING] > 0.0):
        rise = rise_along(line, wire, run, contact, own, lane)
    free_wire, wire_yield, early_yield, spring = look_at_contact(line, wire, lane, contact, x)
    before, irregular = scratch[SCRATCH.WIRE_BEFORE], scratch[SCRATCH.IRREGULARITY]
    head = own[ROW.STATE]
    middle = share * 0.5 * (before + free_wire) + (1.0 - share) * scratch[SCRATCH.WIRE_MIDDLE]
    middle_yield = share * 0.5 * wire_yield + (1.0 - share) * early_yield
    force = contact_force(
        parts[PART.STRIP_COMPLIANCE] + spring,
        0.5 * (head + free_head) - (middle + irregular),
        free_head - head - (free_wire - before) - rise,
        parts[PART.STRIP_DAMPING],
        middle_yield - 0.5 * contact_input,
        wire_yield - contact_input,
        run.lowest_force,
    )
    own[ROW.CONTACT_FORCE] = force
    own[ROW.HEAD_HEIGHT] = 0.5 * (head + free_head + contact_input * force)
    own[ROW.WIRE_HEIGHT] = middle + irregular + (middle_yield + spring) * force
    apply_force(line, wire, lane, contact, x, force)


@inlined
def finish(pantographs, own, free_state, lane):
    """End the step of one contact's pantographs, and complete its sample by means over the step."""
    frame, head_speed = ROW.STATE + pantographs.size // 2 - 1, ROW.STATE + pantographs.size // 2
    frame_speed = ROW.STATE + pantographs.size - 1
    frame_before, head_speed_before, frame_speed_before = own[frame], own[head_speed], own[frame_speed]
    add_contact_force(pantographs, own, free_state, lane)
    own[ROW.FRAME_HEIGHT] = 0.5 * (frame_before + own[frame])
    own[ROW.HEAD_VELOCITY] = 0.5 * (head_speed_before + own[head_speed])
    own[ROW.FRAME_VELOCITY] = 0.5 * (frame_speed_before + own[frame_speed])
    own[ROW.STEP] += 1.0


@inlined
def new_scratch(line):
    """What a step keeps between its parts: rows of ``Scratch``, and states, of all contacts."""
    return new_columns(line, ALL_SCRATCH_ROWS), new_columns(line, ALL_FREE_ROWS)


@inlined
def step_group(line, wire, pantographs, actuators, run, scratch, lane):
    """One step of the group of lanes that begins at ``lane``, under the commands in ``scratch``."""
    for c in range(CONTACTS):
        own, its = columns(line, run.table[c], lane), rows_from(scratch[0], c * SCRATCH_ROWS)
        free_state = rows_from(scratch[1], c * MAX_STATE)
        approach(line, wire, pantographs, actuators, run, c, own, its, free_state, lane)
    advance_wire(line, wire, lane)
    for c in range(CONTACTS):
        own, its = columns(line, run.table[c], lane), rows_from(scratch[0], c * SCRATCH_ROWS)
        meet(line, wire, pantographs, run, c, own, its, scratch[1][c * MAX_STATE], lane)
    end_step(line, wire, lane)
    for c in range(CONTACTS):
        own, free_state = columns(line, run.table[c], lane), rows_from(scratch[1], c * MAX_STATE)
        finish(pantographs, own, free_state, lane)


@inlined
def record_group(line, wire, run, samples, lane):
    """Write the samples of a step, the run's n-th, to row n of each lane; all to one if there is but one."""
    rows, uplift, tension = samples.rows, samples.uplift, samples.tension
    if rows.shape[1] > 1:
        for c in range(CONTACTS):
            own = columns(line, run.table[c], lane)
            for i in range(min(width_of(line), rows.shape[0] - lane)):
                n = int(number_at(own, ROW.STEP, i)) & NOT_NEGATIVE
                if n < rows.shape[1]:  # a lane at its end may go on beside others, for nothing
                    for k in range(SAMPLE_ROWS):
                        rows[(lane + i) & NOT_NEGATIVE, n, c, k] = number_at(own, k, i)
    if uplift.shape[2] > 0 or tension.shape[2] > 0:
        n = min(int(number_at(columns(line, run.table[0], lane), ROW.STEP, 0)), uplift.shape[1] - 1)
        record_wire(line, wire, lane, uplift[lane, n], tension[lane, n])


@kernel
def advance(packed, samples, command, steps, first, last):
    """Advance lanes from ``first``, the first of a group, to before ``last`` by ``steps``.

    packed: line, wire, pantographs, actuators and run. command: of the actuators (N), (lanes, contacts,
    places).
    """
    line, wire, pantographs, actuators, run = open_packed(packed)
    scratch = new_scratch(line)
    for lane in range(first, last, width_of(line)):
        for c in range(CONTACTS):
            for place in (PLACE.FRAME, PLACE.HEAD):
                for i in range(width_of(line)):
                    force = command[lane + i, c, place] if lane + i < last else 0.0
                    put_number(scratch[0], c * SCRATCH_ROWS + SCRATCH.COMMAND + place, i, force)
        for _ in range(steps):
            step_group(line, wire, pantographs, actuators, run, scratch, lane)
            record_group(line, wire, run, samples, lane)
