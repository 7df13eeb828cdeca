"""What the guard around a policy does in each step: its rules, in the subset of Python that becomes C.

Plain Python runs these functions as they stand (``guarded.Guard``), and ``panto_agents.onboard`` translates
them for a controller on a train. So they keep to arithmetic, comparisons, if, for over range, local numbers,
arrays of fixed size. ``c`` holds constants, ``s`` the state, both by name.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

Constants: TypeAlias = Any
State: TypeAlias = Any
Whole: TypeAlias = Any
Number: TypeAlias = Any
"""What a function returns, for the translation: int, double."""

SENSORS = 5  # readings on the pantograph, the contact force last
SPEED = 6  # place of the train's speed (m/s) among the inputs
SAME = 5e-5
"""Difference of two readings, in the observation's scale, below which a sensor seems to stand still; more
where an entry changes with the speed."""
STANDS = 2  # control steps in a row without a change after which a reading is held
PATIENCE, RETURN = 1.2, 0.5
"""Time (s) for which readings are held before the command fades: the policy goes on with what it knew. Time
(s) for which they must move again before it comes back."""
LISTENING, LISTENING_SPANS = 2.0, 2.5
"""Time (s) and number of spans, the longer of both, at the start in which the pantograph is passive and is
listened to."""
WINDOW, SHORT_WINDOW = 1.5, 0.4  # time constants (s) of the means and variances that the monitor compares
SETTLED = 1.0  # time (s) of control, or without it at the start, after which the windows hold nothing else
CALM, HEARD = 1.5, 0.9
"""Time (s) after control has done harm in which its waves die out; time (s) of listening, after that, from
which on the spread counts as heard while passive."""
HARM, EARLY_HARM, SHORT_HARM = 1.0, 1.03, 1.2
"""Ratios of the force's standard deviation to that without control, by the model, above which it fades: after
``SETTLED``, before, and over the short window."""
SPREAD, SHORT_SPREAD = 1.1, 1.3
"""Ratios of the force's standard deviation, over the long window and the short one, to that last heard while
passive above which control fades, whatever the model says."""
PEAK = 1.3
"""Ratio of the force's distance from its mean to the largest one heard while passive above which it fades."""
CLAIM = 1.5
"""Ratio of the force's short spread without control, by the model, to that heard while passive, from which on
the force must vary less than it did while passive: else the model or the line is another one."""
SLIGHT = 0.05
"""Ratio of what control adds, by the model, to the spread heard while passive below which it does no harm."""
STRONG = 0.3
"""Ratio of what control adds, by the model, to the spread heard while passive, below which neither the short
window nor a single peak is control's doing."""
QUIET = 0.1
"""Ratio of the spread heard while passive to the nominal force below which there is nothing to calm."""
SHIFT, SHIFT_WINDOW = 0.03, 5.0
"""Share of the nominal force by which control may move the mean force, by the model; time constant of that
mean (s)."""
LOW = 0.2  # share of the nominal force below which the command may not take more away
FADE_OUT, FADE_IN, PROBE = 0.2, 0.5, 3.0
"""Times (s) in which the command fades out; in, after readings were held or a pause that showed no harm; and
in after any other pause, so slowly that harm is seen while it is small."""
HIGHEST = 20.0  # frequency (Hz) up to which the force's spread is compared, as in figures
PAUSE, GROWTH, LONGEST_PAUSE = 3.0, 4.0, 128.0
"""First time (s) that control pauses after harm, the factor from one pause to the next, and the longest."""
CALMER = 0.85
"""Ratio of the spread heard in a pause to that before, as it was or, by the model, without control, above
which it was no harm."""
GOOD = 20.0  # time (s) of control without harm after which the next pause is the first again
FASTER = 1.2
"""Ratio of speeds, of now and of when it last listened, from which on it listens anew. Up to it the spread
that it heard is taken to grow with the square of the speed."""
SHOWN = 9
"""Control steps whose readings, as shown, are kept."""
STANDSTILL = 1.0
"""Speed (m/s) below which places ahead in memory are not told apart by time."""
LONG_AGO = 1_000_000_000
"""Control steps, in place of a time without end."""


def begin_guard(c: Constants, s: State) -> None:
    """Begin passive, listening, with all sensors sound."""
    s.sound_for = LONG_AGO
    s.settles = SETTLED
    s.pause = PAUSE
    s.fade_in = PROBE
    s.heard = math.inf
    s.most = math.inf
    s.before = math.inf


def check_readings(c: Constants, s: State) -> None:
    """Hold readings that stand still or are exactly zero; take for unknown what memory has of such times."""
    any_bad = 0
    for k in range(SENSORS):
        read = float(s.seen[c.present[k]])
        s.shows[k] = read
        if s.begun == 1:
            if abs(read - (1.0 - c.guard_share) * s.last[k]) < c.same[k]:
                s.stood[k] = min(s.stood[k] + 1, LONG_AGO)
            else:
                s.stood[k] = 0
            bad = 0
            if s.stood[k] >= STANDS or abs(read - c.zero[k]) < 1e-6:
                bad = 1
                any_bad = 1
            if bad == 1 and s.stood[k] == STANDS and s.shown_steps > STANDS:
                replace_last_shown(c, s, k)
            if bad == 1:
                s.shows[k] = s.shown[0, k]
                s.shift[k] += c.guard_share * read
            else:
                s.shows[k] = read + s.shift[k]
                s.shift[k] += c.guard_share * (read - s.shows[k])
        s.last[k] = read
    s.fault_at = (s.fault_at + 1) % c.fault_steps
    s.faulty[s.fault_at] = any_bad
    if s.begun == 1:
        if any_bad == 1:
            s.held += c.interval
            s.sound_for = 0
        else:
            s.held = 0.0
            s.sound_for = min(s.sound_for + 1, LONG_AGO)
        show(c, s)
    for back in range(SHOWN - 1, 0, -1):
        for k in range(SENSORS):
            s.shown[back, k] = s.shown[back - 1, k]
    for k in range(SENSORS):
        s.shown[0, k] = s.shows[k]
    s.shown_steps = min(s.shown_steps + 1, SHOWN)
    if c.remembered > 0 and s.sound_for < c.fault_steps:
        forget_faulty_times(c, s)


def replace_last_shown(c: Constants, s: State, k: int) -> None:
    """A reading that begins to be held was wrong since it stands still: show what came before instead."""
    for back in range(STANDS):
        s.shift[k] += c.guard_share * s.shown[back, k]
        s.shown[back, k] = s.shown[STANDS, k]


def show(c: Constants, s: State) -> None:
    """Write what is shown into the observation, present and earlier."""
    if c.history > 0:
        for back in range(c.history):
            for k in range(SENSORS):
                s.seen[c.earlier[back, k]] = s.shown[min(back + 1, s.shown_steps) - 1, k]
    for k in range(SENSORS):
        s.seen[c.present[k]] = s.shows[k]


def forget_faulty_times(c: Constants, s: State) -> None:
    """Take for unknown what memory has of times in which a reading was faulty."""
    if s.input[SPEED] > STANDSTILL:
        per_step = c.interval * s.input[SPEED] / c.mean_length
        for n in range(c.remembered):
            steps = c.remembered_spans[n] / per_step - c.remembered_ahead[n]
            ago = int(math.floor(steps + 0.5))  # noqa: RUF046 - C's floor gives a double
            for k in range(max(ago - 3, 1), min(ago + 4, c.fault_steps + 1)):
                if s.faulty[(s.fault_at - k + 1 + c.fault_steps) % c.fault_steps] == 1:
                    off = nominal_force(c, s) - c.unknown_centre[n] - c.unknown_slope[n] * s.input[SPEED]
                    s.seen[c.remembered_entry[n]] = off * c.unknown_share[n]


def act_within_guard(c: Constants, s: State) -> None:
    """Multiply the action by the gate; where the force is low, take no more of it away."""
    force = shown_force(c, s)
    added = added_by_control(c, s)
    if s.held == 0.0:
        add(c, s, force, added)
    speed = max(s.input[SPEED], STANDSTILL)
    if s.begun == 0:
        s.heard_at = speed
        s.waits = max(LISTENING, LISTENING_SPANS * c.mean_length / speed)
    if s.waits > 0.0 and s.before > 0.0 and s.passive_for < s.settles:
        s.before = max(s.before, spread(c, s, 0, 0))  # the waves of harm are part of it
    listen_while_passive(c, s, speed)
    pause_or_not(c, s, speed)
    heard_for = s.passive_for - s.settles
    ends = s.waits > 0.0 and s.waits <= c.interval
    if ends and s.before > 0.0 and heard_for > HEARD and s.heard > CALMER * s.before:
        s.pause = PAUSE  # it was no better without
        s.fade_in = FADE_IN
    if s.held == 0.0 or math.isfinite(s.heard):
        s.waits = max(s.waits - c.interval, 0.0)
    if s.waits > 0.0:
        s.gate = max(s.gate - c.interval / FADE_OUT, 0.0)
    elif s.held == 0.0:  # it comes back by what is read now
        s.gate = min(s.gate + c.interval / s.fade_in, 1.0)
    for a in range(c.actions):
        if c.knows_force and force < LOW * nominal_force(c, s) and added < 0.0:
            s.action[a] = max(s.action[a], 0.0)
        s.action[a] = s.gate * s.action[a]


def added_by_control(c: Constants, s: State) -> Number:
    """Contact force (N) that the commands so far have added, by a model of pantograph and mean line."""
    added = 0.0
    for a in range(c.actions):
        command = s.past[a] * c.force_limit
        for i in range(c.states):
            following = c.model_b[a, i] * command
            for j in range(c.states):
                following += c.model_a[a, i, j] * s.model[a, j]
            s.following_model[i] = following
        for i in range(c.states):
            s.model[a, i] = s.following_model[i]
            added += c.model_c[a, i] * s.model[a, i]
    return added


def add(c: Constants, s: State, force: float, added: float) -> None:
    """Add a step to means and variances: of the force, of it without control, and of what control adds."""
    s.now[0] = force
    s.now[1] = force - added
    s.now[2] = added
    for n in range(3):
        if s.heard_any == 0:
            s.means[0, n] = s.now[n]
            s.means[1, n] = s.now[n]
            s.filter[0, n] = c.at_rest[0] * s.now[n]
            s.filter[1, n] = c.at_rest[1] * s.now[n]
        passed = c.low_pass_b[0] * s.now[n] + s.filter[0, n]
        s.filter[0, n] = c.low_pass_b[1] * s.now[n] - c.low_pass_a[1] * passed + s.filter[1, n]
        s.filter[1, n] = c.low_pass_b[2] * s.now[n] - c.low_pass_a[2] * passed
        if n == 0:
            s.deviation = passed - s.means[0, 0]
        for w in range(2):
            s.means[w, n] += c.shares[w] * (passed - s.means[w, n])
            off = passed - s.means[w, n]
            s.squares[w, n] += c.shares[w] * (off * off - s.squares[w, n])
    s.heard_any = 1
    s.mean_added += c.shares[2] * (added - s.mean_added)


def spread(c: Constants, s: State, window: int, what: int) -> Number:
    """Standard deviation (N) over a window: 0 as it is, 1 without control, 2 what control adds."""
    return math.sqrt(max(s.squares[window, what], 1e-9))


def listen_while_passive(c: Constants, s: State, speed: float) -> None:
    """Hear, while passive, how much the force varies; count how long control has acted."""
    if s.gate > 0.0:
        s.passive_for = 0.0
    elif s.held == 0.0:
        s.passive_for += c.interval
    calm_for = s.passive_for - s.settles
    if calm_for <= 0.0:
        s.listened = 0.0
        s.quiet = 0.0
    elif s.held == 0.0:
        s.listened = max(s.listened, abs(s.deviation))
        share = max(c.shares[0], c.interval / max(calm_for, c.interval))
        s.quiet += share * (s.deviation * s.deviation - s.quiet)
        if calm_for > HEARD:
            s.heard = math.sqrt(s.quiet)
            s.heard_at = speed
            s.most = s.listened
    if s.gate == 1.0:
        s.acted_for += c.interval
    else:
        s.acted_for = 0.0
    if s.acted_for > GOOD:
        s.pause = PAUSE


def pause_or_not(c: Constants, s: State, speed: float) -> None:
    """Whether control pauses: readings are held, the mean moves, it does harm, or the speed is another."""
    if s.held > PATIENCE:
        if s.waits == 0.0:
            s.fade_in = FADE_IN
        s.waits = max(s.waits, RETURN)
    elif s.gate > 0.0 and s.waits == 0.0:
        nominal = nominal_force(c, s)
        if abs(s.mean_added) > SHIFT * nominal or s.heard < QUIET * nominal:
            s.before = 0.0
            s.waits = PAUSE
            s.fade_in = PROBE
        elif does_harm(c, s, speed) == 1:
            s.before = max(spread(c, s, 0, 0), spread(c, s, 0, 1))
            s.waits = s.pause
            s.fade_in = PROBE
            s.pause = min(GROWTH * s.pause, LONGEST_PAUSE)
            s.settles = CALM
        elif speed >= FASTER * s.heard_at or s.heard_at >= FASTER * speed:
            s.before = 0.0
            s.waits = PAUSE
            s.fade_in = FADE_IN


def does_harm(c: Constants, s: State, speed: float) -> Whole:
    """1 where the force varies more than it would without control, or did, or is farther off; else 0."""
    added = spread(c, s, 1, 2)
    if max(added, spread(c, s, 0, 2)) < SLIGHT * s.heard:
        return 0
    lately = spread(c, s, 1, 0)
    ratio = max(1.0, speed / s.heard_at)
    heard = s.heard * ratio * ratio
    harm = EARLY_HARM
    if s.acted_for > SETTLED:  # what was heard at first is of waves that still build up
        harm = HARM
        if spread(c, s, 0, 0) > SPREAD * heard:
            return 1
    if spread(c, s, 0, 0) > harm * spread(c, s, 0, 1) or lately > SHORT_HARM * spread(c, s, 1, 1):
        return 1
    if added > STRONG * s.heard:  # else it is not of control
        if lately > SHORT_SPREAD * heard or abs(s.deviation) > PEAK * s.most * ratio * ratio:
            return 1
        if lately > heard and spread(c, s, 1, 1) > CLAIM * heard:
            return 1
    return 0


def nominal_force(c: Constants, s: State) -> Number:
    """Static force and aerodynamic uplift in still air at the speed read (N); beyond a table its last one."""
    force = c.static_force + c.aerodynamic * s.input[SPEED] * s.input[SPEED]
    if c.uplift_points > 0:
        force = force + c.uplift[0]
        for k in range(c.uplift_points - 1):
            wide = c.uplift_speed[k + 1] - c.uplift_speed[k]
            into = min(max(s.input[SPEED] - c.uplift_speed[k], 0.0), wide)
            force = force + into * (c.uplift[k + 1] - c.uplift[k]) / wide
    return force


def shown_force(c: Constants, s: State) -> Number:
    """Contact force (N) that the observation shows, or its deviation from its average."""
    shown = float(s.seen[c.force_entry])
    if c.of_nominal:
        return nominal_force(c, s) * (1.0 + c.force_scale * shown)
    return c.force_centre + c.force_slope * s.input[SPEED] + c.force_scale * shown
