"""Arrays of the kernels that drive a network through linear passes; ``WIDTH`` passes go abreast."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from panto_env.backend import WIDTH, inlined, kernel, larger, load_row, store_row

Array = Any
"""Of float32 unless it says otherwise; the last axis is that of the passes where it has ``WIDTH`` numbers."""


class Given(NamedTuple):
    """What passes give: times are control steps."""

    observations: Array  # (times, entries, WIDTH)
    actions: Array  # (times, WIDTH): that the passes were measured under
    # Whole numbers, to be multiplied with ``unit``: what each value is moved by an action of 1 that was taken
    # 1, 2, .. steps ago, (WIDTH, times, length, values + 1) of int16; the last value is the force.
    response: Array
    unit: Array  # (WIDTH, values + 1)
    before: Array  # (times, places, WIDTH) of int32: the step before a remembered place; -1: none
    share: Array  # (times, places, WIDTH): of the step from there on


class Entries(NamedTuple):
    """Which entries of an observation are moved."""

    now: Array  # (depth, values) of int64: by values now and 1, 2, .. steps ago
    force: Array  # (places,) of int64: by the remembered force
    acted: Array  # (places,) of int64: by remembered actions
    of_force: int  # the force's place among the values; that of the action is the last one
    average: Array  # (values,): share that a slow average takes of a value in a step; 0 without an average


class Weights(NamedTuple):
    """Of a network: linear layers, with a gated recurrent unit after the first one if it has any units."""

    first: Array  # (widths[0], entries)
    first_bias: Array  # (widths[0],)
    cell: Array  # (3 units, widths[0]), gates in torch's order: reset, update, new
    cell_bias: Array  # (3 units,)
    state: Array  # (3 units, units)
    state_bias: Array  # (3 units,)
    rest: tuple[Array, ...]  # each (outputs, inputs); inputs of the first one are state and first layer
    rest_bias: tuple[Array, ...]
    relu: bool  # otherwise tanh, as always after the last layer


class Washout(NamedTuple):
    """Of actions, as in ``panto_baselines.policies.repetitive``; share 0: none."""

    share: float  # that the average takes of the force in a step
    rate: float  # of the actuator (1/s)
    lag: float  # of the actuator (s)
    interval: float  # s


class Trace(NamedTuple):
    """What the forward pass leaves for the backward one."""

    moved: Array  # (times, values + 1, WIDTH): changes of values and force
    now: Array  # (times, values, WIDTH): changes as observed
    entries: Array  # (times, entries, WIDTH)
    joined: Array  # (times, units + widths[0], WIDTH): state of the cell, and output of the first layer
    gates: Array  # (times, 4 units, WIDTH): reset, update, new, and new's part of the state
    rest: tuple[Array, ...]  # each (times, outputs, WIDTH)
    free: Array  # (times, WIDTH): action requested beyond the washout's average, before its limits
    ahead: Array  # (times, WIDTH): of it beyond the actuator's force
    taken: Array  # (times, WIDTH): actions


class Slopes(NamedTuple):
    """Derivatives by what each layer adds up, (times, outputs, WIDTH)."""

    first: Array
    cell: Array
    state: Array
    rest: tuple[Array, ...]


@inlined
def _multiply(weights, bias, values, into, first):  # type: ignore[no-untyped-def]
    """Rows of ``into`` from ``first`` on: weights times values, plus bias."""
    inputs, rows = weights.shape[1], weights.shape[0]
    for row in range(0, rows - 3, 4):
        one, two = 0.0 * load_row(values, 0) + bias[row], 0.0 * load_row(values, 0) + bias[row + 1]
        three, four = 0.0 * one + bias[row + 2], 0.0 * one + bias[row + 3]
        for k in range(inputs):
            value = load_row(values, k)
            one = one + weights[row, k] * value
            two = two + weights[row + 1, k] * value
            three = three + weights[row + 2, k] * value
            four = four + weights[row + 3, k] * value
        store_row(into, first + row, one)
        store_row(into, first + row + 1, two)
        store_row(into, first + row + 2, three)
        store_row(into, first + row + 3, four)
    for row in range(rows - rows % 4, rows):
        one = 0.0 * load_row(values, 0) + bias[row]
        for k in range(inputs):
            one = one + weights[row, k] * load_row(values, k)
        store_row(into, first + row, one)


@inlined
def _tanh(value):  # type: ignore[no-untyped-def]
    """Of a vector, within 2e-7: Lambert's continued fraction of a quarter of it, doubled twice."""
    quarter = larger(-larger(-0.25 * value, 0.0 * value - 2.5), 0.0 * value - 2.5)
    square = quarter * quarter
    above = quarter * (135135.0 + square * (17325.0 + square * (378.0 + square)))
    half = above / (135135.0 + square * (62370.0 + square * (3150.0 + square * 28.0)))
    half = (half + half) / (1.0 + half * half)
    return (half + half) / (1.0 + half * half)


@inlined
def _sigmoid(value):  # type: ignore[no-untyped-def]
    return 0.5 + 0.5 * _tanh(0.5 * value)


@inlined
def _activate(values, first, relu):  # type: ignore[no-untyped-def]
    """Rows of a layer from ``first`` on, through its activation."""
    for row in range(first, values.shape[0]):
        value = load_row(values, row)
        store_row(values, row, larger(value, 0.0 * value) if relu else _tanh(value))


@inlined
def _move(given, trace, t):  # type: ignore[no-untyped-def]
    """Changes of values and force at a step, by the changes of the actions before it."""
    response, unit, moved = given.response, given.unit, trace.moved
    for p in range(WIDTH):
        for v in range(moved.shape[1]):
            moved[t, v, p] = 0.0
        for k in range(min(t, response.shape[2])):
            change = trace.taken[t - 1 - k, p] - given.actions[t - 1 - k, p]
            for v in range(moved.shape[1]):
                moved[t, v, p] += change * response[p, t, k, v]
        for v in range(moved.shape[1]):
            moved[t, v, p] *= unit[p, v]


@inlined
def _observe(given, entries, trace, t):  # type: ignore[no-untyped-def]
    """Entries of the observation at a step."""
    seen, now, last = trace.entries[t], trace.now, trace.now.shape[1] - 1
    for entry in range(seen.shape[0]):
        store_row(seen, entry, load_row(given.observations[t], entry))
    for ago in range(min(entries.now.shape[0], t + 1)):
        for v in range(now.shape[1]):
            entry = entries.now[ago, v]
            store_row(seen, entry, load_row(seen, entry) + load_row(now[t - ago], v))
    for place in range(entries.force.size):
        for p in range(WIDTH):
            before, share = given.before[t, place, p], given.share[t, place, p]
            if before >= 0:
                low, high = now[before, entries.of_force, p], now[before + 1, entries.of_force, p]
                seen[entries.force[place], p] += low + share * (high - low)
                low, high = now[before, last, p], now[before + 1, last, p]
                seen[entries.acted[place], p] += low + share * (high - low)


@inlined
def _remember(weights, trace, t, sums):  # type: ignore[no-untyped-def]
    """The cell's state after a step; sums: rows of both parts of its gates, to work with."""
    units = weights.state.shape[1]
    joined, gates = trace.joined, trace.gates[t]
    before = joined[max(t - 1, 0)]
    _multiply(weights.cell, weights.cell_bias, joined[t][units:], sums[0], 0)
    if t > 0:
        _multiply(weights.state, weights.state_bias, before[:units], sums[1], 0)
    else:
        for row in range(3 * units):
            store_row(sums[1], row, 0.0 * load_row(sums[0], row) + weights.state_bias[row])
    for unit in range(units):
        reset = _sigmoid(load_row(sums[0], unit) + load_row(sums[1], unit))
        update = _sigmoid(load_row(sums[0], units + unit) + load_row(sums[1], units + unit))
        part = load_row(sums[1], 2 * units + unit)
        new = _tanh(load_row(sums[0], 2 * units + unit) + reset * part)
        store_row(gates, unit, reset)
        store_row(gates, units + unit, update)
        store_row(gates, 2 * units + unit, new)
        store_row(gates, 3 * units + unit, part)
        following = (1.0 - update) * new
        if t > 0:
            following = following + update * load_row(before, unit)
        store_row(joined[t], unit, following)


@kernel
def forward(given, entries, weights, washout, trace, sums, averages, actuator):  # type: ignore[no-untyped-def]
    """Drive eight passes from their first step to their last by a network.

    sums: (2, 3 units, WIDTH), to work with; averages: (values, WIDTH) and actuator: (2, WIDTH), zero at
    first: of values, and the actuator's force and its average.
    """
    units = weights.state.shape[1]
    for t in range(given.actions.shape[0]):
        _move(given, trace, t)
        for v in range(averages.shape[0]):
            for p in range(WIDTH):
                averages[v, p] += entries.average[v] * (trace.moved[t, v, p] - averages[v, p])
                trace.now[t, v, p] = trace.moved[t, v, p] - averages[v, p]
        _observe(given, entries, trace, t)
        _multiply(weights.first, weights.first_bias, trace.entries[t], trace.joined[t], units)
        _activate(trace.joined[t], units, weights.relu)
        if units > 0:
            _remember(weights, trace, t, sums)
        values = trace.joined[t]
        for layer in range(len(weights.rest)):
            output = trace.rest[layer][t]
            _multiply(weights.rest[layer], weights.rest_bias[layer], values, output, 0)
            _activate(output, 0, weights.relu and layer < len(weights.rest) - 1)
            values = output
        for p in range(WIDTH):
            free = values[0, p] - actuator[1, p]
            left = min(max(free, -1.0), 1.0)
            trace.free[t, p], trace.taken[t, p] = free, left
            if washout.share > 0.0:
                ahead = left - actuator[0, p]
                distance = abs(ahead)
                by_rate = min(
                    max(distance - washout.rate * washout.lag, 0.0), washout.rate * washout.interval
                )
                nearer = 1.0
                if washout.lag > 0.0:
                    nearer = -math.expm1((by_rate / washout.rate - washout.interval) / washout.lag)
                trace.ahead[t, p] = ahead
                actuator[0, p] += math.copysign(by_rate + (distance - by_rate) * nearer, ahead)
                actuator[1, p] += washout.share * actuator[0, p]


@inlined
def _add_back(weights, slopes, into):  # type: ignore[no-untyped-def]
    """Add to rows of ``into``: transposed weights times slopes."""
    inputs, rows = weights.shape[1], weights.shape[0]
    for k in range(0, inputs - 3, 4):
        one, two = load_row(into, k), load_row(into, k + 1)
        three, four = load_row(into, k + 2), load_row(into, k + 3)
        for row in range(rows):
            slope = load_row(slopes, row)
            one = one + weights[row, k] * slope
            two = two + weights[row, k + 1] * slope
            three = three + weights[row, k + 2] * slope
            four = four + weights[row, k + 3] * slope
        store_row(into, k, one)
        store_row(into, k + 1, two)
        store_row(into, k + 2, three)
        store_row(into, k + 3, four)
    for k in range(inputs - inputs % 4, inputs):
        one = load_row(into, k)
        for row in range(rows):
            one = one + weights[row, k] * load_row(slopes, row)
        store_row(into, k, one)


@inlined
def _slope(value, relu):  # type: ignore[no-untyped-def]
    """Derivative of an activation where its result is ``value``."""
    if relu:
        return 1.0 if value > 0.0 else 0.0
    return 1.0 - value * value


@inlined
def _through_washout(washout, free, ahead, slope, carried, p):  # type: ignore[no-untyped-def]
    """Derivative by the requested action; slope: by the action; carried: by force and average after it."""
    if washout.share > 0.0:
        force, distance = carried[0, p] + washout.share * carried[1, p], abs(ahead)
        most = washout.rate * washout.interval
        beyond = distance - washout.rate * washout.lag
        by_rate = min(max(beyond, 0.0), most)
        by_distance, nearer = 1.0, 1.0
        if washout.lag > 0.0:
            kept = math.exp((by_rate / washout.rate - washout.interval) / washout.lag)
            nearer = 1.0 - kept
            by_distance = nearer
            if 0.0 < beyond < most:
                by_distance += kept - (distance - by_rate) * kept / (washout.rate * washout.lag)
        slope += by_distance * force
        carried[0, p] = force - by_distance * force
    inside = slope if -1.0 <= free <= 1.0 else 0.0
    if washout.share > 0.0:
        carried[1, p] -= inside
    return inside


@inlined
def _back_through_cell(weights, trace, t, by_joined, by_state, slopes):  # type: ignore[no-untyped-def]
    """From derivatives by the state after a step to those by the state before it, and by the first layer."""
    units = weights.state.shape[1]
    gates, cell, state = trace.gates[t], slopes.cell[t], slopes.state[t]
    for unit in range(units):
        for p in range(WIDTH):
            old = trace.joined[t - 1, unit, p] if t > 0 else 0.0
            reset, update = gates[unit, p], gates[units + unit, p]
            new, part = gates[2 * units + unit, p], gates[3 * units + unit, p]
            whole = by_joined[unit, p] + by_state[unit, p]
            by_new = whole * (1.0 - update) * (1.0 - new * new)
            by_reset = by_new * part * reset * (1.0 - reset)
            by_update = whole * (old - new) * update * (1.0 - update)
            cell[unit, p], cell[units + unit, p], cell[2 * units + unit, p] = by_reset, by_update, by_new
            state[unit, p], state[units + unit, p] = by_reset, by_update
            state[2 * units + unit, p] = by_new * reset
            by_state[unit, p] = whole * update
    _add_back(weights.state, state, by_state)
    _add_back(weights.cell, cell, by_joined[units:])


@kernel
def backward(  # type: ignore[no-untyped-def]
    given, entries, weights, washout, trace, by_force, by_taken, slopes, by_now, work
):
    """Derivatives by what each layer adds up, from those by force, (times, WIDTH), and by actions, likewise.

    by_taken and by_now, (times, values, WIDTH), are added to. work: arrays of zeros to work with.
    """
    by_entries, by_joined, by_state, by_average, carried = work
    units, last = weights.state.shape[1], len(weights.rest) - 1
    length, values = given.response.shape[2], trace.now.shape[1]
    for t in range(given.actions.shape[0] - 1, -1, -1):
        for p in range(WIDTH):
            free, output = trace.free[t, p], trace.rest[last][t, 0, p]
            requested = _through_washout(washout, free, trace.ahead[t, p], by_taken[t, p], carried, p)
            slopes.rest[last][t, 0, p] = requested * (1.0 - output * output)
        for layer in range(last, 0, -1):
            inner = slopes.rest[layer - 1][t]
            for row in range(inner.shape[0]):
                store_row(inner, row, 0.0 * load_row(inner, row))
            _add_back(weights.rest[layer], slopes.rest[layer][t], inner)
            for row in range(inner.shape[0]):
                for p in range(WIDTH):
                    inner[row, p] *= _slope(trace.rest[layer - 1][t, row, p], weights.relu)
        for row in range(by_joined.shape[0]):
            store_row(by_joined, row, 0.0 * load_row(by_joined, row))
        _add_back(weights.rest[0], slopes.rest[0][t], by_joined)
        if units > 0:
            _back_through_cell(weights, trace, t, by_joined, by_state, slopes)
        for row in range(weights.first.shape[0]):
            for p in range(WIDTH):
                slope = _slope(trace.joined[t, units + row, p], weights.relu)
                slopes.first[t, row, p] = by_joined[units + row, p] * slope
        for row in range(by_entries.shape[0]):
            store_row(by_entries, row, 0.0 * load_row(by_entries, row))
        _add_back(weights.first, slopes.first[t], by_entries)
        for ago in range(min(entries.now.shape[0], t + 1)):
            for v in range(values):
                for p in range(WIDTH):
                    by_now[t - ago, v, p] += by_entries[entries.now[ago, v], p]
        for place in range(entries.force.size):
            for p in range(WIDTH):
                before, share = given.before[t, place, p], given.share[t, place, p]
                if before >= 0:
                    by = by_entries[entries.force[place], p]
                    by_now[before, entries.of_force, p] += (1.0 - share) * by
                    by_now[before + 1, entries.of_force, p] += share * by
                    by = by_entries[entries.acted[place], p]
                    by_now[before, values - 1, p] += (1.0 - share) * by
                    by_now[before + 1, values - 1, p] += share * by
        for v in range(values):
            for p in range(WIDTH):
                by_average[v, p] -= by_now[t, v, p]
                by_now[t, v, p] += entries.average[v] * by_average[v, p]  # now by the change itself
                by_average[v, p] *= 1.0 - entries.average[v]
        for p in range(WIDTH):
            for v in range(values):
                by_now[t, v, p] *= given.unit[p, v]
            force = by_force[t, p] * given.unit[p, values]
            for k in range(min(t, length)):
                by = force * given.response[p, t, k, values]
                for v in range(values):
                    by += by_now[t, v, p] * given.response[p, t, k, v]
                by_taken[t - 1 - k, p] += by
