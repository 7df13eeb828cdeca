"""Repetitive control: the span's harmonics, cancelled as the contact force teaches them.

A part of the on-board controller's description; see ``seeing`` for its form. Rules and constants are those of
``panto_baselines.policies.repetitive``. The response of the contact force to a command, which the speed
decides, is a sum over the modes of the same linear model.
"""

from __future__ import annotations

import math

from panto_baselines.policies.guard_rules import (
    SPEED,
    STANDSTILL,
    Constants,
    Number,
    State,
    shown_force,
)
from panto_baselines.policies.repetitive import (
    ANOTHER,
    BACK_OFF,
    HIGHEST,
    LISTENING,
    OVER,
    PEAKS,
    RECOVERY,
    SMOOTHED,
    TOLERATED,
)

from .seeing import PLACE, sine_of_turns


def act_by_learning(c: Constants, s: State) -> Number:
    """Force (N) that cancels what earlier spans had in common; it is learnt span by span."""
    follow_speed(c, s)
    force = shown_force(c, s)
    if s.begun == 0:
        s.force_average = force
    s.force_average += s.force_share * (force - s.force_average)
    error = force - s.force_average
    place = s.input[PLACE]
    if c.counts:
        s.counted += s.input[SPEED] * c.interval / c.mean_length
        s.counted -= math.floor(s.counted)
        place = s.counted
    for k in range(s.harmonics):
        turns = (k + 1.0) * place
        s.turn[0, k] = sine_of_turns(turns + 0.25)
        s.turn[1, k] = sine_of_turns(turns)
    own = 0.0
    for i in range(c.line_states):
        own += c.line_c[i] * s.line[i]
    judge_span(c, s, error, error - own)
    if s.spans >= LISTENING:
        learn(c, s, s.trust * error)
    learnt = 0.0
    for k in range(s.harmonics):
        learnt += s.learnt[0, k] * s.turn[0, k] - s.learnt[1, k] * s.turn[1, k]
    return learnt


def model_force(c: Constants, s: State, force: float) -> None:
    """Go on with the model of pantograph and mean line under a command (N)."""
    for i in range(c.line_states):
        s.following_line[i] = c.line_b[i] * force
        for j in range(c.line_states):
            s.following_line[i] += c.line_a[i, j] * s.line[j]
    for i in range(c.line_states):
        s.line[i] = s.following_line[i]


def follow_speed(c: Constants, s: State) -> None:
    """Learn on at the measured speed where it is another one; what the first spans told is of no use then."""
    if s.begun == 0:
        s.measured_speed = max(s.input[SPEED], STANDSTILL)
        s.trust = 1.0
        tune(c, s)
        s.force_share = 1.0 - math.exp(-s.span_share)  # for all speeds, as in the environment
    s.measured_speed += c.interval / SMOOTHED * (s.input[SPEED] - s.measured_speed)
    if s.measured_speed >= STANDSTILL and abs(s.measured_speed / s.learns_at - 1.0) > ANOTHER:
        s.first_spans = math.inf
        s.first_count = 1.0
        tune(c, s)


def tune(c: Constants, s: State) -> None:
    """Set all that depends on the speed: the harmonics, and how fast each is learnt.

    s.towards is what the present error, times the turn's conjugate, changes of what is learnt.
    """
    s.learns_at = s.measured_speed
    rate = s.learns_at / c.mean_length
    s.span_share = c.interval * rate
    count = int(max(1.0, min(HIGHEST / rate, float(c.most_harmonics))))
    for k in range(count, s.harmonics):
        s.learnt[0, k] = 0.0
        s.learnt[1, k] = 0.0
    s.harmonics = count
    for k in range(count):
        frequency = (k + 1.0) * rate
        real = 0.0
        imaginary = 0.0
        for m in range(c.line_modes):  # residue / (i frequency - pole), both in Hz
            over_real = -c.pole[0, m]
            over = frequency - c.pole[1, m]
            square = over_real * over_real + over * over
            real += (c.residue[0, m] * over_real + c.residue[1, m] * over) / square
            imaginary += (c.residue[1, m] * over_real - c.residue[0, m] * over) / square
        late = frequency * c.line_delay
        cosine = sine_of_turns(0.25 - late)
        sine = sine_of_turns(-late)
        square = real * real + imaginary * imaginary
        factor = 2.0 * s.span_share * c.learning / (square + c.response * c.response)
        s.towards[0, k] = factor * (real * cosine - imaginary * sine)
        s.towards[1, k] = -factor * (real * sine + imaginary * cosine)


def learn(c: Constants, s: State, error: float) -> None:
    """Change what is learnt by an error (N); forces whose peak the actuator cannot reach are scaled down."""
    kept = 1.0 - s.span_share * c.forgetting
    total = 0.0
    for k in range(s.harmonics):
        real = s.towards[0, k] * s.turn[0, k] + s.towards[1, k] * s.turn[1, k]
        imaginary = s.towards[1, k] * s.turn[0, k] - s.towards[0, k] * s.turn[1, k]
        s.learnt[0, k] = kept * s.learnt[0, k] - error * real
        s.learnt[1, k] = kept * s.learnt[1, k] - error * imaginary
        total += math.sqrt(s.learnt[0, k] * s.learnt[0, k] + s.learnt[1, k] * s.learnt[1, k])
    limit = OVER * c.force_limit
    if total > limit:
        peak = limit
        for p in range(PEAKS):
            force = 0.0
            for k in range(s.harmonics):
                turns = (k + 1) * p % PEAKS
                sine = c.sine[turns]
                cosine = c.sine[(turns + PEAKS // 4) % PEAKS]
                force += s.learnt[0, k] * cosine - s.learnt[1, k] * sine
            peak = max(peak, abs(force))
        for k in range(s.harmonics):
            s.learnt[0, k] = s.learnt[0, k] * (limit / peak)
            s.learnt[1, k] = s.learnt[1, k] * (limit / peak)


def judge_span(c: Constants, s: State, error: float, without: float) -> None:
    """Add a step; at the end of a span judge it, but the first ones, which are passive, to compare with."""
    s.sums[0] += error
    s.sums[1] += error * error
    s.sums[2] += without
    s.sums[3] += without * without
    s.sum_steps += 1.0
    before = s.spans
    s.spans += s.span_share
    if math.floor(s.spans) != math.floor(before):
        measured = span_deviation(c, s, 0)
        if s.spans >= LISTENING + 1.0:
            trust_or_not(c, s, measured)
        elif s.spans >= 2.0:
            s.first_spans += measured
            s.first_count += 1.0
        for k in range(4):
            s.sums[k] = 0.0
        s.sum_steps = 0.0


def trust_or_not(c: Constants, s: State, measured: float) -> None:
    """Halve what is learnt, and how fast, after a span that was worse than without control."""
    factor = RECOVERY
    if measured > span_deviation(c, s, 2) or measured * s.first_count > TOLERATED * s.first_spans:
        factor = BACK_OFF
        for k in range(s.harmonics):
            s.learnt[0, k] = BACK_OFF * s.learnt[0, k]
            s.learnt[1, k] = BACK_OFF * s.learnt[1, k]
    s.trust = min(1.0, s.trust * factor)


def span_deviation(c: Constants, s: State, first: int) -> Number:
    """Standard deviation (N) over the span's steps, from the sums of values and of their squares."""
    mean = s.sums[first] / s.sum_steps
    return math.sqrt(max(s.sums[first + 1] / s.sum_steps - mean * mean, 0.0))
