"""The armature and its current loop over one step, in closed form.

L di/dt = u - R i - k_t (speed of the shaft). The drive controls the current by a PI law whose zero cancels
the armature's pole, with the back-EMF fed forward: u = R i + EMF + L a (i* - i), so that di/dt = a (i* - i)
with the bandwidth a. Where that exceeds the maximum voltage, the drive gives the maximum; the reference i*
never exceeds the current that this voltage can hold at the present speed, so the integrator does not wind
up. In terms of the force e = K i (N), with D the damping of shorted motors, w the speed at mid-step, U the
stall force and T = L / R:

    at the maximum voltage  T de/dt = b - e,  b = +-U - D w        below it  de/dt = a (e* - e)

After a change of the reference the voltage is at its maximum first, if at all, and then below it: b is the
bound on the side of the reference, and the phases meet at e_s = (a T e* - b) / (a T - 1).
"""

from __future__ import annotations

import math

from ....backend import inlined

SMALL = 1e-9
"""Difference from the bound (N) that counts as zero."""


@inlined
def decay(x, halvings):
    """Exp(-x) for x >= 0: Pade's approximant at x / 2^halvings, which is at most 1/4, squared repeatedly."""
    y = x * 0.5**halvings
    half, twelfth = 0.5 * y, y * y * (1.0 / 12.0)
    result = (1.0 - half + twelfth) / (1.0 + half + twelfth)
    for _ in range(halvings):
        result = result * result
    return result


@inlined
def age(left, halvings):
    """-log(left) for a remaining share above 0: the series of atanh at its 2^halvings-th root."""
    y = left
    for _ in range(halvings):
        y = math.sqrt(y)
    z = (1.0 - y) / (1.0 + y)
    square = z * z
    series = 1.0 + square * (1 / 3 + square * (1 / 5 + square * (1 / 7 + square * (1 / 9))))
    return 2.0 * 2.0**halvings * z * series


@inlined
def clip(x, lowest, highest):
    """X limited to [lowest, highest]."""
    return min(highest, max(lowest, x))


@inlined
def follow(motors, force, requested, coasting, gain):
    """Force of the motors (N) over a step under a requested force, from ``force`` at the step's start.

    coasting: speed at mid-step without the motors' force (m/s), to which a steady 1 N adds ``gain`` (m/s/N).
    Each bound holds at the speed that a step at its voltage leads to, so that light rotors with a strong
    back-EMF are stable at any time step. Returns the force at the step's end, its mean, and the mean of its
    square (N^2).
    """
    step, lag, rate, lead = motors.time_step, motors.armature_time, motors.bandwidth, motors.lead
    damping, old = motors.shorted_damping * gain, motors.armature_mean
    drop, yielding = motors.shorted_damping * coasting, 1.0 / (1.0 + damping * (1.0 - old))
    drop = drop + damping * old * force
    highest, lowest = (motors.stall_force - drop) * yielding, (-motors.stall_force - drop) * yielding
    target = clip(requested, lowest, highest)
    bound = highest if target >= force else lowest
    turn = (lead * target - bound) * (1.0 / (lead - 1.0))
    turn = max(force, turn) if target >= force else min(force, turn)
    # At the maximum voltage, towards the bound, until the turn or the end of the step.
    away = force - bound
    left = 1.0 if abs(away) < SMALL else (turn - bound) / away
    saturated = step
    if left <= motors.armature_left:
        left = motors.armature_left
    else:
        saturated = lag * age(left, motors.age_halvings)
    reached = bound + left * away
    gone = lag * (1.0 - left)
    impulse = bound * saturated + gone * away
    square = bound * bound * saturated + gone * away * (2.0 * bound + 0.5 * away * (1.0 + left))
    # Then below it, towards the reference.
    rest = max(0.0, step - saturated)
    last = decay(rate * rest, motors.decay_halvings)
    away = reached - target
    gone = (1.0 - last) * (1.0 / rate)
    impulse += target * rest + gone * away
    square += target * target * rest + gone * away * (2.0 * target + 0.5 * away * (1.0 + last))
    return target + last * away, impulse * (1.0 / step), square * (1.0 / step)
