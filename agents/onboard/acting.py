"""From the observation to the actuators' forces: the control step, networks and feedback laws.

A part of the on-board controller's description; see ``seeing`` for its form.
"""

from __future__ import annotations

import math
from collections.abc import MutableSequence

from panto_baselines.policies.guard_rules import (
    Constants,
    Number,
    State,
    act_within_guard,
    begin_guard,
    check_readings,
    nominal_force,
    shown_force,
)

from .learning import act_by_learning, model_force
from .seeing import (
    PLACE,
    Readings,
    Single,
    forget_earlier_spans,
    see,
    sine_of_turns,
    take_readings,
)

Forces = MutableSequence[float]

NONE, FEEDBACK, REPETITIVE = range(3)
"""Laws that act alone, or that a network adds to."""


def begin(c: Constants, s: State) -> None:
    """Begin with nothing read, remembered or done; all of the state is 0 before."""
    if c.memory_spans > 0:
        forget_earlier_spans(c, s)
    if c.guarded:
        begin_guard(c, s)


def step(c: Constants, s: State, r: Readings, force: Forces) -> None:
    """One control step: from readings to the force (N) of each actuator, within its limit.

    Until each reading has been good once, the force is 0 and nothing begins.
    """
    known = take_readings(c, s, r)
    for a in range(c.actions):
        s.action[a] = 0.0
    if known == 1:
        decide(c, s)
    for a in range(c.actions):
        s.past[a] = s.action[a]
        force[a] = s.action[a] * c.force_limit


def decide(c: Constants, s: State) -> None:
    """Action of each actuator, -1 to 1, from the readings."""
    see(c, s)
    if c.guarded:
        check_readings(c, s)
    if c.law == FEEDBACK:
        act_by_feedback(c, s)
    if c.law == REPETITIVE:
        force = washed_out(c, s, c.actions, act_by_learning(c, s))
        model_force(c, s, force)
        s.action[0] = force / c.force_limit
    if c.layers > 0:
        for a in range(c.actions):
            s.base[a] = min(1.0, max(-1.0, s.action[a]))
        act_by_network(c, s)
        for a in range(c.actions):
            s.action[a] = s.base[a] + c.network_share * s.action[a]
    for a in range(c.actions):
        s.action[a] = min(1.0, max(-1.0, s.action[a]))
    if c.guarded:
        act_within_guard(c, s)
    if c.washout_share > 0.0:
        wash_out_measured_force(c, s)
    s.begun = 1


def wash_out_measured_force(c: Constants, s: State) -> None:
    """Subtract the slow average of the force that the actuators report, as the environment does in training.

    The last inputs are these forces; the average begins after the first step, before which none acted.
    """
    for a in range(c.actions):
        if s.begun == 1:
            s.washed[a] += c.washout_share * s.input[c.inputs - c.actions + a] * (1.0 / c.force_limit)
        s.action[a] = min(1.0, max(-1.0, s.action[a] - s.washed[a]))


def act_by_feedback(c: Constants, s: State) -> None:
    """Force by the error of the contact force and its change, the frame's velocity, and the place."""
    contact = shown_force(c, s)
    if c.feeds_forward:
        contact = min(max(contact, c.lowest), c.highest)
    error = nominal_force(c, s) - contact
    if c.dead_zone > 0.0:
        error = error - min(max(error, -c.dead_zone), c.dead_zone)
    change = 0.0
    if s.begun == 1:
        change = error - s.last_error
    s.last_error = error
    frame_velocity = float(s.seen[c.velocity_entry]) * c.velocity_scale
    wanted = c.gain * error + c.derivative * change / c.interval - c.damping * frame_velocity
    if c.feeds_forward:
        wanted += c.amplitude * sine_of_turns(s.input[PLACE] - c.phase)
    s.action[0] = wanted / c.force_limit


def act_by_network(c: Constants, s: State) -> None:
    """Action of the network, less its slow average where it has a washout."""
    for k in range(c.entries):
        s.values[k] = s.seen[k]
    if c.steps_before > 0:
        prepare(c, s)
    for number in range(c.layers):
        layer(c, s, number)
        if number == 0 and c.units > 0:
            recur(c, s)
    for a in range(c.actions):
        value = s.values[a]
        if c.squashed:
            value = math.tanh(value)
        s.action[a] = min(1.0, max(-1.0, value))
        if c.washes_out:
            s.action[a] = washed_out(c, s, a, s.action[a] * c.force_limit) / c.force_limit


def prepare(c: Constants, s: State) -> None:
    """The steps before the network: values are scaled, or stacked with earlier ones, oldest first."""
    for n in range(c.steps_before):
        width = c.width[n]
        if c.stacked[n] == 0:
            for k in range(width):
                scaled = (s.values[k] - c.step_centre[c.step_at[n] + k]) / c.step_scale[c.step_at[n] + k]
                s.values[k] = min(c.step_bound[n], max(-c.step_bound[n], scaled))
        else:
            first = c.step_at[n]
            length = width * c.stacked[n]
            for k in range(length):
                if s.begun == 0:
                    s.frames[first + k] = s.values[k % width]
                    if c.padded[n] == 1:
                        s.frames[first + k] = c.padding[first + k]
            for k in range(length - width):
                s.frames[first + k] = s.frames[first + width + k]
            for k in range(width):
                s.frames[first + length - width + k] = s.values[k]
            for k in range(length):
                s.values[k] = s.frames[first + k]


def layer(c: Constants, s: State, number: int) -> None:
    """One layer: s.values becomes weight @ s.values + bias, bent unless it is the last."""
    rows = c.rows[number]
    columns = c.columns[number]
    for i in range(rows):
        first = c.weight_at[number] + i * columns
        total = c.bias[c.bias_at[number] + i]
        for j in range(columns):
            total += c.weight[first + j] * s.values[j]
        s.following[i] = total
    for i in range(rows):
        s.values[i] = s.following[i]
        if number < c.layers - 1:
            if c.bent_by_tanh:
                s.values[i] = math.tanh(s.following[i])
            elif s.following[i] < 0.0:
                s.values[i] = 0.0


def recur(c: Constants, s: State) -> None:
    """A gated recurrent unit on the first layer's values; the next layer sees its new state, then these."""
    for i in range(c.units):
        reset = gate(given(c, s, i) + kept(c, s, i))
        update = gate(given(c, s, c.units + i) + kept(c, s, c.units + i))
        new = math.tanh(given(c, s, 2 * c.units + i) + reset * kept(c, s, 2 * c.units + i))
        s.following[i] = (1.0 - update) * new + update * s.hidden[i]
    for j in range(c.rows[0] - 1, -1, -1):
        s.values[c.units + j] = s.values[j]
    for i in range(c.units):
        s.hidden[i] = s.following[i]
        s.values[i] = s.following[i]


def gate(value: Single) -> Single:
    """The logistic function, in a form that does not overflow."""
    return 0.5 + 0.5 * math.tanh(0.5 * value)


def given(c: Constants, s: State, row: int) -> Single:
    """What a row of the unit's gates makes of its inputs."""
    total = c.bias_input[row]
    for j in range(c.rows[0]):
        total += c.weight_input[row, j] * s.values[j]
    return total


def kept(c: Constants, s: State, row: int) -> Single:
    """What a row of the unit's gates makes of its state."""
    total = c.bias_state[row]
    for j in range(c.units):
        total += c.weight_state[row, j] * s.hidden[j]
    return total


def washed_out(c: Constants, s: State, w: int, requested: float) -> Number:
    """Force (N) requested minus its slow average, which goes on by the actuator's force as modelled.

    w: number of the average: of an actuator's network, or, after these, of the law's. The actuator moves at
    its limit of rate, then by its lag (``repetitive.Washout``).
    """
    left = min(c.force_limit, max(-c.force_limit, requested - s.average_force[w]))
    ahead = left - s.actuator_force[w]
    distance = abs(ahead)
    change = distance
    lag = c.lag[w]
    if lag > 0.0:
        by_rate = min(max(distance - c.rate[w] * lag, 0.0), c.rate[w] * c.interval)
        change = by_rate - (distance - by_rate) * math.expm1(-(c.interval - by_rate / c.rate[w]) / lag)
    if ahead < 0.0:
        change = -change
    s.actuator_force[w] += change
    s.average_force[w] += c.average_of_force[w] * s.actuator_force[w]
    return left
