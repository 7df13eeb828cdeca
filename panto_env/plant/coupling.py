"""The step that joins pantograph, contact, catenary and actuators: one kernel for every line.

A catenary takes part by three functions, which it provides for its own type of line as overloads:
``move_wire``, ``load_wire`` and ``record_wire``. Numba picks them when the kernel is compiled for
that type, so they are inlined and the compiled kernel can be kept on disk (a function passed as an
argument could not). ``WIDTH`` says how many lanes go side by side through each part of a step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from ..arrays import Array
from .actuator import FRAME, HEAD, actuate
from .contact import contact_force
from .cosine import cosine_of_turns
from .held import open_held
from .jit import PART, kernel, part
from .pantograph import MAX_STATE, move_free, press
from .stack import stack

# Rows of a sample. Each is the mean over one step, so it belongs to the middle of the step.
CONTACT_FORCE, HEAD_HEIGHT, FRAME_HEIGHT, WIRE_HEIGHT = 0, 1, 2, 3  # N, m, m, m
HEAD_VELOCITY, FRAME_VELOCITY, FRAME_FORCE, HEAD_FORCE = 4, 5, 6, 7  # m/s, m/s, N, N
CHANNELS = 8

WIDTH: dict[type, int] = {}
"""Lanes abreast by type of line, 1 unless named: many where the wire has no state of its own, so that they
share vector instructions; one where a lane's wire fills the nearest cache."""


class Run(NamedTuple):
    """Where each lane is on its line, and its contact. All arrays have one entry a lane at the end."""

    step: NDArray[np.int64]  # (lanes,): steps since the start
    stride: Array  # (lanes,): distance covered in one step (m)
    force: Array  # (lanes,): mean contact force over the last step (N)
    gap: Array  # (lanes,): head height minus wire height now (m)
    stiffness: Array  # (lanes,): of contact spring and massless line in series now (N/m)
    waves: Array  # (waves, 3, lanes): irregularity as amplitude (m), turns a metre (1/m), phase in turns
    lowest_force: float  # 0, or -inf for a contact that may pull (N)


class Samples(NamedTuple):
    """What a kernel call records; arrays of no columns or one row record nothing."""

    channels: Array  # (lanes, rows, CHANNELS); row 0 is the start
    uplift: Array  # (lanes, rows, supports): of the contact wire at the end of the step (m)
    tension: Array  # (lanes, rows, droppers): mean over the step (N)


class Block(NamedTuple):
    """Lanes side by side, on the stack; the last axis is the lane within the block."""

    state: Array  # (MAX_STATE, width): of the pantograph, as in Body
    free: Array  # (MAX_STATE, width): at the end of the step, were there no contact force
    command: Array  # (2, width): of the actuators (N)
    due: Array  # (width,): command that arrives now, scratch (N)
    drive: Array  # (2, width): force of the actuators (N)
    sample: Array  # (CHANNELS, width): of the last step
    step: Array  # (width,): as in Run, and so are the next four
    stride: Array  # (width,)
    force: Array  # (width,)
    gap: Array  # (width,)
    stiffness: Array  # (width,)
    lift: Array  # (width,): as in Body (N)
    rough: Array  # (width,): height of the irregularity at the end of the step (m)


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


def new_block(line: Any) -> Any:
    """Block for as many lanes as go abreast on this type of line."""
    raise NotImplementedError("only kernels make blocks")


@overload(new_block, jit_options=PART)
def _new_block(line):
    width = WIDTH.get(line.instance_class, 1)

    def build(line):
        rows = stack(8, width)
        return Block(
            state=stack(MAX_STATE, width),
            free=stack(MAX_STATE, width),
            command=stack(2, width),
            drive=stack(2, width),
            sample=stack(CHANNELS, width),
            due=rows[0],
            step=rows[1],
            stride=rows[2],
            force=rows[3],
            gap=rows[4],
            stiffness=rows[5],
            lift=rows[6],
            rough=rows[7],
        )

    return build


@part
def load_block(body, drive, run, block, begin, count):
    """Fetch what a step needs of ``count`` lanes from ``begin`` on."""
    for r in range(body.state.shape[0]):
        fetch(body.state[r], block.state[r], begin, count)
    for c in range(2):
        fetch(drive.force[c], block.drive[c], begin, count)
    fetch(run.step, block.step, begin, count)
    fetch(run.stride, block.stride, begin, count)
    fetch(run.force, block.force, begin, count)
    fetch(run.gap, block.gap, begin, count)
    fetch(run.stiffness, block.stiffness, begin, count)
    fetch(body.lift, block.lift, begin, count)
    for i in range(count):
        block.rough[i] = 0.0


@part
def store_block(body, drive, run, block, begin, count):
    """Put back what the steps have changed."""
    for r in range(body.state.shape[0]):
        store(block.state[r], body.state[r], begin, count)
    for c in range(2):
        store(block.drive[c], drive.force[c], begin, count)
    store(block.force, run.force, begin, count)
    store(block.gap, run.gap, begin, count)
    store(block.stiffness, run.stiffness, begin, count)
    steps = run.step[begin : begin + count]
    for i in range(count):
        steps[i] = np.int64(block.step[i])


@part
def fetch(array, row, begin, count):
    """Copy ``count`` entries from ``begin`` on to a row of a block."""
    lanes = array[begin : begin + count]  # a slice: an index begin + i might be negative, for all Numba knows
    for i in range(count):
        row[i] = lanes[i]


@part
def store(row, array, begin, count):
    """Copy a row of a block back."""
    lanes = array[begin : begin + count]
    for i in range(count):
        lanes[i] = row[i]


@part
def roughen(waves, block, begin, count):
    """Height of the contact wire's irregularity at the end of the step (m): a sum of cosines."""
    for i in range(count):
        block.rough[i] = 0.0
    for k in range(waves.shape[0]):
        wave = waves[k, :, begin : begin + count]
        for i in range(count):
            turns = wave[1, i] * (block.stride[i] * (block.step[i] + 1.0)) + wave[2, i]
            block.rough[i] += wave[0, i] * cosine_of_turns(turns)


@part
def step_block(line, wire, body, drive, run, block, begin, count):
    """One step of a block of lanes of one variety, under ``block.command``; its sample."""
    variety, size = body.variety[begin], body.state.shape[0]
    half = size // 2
    actuate(drive, block, begin, count)
    move_free(body, variety, size, block, count)
    if run.waves.shape[0] > 0:
        roughen(run.waves, block, begin, count)
    contact_input = body.contact_input[variety]
    strip_compliance, strip_damping = body.strip[variety, 0], body.strip[variety, 1]
    sample, state, free = block.sample, block.state, block.free
    for i in range(count):
        x0 = block.stride[i] * block.step[i]
        x1 = block.stride[i] * (block.step[i] + 1.0)
        height, wire_yield, spring = move_wire(line, wire, begin + i, x0, x1, block.force[i])
        height += block.rough[i]
        stiffness = 1.0 / (strip_compliance + spring)
        gap = block.gap[i]
        force = contact_force(
            block.stiffness[i],
            gap,
            stiffness,
            free[0, i] - height,
            strip_damping,
            wire_yield - contact_input[0],
            run.lowest_force,
        )
        head = free[0, i] + contact_input[0] * force
        block.gap[i] = head - height - wire_yield * force
        block.stiffness[i] = stiffness
        block.force[i] = force
        mean_head = 0.5 * (state[0, i] + head)
        sample[CONTACT_FORCE, i] = force
        sample[HEAD_HEIGHT, i] = mean_head
        sample[WIRE_HEIGHT, i] = mean_head - 0.5 * (gap + block.gap[i]) + spring * force
        load_wire(line, wire, begin + i, x0, x1, force)
    for i in range(count):
        sample[FRAME_HEIGHT, i] = state[half - 1, i]
        sample[HEAD_VELOCITY, i] = state[half, i]
        sample[FRAME_VELOCITY, i] = state[size - 1, i]
    press(body, variety, size, block, count)
    for i in range(count):
        sample[FRAME_HEIGHT, i] = 0.5 * (sample[FRAME_HEIGHT, i] + state[half - 1, i])
        sample[HEAD_VELOCITY, i] = 0.5 * (sample[HEAD_VELOCITY, i] + state[half, i])
        sample[FRAME_VELOCITY, i] = 0.5 * (sample[FRAME_VELOCITY, i] + state[size - 1, i])
        sample[FRAME_FORCE, i] = block.drive[FRAME, i]
        sample[HEAD_FORCE, i] = block.drive[HEAD, i]
        block.step[i] += 1.0


@part
def record_block(line, wire, samples, block, begin, count):
    """Write the sample of a step, the run's n-th, to row n of each lane, or to the last there is."""
    channels, uplift, tension = samples.channels, samples.uplift, samples.tension
    if channels.shape[1] > 1:
        for i in range(count):
            row = channels[begin + i, int(block.step[i])]
            for c in range(CHANNELS):
                row[c] = block.sample[c, i]
    if uplift.shape[2] > 0 or tension.shape[2] > 0:
        for i in range(count):
            n = min(int(block.step[i]), uplift.shape[1] - 1)
            record_wire(line, wire, begin + i, uplift[begin + i, n], tension[begin + i, n])


@part
def alike(body, block, begin, last):
    """How many lanes from ``begin`` to before ``last`` can share a block: those of one variety."""
    count, limit = 1, min(block.force.size, last - begin)
    while count < limit and body.variety[begin + count] == body.variety[begin]:
        count += 1
    return count


@kernel
def advance(held, samples, command, steps, first, last):
    """Advance lanes from ``first`` to before ``last`` by ``steps`` under commands (lanes, 2) of force (N).

    held: line, wire, body, drive and run.
    """
    line, wire, body, drive, run = open_held(held)
    block = new_block(line)
    begin = first
    while begin < last:
        count = alike(body, block, begin, last)
        load_block(body, drive, run, block, begin, count)
        for c in range(2):
            for i in range(count):
                block.command[c, i] = command[begin + i, c]
        for _ in range(steps):
            step_block(line, wire, body, drive, run, block, begin, count)
            record_block(line, wire, samples, block, begin, count)
        store_block(body, drive, run, block, begin, count)
        begin += count
