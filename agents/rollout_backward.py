"""Derivatives of ``rollout_forward``: its adjoint, line by line in reverse.

They are exact: tests/agents/test_rollout.py has them from torch.
"""

from __future__ import annotations

import math

from panto_env.backend import WIDTH, inlined, kernel, load_row, store_row


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
