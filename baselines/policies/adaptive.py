"""Linear feedback on a short history of readings and commands, whose gains are fitted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from panto_env.control.observation import Context

from .lanes_law import Array, FromAverage, Gain, Observations, Source, TunableLaw
from .line_model import DELAY, LAG, OUTPUTS, LineModel, Sampled
from .repetitive import PLACES, Pace, Repetitive

SIGNALS = {
    "head displacement": 0.01,
    "frame displacement": 0.01,
    "head velocity": 0.1,
    "frame velocity": 0.1,
    "contact force": 30.0,
}
"""Entries fed back, and the unit that their gains count in (m, m/s, N): their spread in a passive run."""
HISTORY = 3  # control steps of each signal that count, the present one included
COMMANDS = 2  # commands before the present one that count: what is still on its way through the actuator
COMMAND_UNIT = 10.0  # N, likewise
AVERAGED = 1.0
"""Time constant (s) of the slow average that is subtracted from each signal; some spans pass in it."""
COUNT = HISTORY * len(SIGNALS) + COMMANDS  # number of gains
FEEDBACK_GAINS = {
    **{f"{name}, {step} steps ago": Gain(3.0 * 0.5) for step in range(HISTORY) for name in SIGNALS},
    **{f"command, {step + 1} steps ago": Gain(3.0 * 0.2) for step in range(COMMANDS)},
}
"""Gains of the signals (N per their unit), newest step first, then gains of the commands."""


class LinearFeedback:
    """Feedback in each lane: sum over signals and steps of gain (y - slow average of y) + sum of gain u_past.

    Without their slow averages, signals have no constant part: feedback cannot move the mean force, which is
    otherwise possible because a spring connects the frame to the ground.
    """

    def __init__(self, gains: Array, interval: float, lanes: int) -> None:
        """gains: (17,), in the order of ``FEEDBACK_GAINS``; interval: of control (s)."""
        self._of_signals, self._of_commands = gains[:-COMMANDS], gains[-COMMANDS:]
        self._past = np.zeros((HISTORY, len(SIGNALS), lanes))
        self._commands = np.zeros((COMMANDS, lanes))
        self._from_average = FromAverage(interval, AVERAGED)

    def __call__(self, readings: Array, beside: Array) -> Array:
        """Force (N) of each lane, (lanes,), with that which acts beside it, for readings of ``SIGNALS``,
        (signals, lanes), in SI units.
        """
        signals = readings / np.array(list(SIGNALS.values()))[:, None]
        self._past = np.concatenate([self._from_average(signals)[None], self._past[:-1]])
        feedback = self._of_signals @ self._past.reshape(-1, self._past.shape[-1])
        return np.asarray(beside + feedback + self._of_commands @ (self._commands / COMMAND_UNIT))

    def remember(self, force: Array) -> None:
        """Store the commanded force (N), (lanes,)."""
        self._commands = np.concatenate([force[None], self._commands[:-1]])


def loop_gain(gains: Array, answers: NDArray[np.complex128], turns: NDArray[np.complex128]) -> Array:
    """Command (N/N, complex), (k,), that this feedback adds to a periodic command of 1 N.

    answers: of the signals to a command, (signals, k), SI; turns: of a control step, e^(i omega T), (k,).
    """
    steps = turns[None] ** -np.arange(HISTORY)[:, None]  # (history, k)
    units = np.array(list(SIGNALS.values()))
    weights = gains[:-COMMANDS].reshape(HISTORY, len(SIGNALS)) / units
    past = gains[-COMMANDS:] @ turns[None] ** -np.arange(1, COMMANDS + 1)[:, None]
    return np.asarray(np.einsum("hs,hk,sk->k", weights, steps, answers) + past / COMMAND_UNIT)


HARMONICS = 14
"""Number of harmonics: the highest is 23 Hz for spans of 60 m at 350 km/h, just above the figures' filter."""
LEAD = 0.03
"""Time (s) by which the series looks ahead, about the delay of actuator and sensors: its coefficients then
change little from one tuned speed to the next. It is part of the coefficients' meaning, not a gain."""
SERIES_GAINS = {f"{kind}{k}": Gain(3.0) for kind in ("cosine", "sine") for k in range(1, HARMONICS + 1)}
"""Coefficients of a series (N), whose steps are well below the limits of an actuator."""


class Periodic(TunableLaw):
    """Force that is a Fourier series of the place within the span, without feedback.

    u(x) = sum over k = 1..14 of a_k cos(2 pi k x / s) + b_k sin(2 pi k x / s), with x the place within the
    span s, as measured, plus the distance run in the lead time. There is no constant term: the static force
    sets the mean. On a line as designed, the part of the contact force that repeats with the span makes up
    most of sigma, and its response to u is nearly linear, so that Gauss-Newton finds the coefficients.

    It needs to know line and pantograph (it is fitted to them), the place within the span, and the speed. It
    does nothing against what differs from span to span; do not use it on another line. Where spans differ,
    the series is over the share of the train's own span.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = SERIES_GAINS

    def __init__(self, gains: Source = "periodic") -> None:
        """gains: (28,) coefficients a_1..a_14, b_1..b_14 (N), or the name or path of a file of gains."""
        super().__init__(gains)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        return series(self.span_angle(observations, LEAD)) @ self.gains


def series(angle: Array) -> Array:
    """Cosines, then sines, of the harmonics at angles (lanes,): (lanes, 2 HARMONICS)."""
    angles = np.multiply.outer(angle, np.arange(1, HARMONICS + 1))
    return np.concatenate([np.cos(angles), np.sin(angles)], axis=1)


class FittedFeedback(TunableLaw):
    """The series of ``Periodic`` plus linear feedback on three steps of history and two past commands.

    u = series(x) + sum over signals and steps of gain (y - slow average of y) + sum of gain u_past. Counted
    from their slow averages, signals have no constant part: feedback cannot move the mean force, which a
    spring from the frame to the ground would otherwise let it do.

    It needs to know what ``Periodic`` needs, and reads contact force, displacements and velocities of head
    and frame. Its gains hold for the delays of actuator and sensors that they were fitted with.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {**SERIES_GAINS, **FEEDBACK_GAINS}

    def __init__(self, gains: Source = "fitted-fb+ff") -> None:
        """gains: (45,): those of ``Periodic`` (N), then those of ``LinearFeedback``; or the name or path of a
        file of gains.
        """
        super().__init__(gains)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        self._feedback = LinearFeedback(self.gains[2 * HARMONICS :], context.control_interval, lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        readings = np.stack([self.read(observations, name) for name in SIGNALS])
        feedforward = series(self.span_angle(observations, LEAD)) @ self.gains[: 2 * HARMONICS]
        limit = self.context.force_limit
        force: Array = np.clip(self._feedback(readings, feedforward), -limit, limit)
        self._feedback.remember(force)
        return force


OWN = COUNT + len(Pace._fields)  # number of gains of feedback and learning; they stand last


class Adaptive(Repetitive):
    """``Repetitive`` with the linear feedback of ``FittedFeedback``, the gains of both fitted together.

    The feedback changes how the contact force responds to the learnt force: G_k is the response of the closed
    loop, from the model. Feedback reduces what differs from span to span, learning what repeats.

    It needs to know what ``Repetitive`` needs, and gains for line, pantograph and speed; not the line's
    stiffness along the span. ``place="counted"`` needs no sensor of the place, as there, and uses the same
    gains.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {**FEEDBACK_GAINS, **Repetitive.TUNED}

    def __init__(
        self, gains: Source = "adaptive", delay: float = DELAY, lag: float = LAG, place: str = PLACES[0]
    ) -> None:
        """gains: (20,): those of ``LinearFeedback``, then those of ``Repetitive``; or a file of gains by name
        or path. delay of actuator and sensors together, lag of the actuator: s. place: "read", or "counted"
        from the speed.
        """
        super().__init__(gains, delay, lag, place)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        self._feedback = LinearFeedback(self._of_feedback, context.control_interval, lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        force = super().forces(observations)
        self._feedback.remember(force)
        return force

    def answers(self, model: LineModel, frequencies: Array) -> NDArray[np.complex128]:
        """Responses of the contact force to the learnt force (N/N), complex, (n,), at frequencies (Hz)."""
        interval = self.context.control_interval
        turns = np.exp(2j * np.pi * frequencies * interval)
        opened = Sampled(model, interval).response(turns)
        signals = opened[[OUTPUTS.index(name) for name in SIGNALS]]
        return np.asarray(opened[0] / (1 - loop_gain(self._of_feedback, signals, turns)))

    def whole(self, observations: Observations, learnt: Array) -> Array:
        """Force (N) of each lane, (lanes,), before the washout: the learnt force plus the feedback."""
        return self._feedback(np.stack([self.read(observations, name) for name in SIGNALS]), learnt)

    @property
    def _of_feedback(self) -> Array:
        return self.gains[-OWN : -OWN + COUNT]


class AdaptiveFeedforward(Adaptive):
    """``Adaptive`` with the fitted Fourier series of the span of ``FittedFeedback``.

    What it learns on the run is added to the series: it is for a line whose design is known, but that was
    built differently, is worn or is used differently. Fit its gains on such lines; on lines as designed there
    is nothing to learn, and learning makes the force worse.

    It needs to know what ``FittedFeedback`` and ``Repetitive`` need; sensors must measure the place.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {**SERIES_GAINS, **Adaptive.TUNED}

    def __init__(self, gains: Source = "adaptive-fb+ff", delay: float = DELAY, lag: float = LAG) -> None:
        """gains: (48,): those of ``Periodic``, ``LinearFeedback`` and ``Repetitive``; or a file of gains by
        name or path. delay of actuator and sensors together, lag of the actuator: s.
        """
        super().__init__(gains, delay, lag)

    def whole(self, observations: Observations, learnt: Array) -> Array:
        """Force (N) of each lane, (lanes,), before the washout: series, learnt force and feedback."""
        feedforward = series(self.span_angle(observations, LEAD)) @ self.gains[: 2 * HARMONICS]
        return super().whole(observations, learnt + feedforward)
