"""The step that joins pantographs, contacts, catenary and actuators: one kernel for every line.

Lanes go through it in blocks of lanes that go abreast (``LANES_ABREAST``): a kernel copies some columns of
the table to a block on its stack, steps the block, and copies it back.
"""

from __future__ import annotations

from ..backend import NOT_NEGATIVE, inlined, kernel, new_blocks, open_packed
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
from .pantograph.step import add_contact_force, move_freely
from .state import BLOCK_ROWS, CONTACTS, PLACE, ROW, SAMPLE_ROWS
from .trigonometry import cosine_of_turns


@inlined
def load(table, block, first, begin, count):
    """Copy rows from ``first`` on of ``count`` lanes from ``begin`` on to a block."""
    for r in range(first, table.shape[0]):
        lanes = table[r, begin : begin + count]  # begin + i might be negative, for all that Numba knows
        for i in range(count):
            block[r, i] = lanes[i]


@inlined
def store(block, table, begin, count):
    """Copy a block's rows back."""
    for r in range(table.shape[0]):
        lanes = table[r, begin : begin + count]
        for i in range(count):
            lanes[i] = block[r, i]


@inlined
def irregularity(waves, block, ahead, out, begin, count):
    """Height of the contact wire's irregularity (m), a sum of cosines, ``ahead`` strides on; into ``out``."""
    for i in range(count):
        out[i] = 0.0
    for k in range(waves.shape[0]):
        wave = waves[k, :, begin : begin + count]
        for i in range(count):
            turns = wave[1, i] * (block[ROW.STRIDE, i] * (block[ROW.STEP, i] + ahead)) + wave[2, i]
            out[i] += wave[0, i] * cosine_of_turns(turns)


@inlined
def approach(line, wire, pantographs, actuators, run, contact, block, begin, count):
    """Begin the step of one contact's pantographs: all but the contact force."""
    force = block[ROW.ACTUATOR_FORCE :]
    drive(actuators, contact, force, block[ROW.COMMAND :], block[ROW.ARRIVING_COMMAND], begin, count)
    state, free_state = block[ROW.STATE :], block[ROW.FREE_STATE :]
    variant = pantographs.variant[begin]
    move_freely(pantographs, variant, state, free_state, block[ROW.NOMINAL_FORCE], force, count)
    irregularity(run.waves, block, 0.5, block[ROW.IRREGULARITY], begin, count)
    for i in range(count):
        x = block[ROW.STRIDE, i] * (block[ROW.STEP, i] + 0.5)
        before, middle = place_contact(line, wire, (begin + i) & NOT_NEGATIVE, contact, x)
        block[ROW.WIRE_BEFORE, i], block[ROW.WIRE_MIDDLE, i] = before, middle


@inlined
def look_along(line, wire, run, contact, block, begin, count):
    """How far the wire rises, or falls, over the way of the step: what a damped contact feels."""
    irregularity(run.waves, block, 1.0, block[ROW.RISE], begin, count)
    irregularity(run.waves, block, 0.0, block[ROW.HEAD_HEIGHT], begin, count)
    for i in range(count):
        x0 = block[ROW.STRIDE, i] * block[ROW.STEP, i]
        rise = rise_at_contact(line, wire, (begin + i) & NOT_NEGATIVE, contact, x0, x0 + block[ROW.STRIDE, i])
        block[ROW.RISE, i] += rise - block[ROW.HEAD_HEIGHT, i]


@inlined
def meet(line, wire, pantographs, run, contact, block, begin, count):
    """The contact force over the step, from head and wire as they would move without it."""
    variant = pantographs.variant[begin]
    contact_input = pantographs.contact_input[variant, 0]
    strip, damping = pantographs.strip_compliance[variant], pantographs.strip_damping[variant]
    if damping > 0.0:
        look_along(line, wire, run, contact, block, begin, count)
    else:
        for i in range(count):
            block[ROW.RISE, i] = 0.0
    share = pantographs.implicit_share[variant]
    for i in range(count):
        lane = (begin + i) & NOT_NEGATIVE
        x = block[ROW.STRIDE, i] * (block[ROW.STEP, i] + 0.5)
        free_wire, wire_yield, early_yield, spring = look_at_contact(line, wire, lane, contact, x)
        before, irregular = block[ROW.WIRE_BEFORE, i], block[ROW.IRREGULARITY, i]
        head, free_head = block[ROW.STATE, i], block[ROW.FREE_STATE, i]
        middle = share * 0.5 * (before + free_wire) + (1.0 - share) * block[ROW.WIRE_MIDDLE, i]
        middle_yield = share * 0.5 * wire_yield + (1.0 - share) * early_yield
        force = contact_force(
            1.0 / (strip + spring),
            0.5 * (head + free_head) - (middle + irregular),
            free_head - head - (free_wire - before) - block[ROW.RISE, i],
            damping,
            middle_yield - 0.5 * contact_input,
            wire_yield - contact_input,
            run.lowest_force,
        )
        mean_head = 0.5 * (head + free_head + contact_input * force)
        block[ROW.FORCE, i] = force
        block[ROW.CONTACT_FORCE, i] = force
        block[ROW.HEAD_HEIGHT, i] = mean_head
        block[ROW.WIRE_HEIGHT, i] = middle + irregular + (middle_yield + spring) * force
        apply_force(line, wire, lane, contact, x, force)


@inlined
def finish(pantographs, block, begin, count):
    """End the step of one contact's pantographs, and complete its sample."""
    size = pantographs.transition.shape[1]
    frame, head_velocity = ROW.STATE + size // 2 - 1, ROW.STATE + size // 2
    frame_velocity = ROW.STATE + size - 1
    for i in range(count):
        block[ROW.FRAME_HEIGHT, i] = block[frame, i]
        block[ROW.HEAD_VELOCITY, i] = block[head_velocity, i]
        block[ROW.FRAME_VELOCITY, i] = block[frame_velocity, i]
    state, free_state = block[ROW.STATE :], block[ROW.FREE_STATE :]
    add_contact_force(pantographs, pantographs.variant[begin], state, free_state, block[ROW.FORCE], count)
    for i in range(count):
        block[ROW.FRAME_HEIGHT, i] = 0.5 * (block[ROW.FRAME_HEIGHT, i] + block[frame, i])
        block[ROW.HEAD_VELOCITY, i] = 0.5 * (block[ROW.HEAD_VELOCITY, i] + block[head_velocity, i])
        block[ROW.FRAME_VELOCITY, i] = 0.5 * (block[ROW.FRAME_VELOCITY, i] + block[frame_velocity, i])
        block[ROW.FRAME_FORCE, i] = block[ROW.ACTUATOR_FORCE + PLACE.FRAME, i]
        block[ROW.HEAD_FORCE, i] = block[ROW.ACTUATOR_FORCE + PLACE.HEAD, i]
        block[ROW.STEP, i] += 1.0


@inlined
def step_blocks(line, wire, pantographs, actuators, run, blocks, begin, count):
    """One step of the lanes in the blocks, one per contact, under the commands in them; its samples.

    All the lanes have pantographs of one variant.
    """
    for c in range(blocks.shape[0]):
        approach(line, wire, pantographs, actuators, run, c, blocks[c], begin, count)
    for i in range(count):
        advance_wire(line, wire, begin + i)
    for c in range(blocks.shape[0]):
        meet(line, wire, pantographs, run, c, blocks[c], begin, count)
    for i in range(count):
        end_step(line, wire, begin + i)
    for c in range(blocks.shape[0]):
        finish(pantographs, blocks[c], begin, count)


@inlined
def record_blocks(line, wire, samples, blocks, begin, count):
    """Write the samples of a step, the run's n-th, to row n of each lane, or to the last there is."""
    rows, uplift, tension = samples.rows, samples.uplift, samples.tension
    if rows.shape[1] > 1:
        for c in range(blocks.shape[0]):
            for i in range(count):
                row = rows[(begin + i) & NOT_NEGATIVE, int(blocks[c, ROW.STEP, i]) & NOT_NEGATIVE, c]
                for k in range(SAMPLE_ROWS):
                    row[k] = blocks[c, k, i]
    if uplift.shape[2] > 0 or tension.shape[2] > 0:
        for i in range(count):
            n = min(int(blocks[0, ROW.STEP, i]), uplift.shape[1] - 1)
            record_wire(line, wire, begin + i, uplift[begin + i, n], tension[begin + i, n])


@inlined
def lanes_of_one_variant(pantographs, begin, limit):
    """How many lanes from ``begin`` on, up to a limit, have pantographs of the same variant."""
    count = 1
    while count < limit and pantographs.variant[begin + count] == pantographs.variant[begin]:
        count += 1
    return count


@kernel
def advance(packed, samples, command, steps, first, last):
    """Advance lanes from ``first`` to before ``last`` by ``steps``.

    packed: line, wire, pantographs, actuators and run. command: of the actuators (N), (lanes, contacts,
    places).
    """
    line, wire, pantographs, actuators, run = open_packed(packed)
    blocks = new_blocks(line, CONTACTS, BLOCK_ROWS)
    begin = first
    while begin < last:
        count = lanes_of_one_variant(pantographs, begin, min(blocks.shape[2], last - begin))
        for c in range(blocks.shape[0]):
            load(run.table[c], blocks[c], ROW.STEP, begin, count)
            for place in range(command.shape[2]):
                for i in range(count):
                    blocks[c, ROW.COMMAND + place, i] = command[begin + i, c, place]
        for _ in range(steps):
            step_blocks(line, wire, pantographs, actuators, run, blocks, begin, count)
            record_blocks(line, wire, samples, blocks, begin, count)
        for c in range(blocks.shape[0]):
            store(blocks[c], run.table[c], begin, count)
        begin += count
