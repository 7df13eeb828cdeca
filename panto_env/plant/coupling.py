"""The step that joins pantograph, contact, catenary and actuators: one kernel for every line.

A catenary takes part by three functions, which it provides for its own type of line as overloads:
``move_wire``, ``load_wire`` and ``record_wire``. Numba picks them when the kernel is compiled for
that type, so they are inlined and the compiled kernel can be kept on disk (a function passed as an
argument could not).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .actuator import FRAME, HEAD, actuate
from .contact import contact_force
from .jit import kernel, part
from .pantograph import move_free, press

# Columns of the samples. Each is the mean over one step, so it belongs to the middle of the step.
CONTACT_FORCE, HEAD_HEIGHT, FRAME_HEIGHT, WIRE_HEIGHT = 0, 1, 2, 3  # N, m, m, m
HEAD_VELOCITY, FRAME_VELOCITY, FRAME_FORCE, HEAD_FORCE = 4, 5, 6, 7  # m/s, m/s, N, N
CHANNELS = 8


class Run(NamedTuple):
    """Where each lane is on its line, and its contact. All arrays have one entry a lane."""

    step: NDArray[np.int64]  # steps since the start
    start: Array  # position at the start (m)
    stride: Array  # distance covered in one step (m)
    strip_compliance: Array  # of the contact spring (m/N), 0 where rigid
    strip_damping: Array  # of the contact damper, over the time step (N/m)
    lowest_force: Array  # 0, or -inf for a contact that may pull (N)
    force: Array  # mean contact force over the last step (N)
    gap: Array  # head height minus wire height now (m)
    stiffness: Array  # of contact spring and massless line in series now (N/m)
    waves: Array  # (lanes, waves, 3): irregularity as amplitude (m), wavenumber (1/m), phase


class Samples(NamedTuple):
    """What a kernel call records; arrays of no columns record nothing."""

    channels: Array  # (lanes, steps, CHANNELS)
    uplift: Array  # (lanes, steps, supports): of the contact wire at the end of the step (m)
    tension: Array  # (lanes, steps, droppers): mean over the step (N)


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
def irregularity(waves, x):
    """Height of the contact wire's irregularity (m) at x (m): a sum of cosines."""
    total = 0.0
    for k in range(waves.shape[0]):
        total += waves[k, 0] * np.cos(waves[k, 1] * x + waves[k, 2])
    return total


@part
def advance_lane(line, wire, body, drive, run, lane, frame_command, head_command, steps, samples):
    """Advance one lane by ``steps`` steps under constant commands (N).

    The sample of step n (counted from 0) is written to row n + 1, counted round where the arrays have
    fewer rows than the run has steps; row 0 is the start.
    """
    half = body.state.shape[1] // 2
    recorded = samples.uplift.shape[2] > 0 or samples.tension.shape[2] > 0
    state, waves = body.state[lane], run.waves[lane]
    for _ in range(steps):
        n = run.step[lane]
        x0 = run.start[lane] + run.stride[lane] * n
        x1 = run.start[lane] + run.stride[lane] * (n + 1)
        actuate(drive, lane, frame_command, head_command)
        head_0, frame_0 = state[0], state[half - 1]
        head_rate_0, frame_rate_0 = state[half], state[2 * half - 1]
        gap_0 = run.gap[lane]

        head_free = move_free(body, lane, drive.force[lane, FRAME], drive.force[lane, HEAD])
        wire_free, wire_yield, spring = move_wire(line, wire, lane, x0, x1, run.force[lane])
        wire_free += irregularity(waves, x1)
        stiffness = 1.0 / (run.strip_compliance[lane] + spring)
        force = contact_force(
            run.stiffness[lane],
            gap_0,
            stiffness,
            head_free - wire_free,
            run.strip_damping[lane],
            wire_yield - body.contact_input[0],
            run.lowest_force[lane],
        )
        press(body, lane, force)
        load_wire(line, wire, lane, x0, x1, force)
        gap_1 = state[0] - wire_free - wire_yield * force

        k = (n + 1) % samples.channels.shape[1]
        row = samples.channels[lane, k]
        row[CONTACT_FORCE] = force
        row[HEAD_HEIGHT] = 0.5 * (head_0 + state[0])
        row[FRAME_HEIGHT] = 0.5 * (frame_0 + state[half - 1])
        row[WIRE_HEIGHT] = 0.5 * (head_0 - gap_0 + state[0] - gap_1) + spring * force
        row[HEAD_VELOCITY] = 0.5 * (head_rate_0 + state[half])
        row[FRAME_VELOCITY] = 0.5 * (frame_rate_0 + state[2 * half - 1])
        row[FRAME_FORCE] = drive.force[lane, FRAME]
        row[HEAD_FORCE] = drive.force[lane, HEAD]
        if recorded:
            record_wire(line, wire, lane, samples.uplift[lane, k], samples.tension[lane, k])
        run.force[lane] = force
        run.gap[lane] = gap_1
        run.stiffness[lane] = stiffness
        run.step[lane] = n + 1


@kernel
def advance(line, wire, body, drive, run, command, steps, samples):
    """Advance every lane by ``steps`` steps under constant commands (lanes, 2) of force (N)."""
    for lane in range(body.state.shape[0]):
        frame_command, head_command = command[lane, FRAME], command[lane, HEAD]
        advance_lane(line, wire, body, drive, run, lane, frame_command, head_command, steps, samples)
