"""The step that joins pantographs, contacts, catenary and actuators: one source for every line."""

from __future__ import annotations

from ..backend import NOT_NEGATIVE, called, inlined, kernel, open_packed
from .actuators import drive
from .catenary.protocol import (
    advance_wire,
    apply_force,
    end_step,
    has_second_wire,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)
from .functions import cosine_of_turns
from .pantograph.step import PART, add_contact_force, contact_force, move_freely, roll_freely, shared_forces
from .state import LATERAL_EVERY, PLACE, ROW, SAMPLE_ROWS, own_row
from .train import lift, lift_by_height, lift_by_wind, mean_stride, place_on_line


@inlined
def irregularity(run, x, lane):
    """Height of the contact wire's irregularity (m) at x (m): a sum of cosines."""
    waves, height = run.waves[lane], 0.0
    for k in range(0, waves.size, 3):
        height += waves[k] * cosine_of_turns(waves[k + 1] * x + waves[k + 2])
    return height


@inlined
def lateral_at(run, x):
    """Lateral position of the contact wire at x (m), from the head's middle, to the right (m)."""
    place = min(max(x / LATERAL_EVERY, 0.0), run.lateral.size - 1.001)
    k = int(place)
    return run.lateral[k] + (place - k) * (run.lateral[k + 1] - run.lateral[k])


@inlined
def approach(line, wire, pantographs, actuators, run, contact, lane):
    """Begin the step of one collector: everything except the contact force."""
    own = run.table[contact, lane]
    if run.drift.shape[1] > 0:
        own[ROW.LIFT] = lift(run, contact, lane, own[ROW.STEP] + 0.5)
    if run.wind.shape[1] > 0 or run.tunnels.shape[1] > 0:
        own[ROW.WIND] = lift_by_wind(run, contact, lane, own[ROW.STEP] + 0.5)
    x = place_on_line(run, contact, lane, own[ROW.STEP] + 0.5)
    if run.levels.size > 0:
        parts = pantographs.table[contact, own_row(pantographs.table[contact], lane)]
        own[ROW.BY_HEIGHT] = lift_by_height(run, contact, parts[PART.LOCAL_SPRING], x)
    if run.driven[contact] > 0:
        drive(actuators, pantographs, contact, own, own[ROW.COMMAND :], lane)
    move_freely(pantographs, contact, own, lane)
    own[ROW.IRREGULARITY] = irregularity(run, x, lane)
    before, middle = place_contact(line, wire, lane, contact, x)
    own[ROW.WIRE_BEFORE] = before
    own[ROW.WIRE_MIDDLE] = middle
    if has_second_wire(line):
        before, middle = place_contact(line, wire, lane, len(run.distance) + contact, x)
        own[ROW.SECOND_BEFORE] = before
        own[ROW.SECOND_MIDDLE] = middle


@inlined
def rise_along(line, wire, run, contact, point, own, lane):
    """Rise of the wire at a contact point along the distance of the step (m), for the contact's damper."""
    x0 = place_on_line(run, contact, lane, own[ROW.STEP])
    x1 = place_on_line(run, contact, lane, own[ROW.STEP] + 1.0)
    way = mean_stride(run, contact, lane, 1.0)
    if len(run.distance) > 1:
        way = min(way, x1 - x0)  # none before it comes onto the line
    uneven = irregularity(run, x1, lane) - irregularity(run, x0, lane)
    return uneven + rise_at_contact(line, wire, lane, point, x0, x0 + way)


@inlined
def meet(line, wire, pantographs, run, contact, lane):
    """Compute the contact force over the step, from head and wire as they would move without it.

    It is not applied yet: the forces of all collectors are taken from one state of the wire.
    """
    own = run.table[contact, lane]
    parts = pantographs.table[contact, own_row(pantographs.table[contact], lane)]
    free_middle = own[ROW.STATE + pantographs.sizes[contact]]
    share = parts[PART.IMPLICIT_SHARE]
    x = place_on_line(run, contact, lane, own[ROW.STEP] + 0.5)
    # Where it is touched; a head that rolls yields more there than in its middle.
    head, free_head, contact_input = own[ROW.STATE], free_middle, parts[PART.CONTACT_INPUT]
    aside, angle, rate = 0.0, 0.0, 0.0
    if run.lateral.size > 0:
        aside = lateral_at(run, x)
        angle, rate = roll_freely(parts, own)
        head += aside * own[own.size - 2]
        free_head += aside * angle
        contact_input += aside * aside * parts[PART.ROLL_INPUT]
    rise = 0.0
    if parts[PART.STRIP_DAMPING] > 0.0:
        rise = rise_along(line, wire, run, contact, contact, own, lane)
    free_wire, wire_yield, early_yield, spring = look_at_contact(line, wire, lane, contact, x)
    before, irregular = own[ROW.WIRE_BEFORE], own[ROW.IRREGULARITY]
    middle = share * 0.5 * (before + free_wire) + (1.0 - share) * own[ROW.WIRE_MIDDLE]
    middle_yield = share * 0.5 * wire_yield + (1.0 - share) * early_yield
    force = contact_force(
        max(parts[PART.STRIP_COMPLIANCE] + spring, 0.0),  # a grid may yield more at its nodes than a wire
        0.5 * (head + free_head) - (middle + irregular),
        free_head - head - (free_wire - before) - rise,
        parts[PART.STRIP_DAMPING],
        middle_yield - 0.5 * contact_input,
        wire_yield - contact_input,
        run.lowest_force,
    )
    total = force
    own[ROW.WIRE_HEIGHT] = middle + irregular + (middle_yield + spring) * force
    if has_second_wire(line):
        law = contact_law(
            parts,
            contact_input,
            spring,
            0.5 * (head + free_head) - (middle + irregular),
            free_head - head - (free_wire - before) - rise,
            middle_yield,
            wire_yield,
        )
        yielding = middle_yield + spring
        its_head = (head, free_head, contact_input)
        force = meet_second_wire(line, wire, parts, run, contact, lane, its_head, law, middle, yielding)
        total = force + own[ROW.SECOND_FORCE]
    own[ROW.CONTACT_FORCE] = total
    own[ROW.FIRST_FORCE] = force
    own[ROW.HEAD_HEIGHT] = 0.5 * (own[ROW.STATE] + free_middle + parts[PART.CONTACT_INPUT] * total)
    if run.lateral.size > 0:
        own[own.size - 2] = angle + parts[PART.ROLL_INPUT] * aside * total
        own[own.size - 1] = rate + parts[PART.ROLL_INPUT + 1] * aside * total


@inlined
def contact_law(parts, contact_input, spring, gap, change, middle_yield, wire_yield):
    """Numerator and denominator of ``contact_force`` with one of two wires (m, m/N).

    contact_input: of the head where it is touched (m/N). spring: compliance in series with the contact's.
    """
    compliance = max(parts[PART.STRIP_COMPLIANCE] + spring, 0.0)
    damped = compliance * parts[PART.STRIP_DAMPING]
    resisting = compliance + middle_yield - 0.5 * contact_input
    return gap + damped * change, resisting + damped * (wire_yield - contact_input)


@called
def meet_second_wire(line, wire, parts, run, contact, lane, its_head, first, middle, middle_yield):
    """Share the contact force between two wires, and return that on the first (N).

    its_head: height of the head where it is touched at the step's start, and at its end without contact force
    (m), and what a newton changes (m/N). first: law of the first wire. middle: its height at mid-step without
    this force (m); middle_yield: how much it rises there per newton (m/N).
    """
    own, point = run.table[contact, lane], len(run.distance) + contact
    x, share = place_on_line(run, contact, lane, own[ROW.STEP] + 0.5), parts[PART.IMPLICIT_SHARE]
    rise = 0.0
    if parts[PART.STRIP_DAMPING] > 0.0:
        rise = rise_along(line, wire, run, contact, point, own, lane)
    free_wire, wire_yield, early_yield, spring = look_at_contact(line, wire, lane, point, x)
    before, irregular = own[ROW.SECOND_BEFORE], own[ROW.IRREGULARITY]
    head, free_head, contact_input = its_head
    its_middle = share * 0.5 * (before + free_wire) + (1.0 - share) * own[ROW.SECOND_MIDDLE]
    its_yield = share * 0.5 * wire_yield + (1.0 - share) * early_yield
    second = contact_law(
        parts,
        contact_input,
        spring,
        0.5 * (head + free_head) - (its_middle + irregular),
        free_head - head - (free_wire - before) - rise,
        its_yield,
        wire_yield,
    )
    damped = parts[PART.STRIP_COMPLIANCE] * parts[PART.STRIP_DAMPING]
    force, other = shared_forces(first, second, -(0.5 + damped) * contact_input)
    height, its_height = middle + middle_yield * force, its_middle + (its_yield + spring) * other
    # Of two wires that are touched, the one that carries more counts; of two that are not, the lower one.
    lower = its_height < height if force + other == 0.0 else other > force
    own[ROW.WIRE_HEIGHT] = irregular + (its_height if lower else height)
    own[ROW.SECOND_FORCE] = other
    return force


@inlined
def press(line, wire, run, contact, lane):
    """Apply the contact force of one collector to the wires that it touches."""
    own = run.table[contact, lane]
    x = place_on_line(run, contact, lane, own[ROW.STEP] + 0.5)
    apply_force(line, wire, lane, contact, x, own[ROW.FIRST_FORCE])
    if has_second_wire(line):
        apply_force(line, wire, lane, len(run.distance) + contact, x, own[ROW.SECOND_FORCE])


@inlined
def finish(pantographs, run, contact, lane):
    """End the step of one collector, and complete its sample of means over the step."""
    own = run.table[contact, lane]
    size = pantographs.sizes[contact]
    frame, head_speed, frame_speed = (ROW.STATE + size // 2 - 1, ROW.STATE + size // 2, ROW.STATE + size - 1)
    frame_before, head_speed_before, frame_speed_before = own[frame], own[head_speed], own[frame_speed]
    add_contact_force(pantographs, contact, own, lane)
    own[ROW.FRAME_HEIGHT] = 0.5 * (frame_before + own[frame])
    own[ROW.HEAD_VELOCITY] = 0.5 * (head_speed_before + own[head_speed])
    own[ROW.FRAME_VELOCITY] = 0.5 * (frame_speed_before + own[frame_speed])
    own[ROW.STEP] += 1.0


@inlined
def step_lane(line, wire, pantographs, actuators, run, lane):
    """One step of one lane under the commands in its rows."""
    for c in range(len(run.distance)):
        approach(line, wire, pantographs, actuators, run, c, lane)
    advance_wire(line, wire, lane)
    for c in range(len(run.distance)):
        meet(line, wire, pantographs, run, c, lane)
    for c in range(len(run.distance)):
        press(line, wire, run, c, lane)
    end_step(line, wire, lane)
    for c in range(len(run.distance)):
        finish(pantographs, run, c, lane)


@inlined
def record_lane(line, wire, run, samples, lane):
    """Write the sample of the run's n-th step to row n of a lane; arrays of one row keep the last one."""
    rows, uplift, tension = samples.rows, samples.uplift, samples.tension
    n = int(run.table[0, lane, ROW.STEP]) & NOT_NEGATIVE
    if rows.shape[1] > 1:
        for c in range(len(run.distance)):
            own = run.table[c, lane]
            for k in range(SAMPLE_ROWS):
                rows[lane, n, c, k] = own[k]
            if samples.second.shape[1] > 1:
                samples.second[lane, n, c] = own[ROW.SECOND_FORCE]
    if uplift.shape[1] > 0 or tension.shape[2] > 0:
        n = min(n, tension.shape[1] - 1)
        record_wire(line, wire, lane, uplift[lane, :, n], tension[lane, n])


@kernel
def advance(packed, samples, command, steps, first, last):
    """Advance the lanes from ``first`` to before ``last`` by ``steps``.

    packed: line, wire, pantographs, actuators and run. command: of the actuators (N), (lanes, collectors,
    places).
    """
    line, wire, pantographs, actuators, run = open_packed(packed)
    for lane in range(first, last):
        for c in range(len(run.distance)):
            for place in (PLACE.FRAME, PLACE.HEAD):
                run.table[c, lane, ROW.COMMAND + place] = command[lane, c, place]
        for _ in range(steps):
            step_lane(line, wire, pantographs, actuators, run, lane)
            record_lane(line, wire, run, samples, lane)
