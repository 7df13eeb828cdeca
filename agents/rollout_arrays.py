"""Arrays of the kernels that drive a network through linear passes; ``WIDTH`` passes go abreast."""

from __future__ import annotations

from typing import Any, NamedTuple

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
    """Of actions, as in ``panto_baselines.policies.washout``; share 0: none."""

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
