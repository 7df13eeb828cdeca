"""A network drives linear passes from their first step to their last; a vector has a number of each pass."""

from __future__ import annotations

import math

from panto_env.backend import WIDTH, inlined, kernel, larger, load_row, store_row


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
