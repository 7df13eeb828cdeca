"""A guard around any policy: readings that cannot be are held, and a command that does harm fades to passive.

In the literature such a guard is a simplex architecture, or run-time assurance (Seto and Sha, "An engineering
method for safety region development", CMU/SEI-99-TR-018, 1999): a simple and trusted controller, here none at
all, takes over where a monitor sees a better performing one leave what is safe.
"""

from __future__ import annotations

import math
import re
from collections import deque
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from panto_env.control.entries import (
    AVERAGED,
    CENTRED,
    DEVIATION,
    DEVIATIONS,
    FORCE_DEVIATION,
    READING_ENTRIES,
    earlier,
)
from panto_env.control.observation import Context
from panto_env.policies import find_policy, wishes

from .line_model import DELAY, LAG, Sampled, line_model, mean_line

Array = NDArray[np.float64]
Observation = NDArray[np.float32]

SAME = 5e-5
"""Difference of two readings, in the observation's scale, below which a sensor seems to stand still."""
STANDS = 2  # control steps in a row without a change after which a reading is held
PATIENCE, RETURN = 1.2, 0.5
"""Time (s) for which readings are held before the command fades: the policy goes on with what it knew. Time
(s) for which they must move again before it comes back."""
LISTENING, LISTENING_SPANS = 2.0, 2.5
"""Time (s) and number of spans, the longer of both, at the start in which the pantograph is passive and is
listened to."""
WINDOW, SHORT_WINDOW = 1.5, 0.4  # time constants (s) of the means and variances that the monitor compares
FORCES = ("contact force", "force deviation", f"contact force{DEVIATION}")
"""Names of the entry that has the contact force, by kind of observation."""
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


class Guarded:
    """A policy whose readings are checked, and whose command fades to passive where it does harm.

    Rules, each with a constant above:

    - a reading that stands still, or is exactly zero, is held at its last value; what memory shows of
      that time is taken for unknown. After ``PATIENCE`` the command fades out, until the reading has moved
      again for ``RETURN``.
    - from a model of pantograph and mean line (``line_model``) and the command that was given, it knows what
      control has added to the contact force. If the force would vary less without (``HARM``), the command
      fades out.
    - so it does where the force varies more than it did while passive (``SPREAD``), which needs no model,
      where it is farther off than it was then (``PEAK``), and where the mean force is moved (``SHIFT``).
    - if by the model it would vary far more without control than it did while passive (``CLAIM``), but varies
      no less than then, one of the two is wrong: it fades, and listens.
    - where the force hardly varies while passive, it stays passive (``QUIET``).
    - where the force is low and control has taken some away, the command takes no more (``LOW``).

    It comes back by itself after a pause, in which it listens when the waves of control have died out
    (``CALM``). If the force varied less then than before, control did harm, and the next pause is longer; if
    not, the line or the speed has changed, and the next is as short as the first. Where the speed is another
    one (``FASTER``), it pauses and listens anew.
    """

    AROUND_ANOTHER = True  # the other's name follows its own: "guarded:pd"

    def __init__(self, policy: str, delay: float = DELAY, lag: float = LAG) -> None:
        """policy: its name, as a benchmark takes it. delay of actuator and sensors together, lag of the
        actuator: s.

        Raises InputError where the policy does not exist.
        """
        self.policy, self.delays = find_policy(policy), (delay, lag)
        vars(self).update({"observation": "measured"} | wishes(self.policy))

    def reset(self, context: Context) -> None:
        """Prepare for an episode. Raises InputError for a line without wires."""
        self.policy.reset(context)
        self._guard = Guard(context, *self.delays)

    def act(self, observation: Observation) -> Array:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        seen = self._guard.checked(observation)
        return self._guard.limited(self.policy.act(seen))


class GuardedEnv(gymnasium.Wrapper[Observation, Any, Observation, Any], RecordConstructorArgs):
    """An environment behind the guard: who acts in it sees held readings, and actions fade that do harm.

    ``info["gate"]`` is the factor of the last action, 0 to 1. Rewards are those of what was done. For one
    pantograph: ``gymnasium.make_vec`` with ``vectorization_mode="sync"`` takes it among its ``wrappers``.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], delay: float = DELAY, lag: float = LAG) -> None:
        """delay, lag: as ``Guarded`` takes them."""
        RecordConstructorArgs.__init__(self, delay=delay, lag=lag)
        gymnasium.Wrapper.__init__(self, env)
        self._delays = delay, lag

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Begin an episode; as the environment's own."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._guard = Guard(self.get_wrapper_attr("context"), *self._delays)
        return self._guard.checked(observation), info | {"gate": 0.0}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """One control step; as the environment's own."""
        limited = self._guard.limited(action).astype(np.float32)
        observation, reward, terminated, truncated, info = self.env.step(limited)
        seen = self._guard.checked(observation)
        return seen, reward, terminated, truncated, info | {"gate": self._guard.gate}


class Guard:
    """The guard of one pantograph in an episode: in each control step what is seen, then what may be done."""

    def __init__(self, context: Context, delay: float, lag: float) -> None:
        self.readings = Readings(context)
        self.monitor = Monitor(context, delay, lag)

    def checked(self, observation: Observation) -> Observation:
        """The observation with held values for those that cannot be."""
        self._seen = self.readings.checked(observation)
        return self._seen

    def limited(self, action: Any) -> Array:
        """Action, (actions,), each in -1..1, as far as it may be done after what was seen last."""
        given = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        gate = self.monitor(self._seen, self.readings)
        if self.monitor.low:
            given = np.maximum(given, 0.0)
        return np.asarray(gate * given)

    @property
    def gate(self) -> float:
        """Factor of the last action, 0 to 1."""
        return self.monitor.gate


class Readings:
    """The readings of an observation: which are plausible, and what is shown instead of the others."""

    def __init__(self, context: Context) -> None:
        layout, interval = context.layout, context.control_interval
        names = [entry.name for entry in layout.entries]
        ending = DEVIATION if layout.kind == DEVIATIONS else ""
        own = [f"{name}{ending}" for name, _, _ in READING_ENTRIES]
        if layout.kind == CENTRED:
            own[-1] = "force deviation"
        self.present = np.array([names.index(name) for name in own])
        self.force = int(self.present[-1])
        self.past = [
            np.array([names.index(earlier(name, k)) for name in own]) for k in range(1, layout.history + 1)
        ]
        entries = [layout.entries[place] for place in self.present]
        zeros = [
            (-1.0 / FORCE_DEVIATION if e.name == "force deviation" else -e.centre / e.scale) for e in entries
        ]
        self.zero = np.full(len(own), np.inf) if ending else np.array(zeros)
        self.share = 1 - math.exp(-interval / AVERAGED) if ending else 0.0  # of an average, in a step
        self.memory = [
            (place, int(span.split()[0]), float(ahead.split()[0]) / interval)
            for place, name in enumerate(names)
            if name.startswith("remembered force")
            for _, span, ahead in [name.split(", ")]
        ]
        self._per_step = interval * context.speed / context.alignment.mean_length  # spans
        self.unknown = 0.0 if layout.kind in (CENTRED, DEVIATIONS) else context.nominal_force / 100.0
        self._last: Array | None = None  # as read
        self._shown: list[Array] = []  # the newest last
        self._stood = np.zeros(len(own), dtype=int)
        self._shift = np.zeros(len(own))  # of slow averages, by what was read while a sensor was faulty
        self._faulty: deque[bool] = deque(maxlen=4000)
        self._sound_for = math.inf  # control steps since one was faulty
        self.held = 0.0  # time for which any has been held (s)
        self._interval = interval

    def checked(self, observation: Observation) -> Observation:
        """The observation with held values for those that cannot be."""
        read = observation[self.present].astype(float)
        seen = observation.copy()
        if self._last is None:
            self._last, self._shown = read, [read]
            self._faulty.append(False)
            return seen
        still = np.abs(read - (1 - self.share) * self._last) < SAME
        self._stood = np.where(still, self._stood + 1, 0)
        bad = (self._stood >= STANDS) | (np.abs(read - self.zero) < 1e-6)
        # One that begins to be held has shown what is wrong since it stands still: its last value is before.
        begins = bad & (self._stood == STANDS) & (len(self._shown) > STANDS)
        for back in range(1, STANDS + 1) if begins.any() else ():
            wrong, right = self._shown[-back], self._shown[-1 - STANDS]
            self._shift += np.where(begins, self.share * wrong, 0.0)
            self._shown[-back] = np.where(begins, right, wrong)
        shown = np.where(bad, self._shown[-1], read + self._shift)
        # The environment's averages go on with what was read, these stay where they are while it is held.
        self._shift += self.share * (read - np.where(bad, 0.0, shown))
        self._last = read
        self._faulty.append(bool(bad.any()))
        self.held = self.held + self._interval if bad.any() else 0.0
        self._sound_for = 0 if bad.any() else self._sound_for + 1
        for k, past in enumerate(self.past, start=1):
            seen[past] = self._shown[-min(k, len(self._shown))]
        seen[self.present] = shown
        self._shown = [*self._shown[-8:], shown]
        # What memory has of times in which a reading was faulty is taken for unknown.
        for place, spans, ahead in self.memory if self._sound_for < len(self._faulty) else ():
            ago = round(spans / self._per_step - ahead)
            if any(self._faulty[-k] for k in range(max(ago - 3, 1), min(ago + 3, len(self._faulty)) + 1)):
                seen[place] = self.unknown
        return seen


class Monitor:
    """Whether control does good: the gate by which a command is multiplied, 0 to 1."""

    def __init__(self, context: Context, delay: float, lag: float) -> None:
        from scipy.signal import butter, lfilter_zi  # slow to import

        self._interval, self._limit = context.control_interval, context.force_limit
        line, layout = mean_line(context), context.layout
        self.models = [
            Sampled(line_model(replace(context, channels=(channel,)), line, delay, lag), self._interval)
            for channel in context.channels
        ]
        self._states = [np.zeros(model.size) for model in self.models]
        names = [entry.name for entry in layout.entries]
        self._commands = [k for k, name in enumerate(names) if re.fullmatch("last .* action", name)]
        force = next(entry for entry in layout.entries if entry.name in FORCES)
        self._nominal = context.nominal_force
        of_nominal = force.name == "force deviation"
        newtons = self._nominal if of_nominal else 1.0
        self._to_force = force.scale * newtons, (force.centre + of_nominal) * newtons
        self.absolute = layout.kind != DEVIATIONS
        self.shares = 1 - np.exp(-self._interval / np.array([WINDOW, SHORT_WINDOW, SHIFT_WINDOW]))
        self._means = np.zeros((2, 3))  # over both windows: of the force, without control, and what that adds
        self._squares, self._added = np.zeros((2, 3)), 0.0
        self._past: Array | None = None  # of the low-pass
        self.low_pass = butter(2, min(HIGHEST, 0.3 / self._interval), fs=1 / self._interval)
        self.at_rest = lfilter_zi(*self.low_pass)
        self.gate, self.low = 0.0, False
        self._waits, self._mean_length = LISTENING, context.alignment.mean_length
        self._pause, self._acted, self._passive_for, self._settles = PAUSE, 0.0, 0.0, SETTLED
        self._heard, self._heard_at = math.inf, context.speed  # spread while passive (N), at a speed (m/s)
        self._fade_in = PROBE
        self._listened, self._most, self._deviation = 0.0, math.inf, 0.0  # from the mean (N)
        self._quiet = 0.0  # mean square of the deviation since it listens (N²)
        self._before = math.inf  # spread when it last faded (N)
        self._speed = names.index("speed") if "speed" in names else None
        self._entries = layout.entries

    def __call__(self, seen: Observation, readings: Readings) -> float:
        """Gate for this control step; seen: the checked observation."""
        scale, centre = self._to_force
        force = centre + scale * float(seen[readings.force])
        added = 0.0
        for k, (model, place) in enumerate(zip(self.models, self._commands, strict=True)):
            command = float(seen[place]) * self._limit
            self._states[k] = model.a @ self._states[k] + model.b * command
            added += float(model.c[0] @ self._states[k])
        speed = self._heard_at
        if self._speed is not None:
            entry = self._entries[self._speed]
            speed = float(entry.centre + entry.scale * seen[self._speed])
        if self._past is None:
            self._waits = max(LISTENING, LISTENING_SPANS * self._mean_length / speed)
        if readings.held == 0.0:
            self._add(force, added)
        deviations = np.sqrt(np.maximum(self._squares, 1e-9))
        self._passive_for = self._passive_for + self._interval if self.gate == 0.0 else 0.0
        self._listen(self._passive_for - self._settles, speed)
        self._acted = self._acted + self._interval if self.gate == 1.0 else 0.0
        if self._acted > GOOD:
            self._pause = PAUSE
        if readings.held > PATIENCE:
            if self._waits == 0.0:
                self._fade_in = FADE_IN
            self._waits = max(self._waits, RETURN)
        elif self.gate > 0.0 and self._waits == 0.0:
            if abs(self._added) > SHIFT * self._nominal:
                self._before, self._waits = 0.0, PAUSE
            elif self._heard < QUIET * self._nominal:
                self._before, self._waits, self._fade_in = 0.0, PAUSE, PROBE
            elif self._does_harm(deviations, speed):
                self._before, self._waits, self._fade_in = float(max(deviations[0, :2])), self._pause, PROBE
                self._pause, self._settles = min(GROWTH * self._pause, LONGEST_PAUSE), CALM
            elif not 1 / FASTER < speed / self._heard_at < FASTER:
                self._before, self._waits, self._fade_in = 0.0, PAUSE, FADE_IN
        heard_now = self._passive_for > self._settles + HEARD
        if 0.0 < self._waits <= self._interval and heard_now and self._heard > CALMER * self._before:
            self._pause, self._fade_in = PAUSE, FADE_IN  # it was no better without
        self._waits = max(self._waits - self._interval, 0.0)
        step = -self._interval / FADE_OUT if self._waits > 0 else self._interval / self._fade_in
        self.gate = min(max(self.gate + step, 0.0), 1.0)
        self.low = self.absolute and force < LOW * self._nominal and added < 0.0
        return self.gate

    def _listen(self, time: float, speed: float) -> None:
        """Hear how much the force varies; time: passive without waves of control (s), or below 0."""
        if time <= 0.0:
            self._listened = self._quiet = 0.0
            return
        self._listened = max(self._listened, abs(self._deviation))
        share = max(self.shares[0], self._interval / max(time, self._interval))
        self._quiet += share * (self._deviation**2 - self._quiet)
        if time > HEARD:
            self._heard, self._heard_at, self._most = math.sqrt(self._quiet), speed, self._listened

    def _add(self, force: float, added: float) -> None:
        now = np.array([force, force - added, added])
        if self._past is None:
            self._means[:], self._past = now, np.multiply.outer(self.at_rest, now)
        (b0, b1, b2), (_, a1, a2) = self.low_pass
        first, second = self._past
        passed = b0 * now + first
        self._past = np.array([b1 * now - a1 * passed + second, b2 * now - a2 * passed])
        now, shares = passed, self.shares[:2, None]
        self._deviation = float(now[0] - self._means[0, 0])
        self._means += shares * (now - self._means)
        self._squares += shares * ((now - self._means) ** 2 - self._squares)
        self._added += self.shares[2] * (added - self._added)

    def _does_harm(self, deviations: Array, speed: float) -> bool:
        (acted, without, _), (acted_lately, without_lately, added) = deviations
        strong = added > STRONG * self._heard  # else what is heard is not of control
        settled = self._acted > SETTLED  # what was heard at first is of waves that still build up
        faster = max(1.0, speed / self._heard_at) ** 2
        heard, most = self._heard * faster, self._most * faster
        return bool(
            acted > (HARM if settled else EARLY_HARM) * without
            or acted_lately > SHORT_HARM * without_lately
            or (settled and acted > SPREAD * heard)
            or (strong and acted_lately > SHORT_SPREAD * heard)
            or (strong and acted_lately > heard and without_lately > CLAIM * heard)
            or (strong and abs(self._deviation) > PEAK * most)
        )
