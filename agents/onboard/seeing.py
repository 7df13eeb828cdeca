"""From raw readings to the scaled observation of a policy: the first part of the on-board controller.

This module, ``acting``, ``learning`` and ``panto_baselines.policies.guard_rules`` describe the controller
once. Plain Python runs them as they stand (``Controller``), and ``translate`` turns the same functions into
C99. So they keep to a small subset of Python: arithmetic, comparisons, if, for over range, while, local
numbers, arrays of fixed size. ``c`` holds constants, ``s`` the state, both by name; ``r`` the readings of a
step. A branch whose condition holds constants alone is decided when it is translated: a controller has only
the parts that its policy needs.

The environment does the same to its own readings (``panto_env.control.observation``, ``memory``); the tests
compare the two step by step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

from panto_baselines.policies.guard_rules import (
    SENSORS,
    SPEED,
    Constants,
    Number,
    State,
    Whole,
    nominal_force,
)
from panto_env.backend.compile import python_function
from panto_env.control.memory import BEFORE
from panto_env.control.observation import BOUND
from panto_env.plant import functions

Readings = Sequence[float]
Single: TypeAlias = Any
"""What a function returns, for the translation: float."""

FORCE, PLACE = SENSORS - 1, SENSORS
FURTHER = SPEED + 1
"""Places of contact force and place along the line among the inputs; first of those after the speed."""
sine_of_turns = python_function(functions.sine_of_turns)
"""The environment's own function of it, in plain Python."""
LARGEST = 1e6
"""Magnitude above which a reading is none, in any unit; up to it no computation here overflows."""
READING, TURN, TRAIN_SPEED, AHEAD, DEVIATION, NOMINAL, PAST, PAST_DEVIATION = range(8)
"""What an entry of the observation shows: see ``entry``."""


def see(c: Constants, s: State) -> None:
    """Write the observation of this step into s.seen, within its bounds."""
    for k in range(SENSORS):
        s.reading[k] = s.input[k]
    if c.averaged:
        take_averages_off(c, s)
    if c.front > 0:
        for k in range(c.front):
            s.ahead[k] = s.input[FURTHER + k]
    if c.memory_spans > 0:
        keep_and_recall(c, s)
    if c.history > 0 and s.begun == 0:
        for back in range(c.history):
            write_history(c, s, back)
    for k in range(c.entries):
        centre = c.centre[k] + c.slope[k] * s.input[SPEED]
        s.seen[k] = min(BOUND, max(-BOUND, (entry(c, s, k) - centre) * c.per_unit[k]))
    if c.history > 0:
        remember(c, s)


def take_readings(c: Constants, s: State, r: Readings) -> Whole:
    """Take the readings; 1 once each of them has been good, else 0.

    One that is no finite number, or absurdly large, stays at its last good value.
    """
    all_known = 1
    for k in range(c.inputs):
        if math.isfinite(r[k]) and abs(r[k]) <= LARGEST:
            s.input[k] = r[k]
            s.known[k] = 1
        if s.known[k] == 0:
            all_known = 0
    return all_known


def take_averages_off(c: Constants, s: State) -> None:
    """Turn readings into deviations from their slow averages, which begin at the first readings."""
    for k in range(SENSORS):
        if s.begun == 0:
            s.average[k] = s.reading[k]
        else:
            s.average[k] += c.average_share * (s.reading[k] - s.average[k])
        s.reading[k] -= s.average[k]


def keep_and_recall(c: Constants, s: State) -> None:
    """Keep place, force and last actions of this step; recall those of earlier spans at the places ahead.

    A place looked up lies between those of two steps; the force and the actions between theirs.
    """
    s.kept[s.time, 0] = s.input[PLACE]
    s.kept[s.time, 1] = s.reading[FORCE]
    for a in range(c.actions):
        s.kept[s.time, 2 + a] = s.past[a]
    per_step = s.input[SPEED] * c.interval / c.mean_length
    for span in range(c.memory_spans):
        # The farthest place first: from there to the nearest the search goes back only.
        ago = 0
        for place in range(c.memory_places - 1, -1, -1):
            sought = s.input[PLACE] + per_step * c.steps_ahead[place] - (span + 1.0)
            while ago < c.memory_steps - 2 and s.kept[steps_back(c, s, ago), 0] > sought:
                ago += 1
            later = steps_back(c, s, max(ago - 1, 0))
            earlier = steps_back(c, s, ago)
            way = s.kept[later, 0] - s.kept[earlier, 0]
            share = 0.0
            if way > 0.0 and way < 1.0:
                share = min(max((s.kept[later, 0] - sought) / way, 0.0), 1.0)
            for k in range(1 + c.actions):
                number = (k * c.memory_spans + span) * c.memory_places + place
                now = s.kept[later, 1 + k]
                s.ahead[c.front + number] = now + share * (s.kept[earlier, 1 + k] - now)
    s.time = (s.time + 1) % c.memory_steps


def steps_back(c: Constants, s: State, ago: int) -> Whole:
    """Row of what was kept a number of steps ago, 0 for this step."""
    return (s.time - ago + c.memory_steps) % c.memory_steps


def forget_earlier_spans(c: Constants, s: State) -> None:
    """Begin with nothing kept: before every place that is looked up."""
    for n in range(c.memory_steps):
        s.kept[n, 0] = BEFORE


def remember(c: Constants, s: State) -> None:
    """Insert readings and actions as the latest of the history."""
    for k in range((c.history - 1) * (SENSORS + c.actions) - 1, -1, -1):
        s.past[c.actions + SENSORS + c.actions + k] = s.past[c.actions + k]
    write_history(c, s, 0)


def write_history(c: Constants, s: State, back: int) -> None:
    """Write readings and actions into the history; back: its place there, 0 for the latest."""
    first = c.actions + back * (SENSORS + c.actions)
    for k in range(SENSORS):
        s.past[first + k] = s.reading[k]
    for a in range(c.actions):
        s.past[first + SENSORS + a] = s.past[a]


def entry(c: Constants, s: State, k: int) -> Number:
    """Physical value of entry k of the observation, in its unit."""
    source = c.source[k]
    number = c.number[k]
    if source == READING:
        return s.reading[number]
    if source == TURN:  # sine and cosine of the place within the span, and their harmonics
        return c.sight * sine_of_turns(float(number // 2) * s.input[PLACE] + 0.25 * float(number % 2))
    if source == TRAIN_SPEED:
        return s.input[SPEED]
    if source == AHEAD:
        return s.ahead[number]
    if source == DEVIATION:
        return s.reading[FORCE] / nominal_force(c, s) - 1.0
    if source == NOMINAL:
        return nominal_force(c, s)
    if source == PAST:
        return s.past[number]
    return s.past[number] / nominal_force(c, s) - 1.0
