"""The step that joins pantograph, contact, catenary and actuators: one kernel for every line.

A catenary takes part by three functions, which it provides for its own type of line as overloads:
``move_wire``, ``load_wire`` and ``record_wire``. Numba picks them when the kernel is compiled for
that type, so they are inlined and the compiled kernel can be kept on disk (a function passed as an
argument could not). ``stack.WIDTH`` says how many lanes go side by side through each part of a step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..backend.block import stack
from ..backend.compile import kernel, part
from ..backend.memory import aligned_zeros
from ..backend.packed import open_held
from ..base.arrays import Array
from .actuators.lagged import FRAME, HEAD, actuate
from .contact import contact_force
from .pantograph.build import MAX_STATE, move_free, press
from .trigonometry import cosine_of_turns

# Rows of a lane's column in ``Run.lanes``. The sample of the last step comes first; each of its values is
# the mean over the step, so it belongs to the middle of the step.
CONTACT_FORCE, HEAD_HEIGHT, FRAME_HEIGHT, WIRE_HEIGHT = 0, 1, 2, 3  # N, m, m, m
HEAD_VELOCITY, FRAME_VELOCITY, FRAME_FORCE, HEAD_FORCE = 4, 5, 6, 7  # m/s, m/s, N, N
CHANNELS = 8
STEP = 8  # steps since the start
STRIDE = 9  # distance covered in one step (m)
LIFT = 10  # static and aerodynamic uplift on the lowest mass (N)
FORCE = 11  # mean contact force over the last step (N)
GAP = 12  # head height minus wire height now (m)
STIFFNESS = 13  # of contact spring and massless line in series now (N/m)
DRIVE = 14  # force of the actuators on frame and head (N), two rows
STATE = 16  # displacements (m) and velocities (m/s) of the pantograph, head first
# Rows that only a block has.
FREE = STATE + MAX_STATE  # the state at the end of the step, were there no contact force
COMMAND = FREE + MAX_STATE  # of the actuators on frame and head (N), two rows
DUE = COMMAND + 2  # the command that arrives now (N)
ROUGH = DUE + 1  # height of the irregularity at the end of the step (m)
BLOCK_ROWS = ROUGH + 1


class Run(NamedTuple):
    """Where each lane is on its line, its pantograph's motion, and its contact."""

    lanes: Array  # (STATE + 2n, lanes and spare columns): the rows above
    waves: Array  # (waves, 3, lanes): irregularity as amplitude (m), turns a metre (1/m), phase in turns
    lowest_force: float  # 0, or -inf for a contact that may pull (N)


def lane_table(rows: int, lanes: int) -> Array:
    """Zeros of at least ``lanes`` columns, an odd number of cache lines a row.

    Rows a power of two apart would fall on the same few places of a cache and drive each other out.
    """
    lines = -(-lanes // 8)
    return aligned_zeros((rows, 8 * (lines + 1 - lines % 2)))


class Samples(NamedTuple):
    """What a kernel call records; arrays of no columns or one row record nothing."""

    channels: Array  # (lanes, rows, CHANNELS); row 0 is the start
    uplift: Array  # (lanes, rows, supports): of the contact wire at the end of the step (m)
    tension: Array  # (lanes, rows, droppers): mean over the step (N)


def move_wire(line: Any, wire: Any, lane: int, x0: float, x1: float, force: float) -> Any:
    """Move one lane's wire over a step without the new contact force.

    x0, x1: the contact point at the step's start and end (m); force: over the last step (N).
    Returns at x1: the wire's height (m), its yield to 1 N over the step (m/N), and the compliance
    of a massless spring in series (m/N, 0 if none).
    """
    raise NotImplementedError("a catenary overloads this for its type of line")


def load_wire(line: Any, wire: Any, lane: int, x0: float, x1: float, force: float) -> Any:
    """Add the contact force over the step (N) and end the step of one lane."""
    raise NotImplementedError("a catenary overloads this for its type of line")


def record_wire(line: Any, wire: Any, lane: int, uplift: Array, tension: Array) -> Any:
    """Write uplift at the supports (m) and dropper tensions (N) of one lane, as far as asked for."""
    raise NotImplementedError("a catenary overloads this for its type of line")


@part
def load(table, block, first, begin, count):
    """Copy rows from ``first`` on of ``count`` lanes from ``begin`` on to a block."""
    for r in range(first, table.shape[0]):
        lanes = table[r, begin : begin + count]  # begin + i might be negative, for all that Numba knows
        for i in range(count):
            block[r, i] = lanes[i]


@part
def store(block, table, begin, count):
    """Copy a block's rows back."""
    for r in range(table.shape[0]):
        lanes = table[r, begin : begin + count]
        for i in range(count):
            lanes[i] = block[r, i]


@part
def roughen(waves, block, begin, count):
    """Height of the contact wire's irregularity at the end of the step (m): a sum of cosines."""
    for i in range(count):
        block[ROUGH, i] = 0.0
    for k in range(waves.shape[0]):
        wave = waves[k, :, begin : begin + count]
        for i in range(count):
            turns = wave[1, i] * (block[STRIDE, i] * (block[STEP, i] + 1.0)) + wave[2, i]
            block[ROUGH, i] += wave[0, i] * cosine_of_turns(turns)


@part
def step_block(line, wire, body, drive, run, block, begin, count):
    """One step of a block of lanes of one variety, under the commands in it; its sample."""
    variety, size = body.variety[begin], body.transition.shape[1]
    frame, frame_velocity, head_velocity = STATE + size // 2 - 1, STATE + size - 1, STATE + size // 2
    actuate(drive, block[DRIVE:], block[COMMAND:], block[DUE], begin, count)
    move_free(body, variety, block[STATE:], block[FREE:], block[LIFT], block[DRIVE:], count)
    roughen(run.waves, block, begin, count)
    contact_input, strip = body.contact_input[variety, 0], body.strip[variety]
    for i in range(count):
        x0 = block[STRIDE, i] * block[STEP, i]
        x1 = block[STRIDE, i] * (block[STEP, i] + 1.0)
        height, wire_yield, spring = move_wire(line, wire, begin + i, x0, x1, block[FORCE, i])
        height += block[ROUGH, i]
        stiffness = 1.0 / (strip[0] + spring)
        gap = block[GAP, i]
        force = contact_force(
            block[STIFFNESS, i],
            gap,
            stiffness,
            block[FREE, i] - height,
            strip[1],
            wire_yield - contact_input,
            run.lowest_force,
        )
        head = block[FREE, i] + contact_input * force
        new_gap = head - height - wire_yield * force
        mean_head = 0.5 * (block[STATE, i] + head)
        block[GAP, i] = new_gap
        block[STIFFNESS, i] = stiffness
        block[FORCE, i] = force
        block[CONTACT_FORCE, i] = force
        block[HEAD_HEIGHT, i] = mean_head
        block[WIRE_HEIGHT, i] = mean_head - 0.5 * (gap + new_gap) + spring * force
        load_wire(line, wire, begin + i, x0, x1, force)
    for i in range(count):
        block[FRAME_HEIGHT, i] = block[frame, i]
        block[HEAD_VELOCITY, i] = block[head_velocity, i]
        block[FRAME_VELOCITY, i] = block[frame_velocity, i]
    press(body, variety, block[STATE:], block[FREE:], block[FORCE], count)
    for i in range(count):
        block[FRAME_HEIGHT, i] = 0.5 * (block[FRAME_HEIGHT, i] + block[frame, i])
        block[HEAD_VELOCITY, i] = 0.5 * (block[HEAD_VELOCITY, i] + block[head_velocity, i])
        block[FRAME_VELOCITY, i] = 0.5 * (block[FRAME_VELOCITY, i] + block[frame_velocity, i])
        block[FRAME_FORCE, i] = block[DRIVE + FRAME, i]
        block[HEAD_FORCE, i] = block[DRIVE + HEAD, i]
        block[STEP, i] += 1.0


@part
def record_block(line, wire, samples, block, begin, count):
    """Write the sample of a step, the run's n-th, to row n of each lane, or to the last there is."""
    channels, uplift, tension = samples.channels, samples.uplift, samples.tension
    if channels.shape[1] > 1:
        for i in range(count):
            row = channels[begin + i, int(block[STEP, i])]
            for c in range(CHANNELS):
                row[c] = block[c, i]
    if uplift.shape[2] > 0 or tension.shape[2] > 0:
        for i in range(count):
            n = min(int(block[STEP, i]), uplift.shape[1] - 1)
            record_wire(line, wire, begin + i, uplift[begin + i, n], tension[begin + i, n])


@part
def alike(body, block, begin, last):
    """How many lanes from ``begin`` to before ``last`` can share a block: those of one variety."""
    count, limit = 1, min(block.shape[1], last - begin)
    while count < limit and body.variety[begin + count] == body.variety[begin]:
        count += 1
    return count


@kernel
def advance(held, samples, command, steps, first, last):
    """Advance lanes from ``first`` to before ``last`` by ``steps`` under commands (lanes, 2) of force (N).

    held: line, wire, body, drive and run.
    """
    line, wire, body, drive, run = open_held(held)
    block = stack(line, BLOCK_ROWS)
    begin = first
    while begin < last:
        count = alike(body, block, begin, last)
        load(run.lanes, block, STEP, begin, count)
        for c in range(2):
            for i in range(count):
                block[COMMAND + c, i] = command[begin + i, c]
        for _ in range(steps):
            step_block(line, wire, body, drive, run, block, begin, count)
            record_block(line, wire, samples, block, begin, count)
        store(block, run.lanes, begin, count)
        begin += count
