"""Model-predictive control with the preview of the line as designed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from panto_env.base.errors import InputError, shown
from panto_env.base.extras import require
from panto_env.control.observation import Context

from .lanes_law import Array, FromAverage, Gain, Observations, Source, TunableLaw
from .line_model import DELAY, LAG, RATE
from .preview import Preview, preview

HORIZON = 30  # control steps of the prediction: 0.3 s, about a period of the frame under the wire
LENGTH = 120  # control steps after which the response to a command has died out
HELD = 0.4  # frequency (Hz) below which the integral of the command costs more than a force of the same size
TOLERANCE = 1e-3  # tolerance of the solver (N, and relative)
AVERAGED = 2.0  # time constant (s) of the slow average that is subtracted from the contact force


class PredictiveControl(TunableLaw):
    """Commands over a horizon that minimise the variation of the predicted force within limits, at each step.

    Predicted force = passive force of the line as designed at the places ahead + responses to past and future
    commands, each for the place of the command (``preview``, which includes stiffness along the span, waves,
    delay and lag) + the prediction error at these places in earlier spans + the present error beyond that,
    fading with time. It minimises the sum of F^2 + effort u^2 + (2 pi held q)^2, where q is the integral of u
    (which keeps the mean force), with |u| and |change of u| within the actuator's limits: a quadratic
    program, solved by OSQP (Stellato et al., Math. Prog. Comp. 12:637, 2020) if the limits matter.

    It needs to know the line's and the pantograph's design, the place within the span, the speed, delays and
    limits of the actuator. Computing the preview takes about a second for each speed.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "log effort": Gain(0.2, -1.0),
        "believed": Gain(0.1, 0.5),
        "log fading": Gain(0.1, -1.0),
        "learning": Gain(0.1, 0.3),
    }

    def __init__(
        self, gains: Source = "mpc", delay: float = DELAY, lag: float = LAG, rate: float = RATE
    ) -> None:
        """gains: (4,): log10 of effort (N^2/N^2), share of the prediction error that is carried forward,
        log10 of the time in which it fades (s), share of it that is learnt for the next span; or a file of
        gains by name or path.

        delay of actuator and sensors together, lag of the actuator: s; rate: N/s.
        """
        super().__init__(gains)
        if not rate > 0:
            raise ValueError(f"rate must be a positive number, not {shown(rate)}")
        self._delays, self._rate = (delay, lag), rate

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes: run the line as designed, and make the programs."""
        super().begin(context, lanes)
        effort, fading = 10.0 ** self.gains[0], 10.0 ** self.gains[2]
        self._believed, self._learning = self.gains[1], self.gains[3]
        self._preview = preview(context, LENGTH + HORIZON, *self._delays)
        self._programs = Programs(
            self._preview, effort, context.force_limit, self._rate, context.control_interval
        )
        self._fading = np.exp(-context.control_interval / fading * np.arange(1, HORIZON + 1))
        self._due = np.zeros((lanes, LENGTH + HORIZON))  # answers to commands given: now, in a step, ...
        self._learnt = np.zeros((lanes, len(self._preview.passive)))
        self._last, self._sum = np.zeros(lanes), np.zeros(lanes)
        self._from_average = FromAverage(context.control_interval, AVERAGED)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        contact = self._from_average(self.read(observations, "contact force"))
        position = self.span_angle(observations) / (2 * np.pi) * self.context.alignment.mean_length
        step = self._preview.step(position)
        passive = self._preview.passive
        own = np.arange(self.lanes)
        beyond = contact - passive[step] - self._due[:, 0] - self._learnt[own, step]
        coming = (step[:, None] + np.arange(1, HORIZON + 1)) % len(passive)
        free = passive[coming] + self._learnt[own[:, None], coming] + self._due[:, 1 : HORIZON + 1]
        self._learnt[own, step] += self._learning * beyond
        free += self._believed * beyond[:, None] * self._fading
        self._last = np.array(
            [
                self._programs.first(*each)
                for each in zip(step.tolist(), free, self._last.tolist(), self._sum.tolist(), strict=True)
            ]
        )
        self._sum += self._last * self.context.control_interval
        self._due[:, :-1] = self._due[:, 1:]
        self._due[:, -1] = 0.0
        self._due += self._last[:, None] * self._preview.response[step]
        return self._last


def quadratic_solver(whose: str) -> Any:
    """A solver of OSQP, an extra. Raises InputError, naming what needs it, if it is not installed."""
    require(whose, "control", "osqp")
    import osqp

    return osqp.OSQP()


class Programs:
    """The quadratic programs of all steps through a span; limit: N, rate: N/s, interval: s."""

    def __init__(self, line: Preview, effort: float, limit: float, rate: float, interval: float) -> None:
        self._limit, self._change = limit, rate * interval
        steps = len(line.passive)
        ahead = np.arange(HORIZON)
        places = (np.arange(steps)[:, None] + ahead) % steps
        self.answers = np.zeros((steps, HORIZON, HORIZON))  # of force j to command m
        for m in range(HORIZON):
            self.answers[:, m:, m] = line.response[places[:, m], : HORIZON - m]
        self.weights = self.answers.transpose(0, 2, 1) @ self.answers + effort * np.eye(HORIZON)
        sums = 2 * np.pi * HELD * interval * np.tri(HORIZON)
        self.weights += sums.T @ sums
        self._of_sum = (2 * np.pi * HELD) ** 2 * interval * np.arange(HORIZON, 0, -1)
        self._inverse = np.linalg.inv(self.weights)
        self._solver: Any = None

    def first(self, step: int, free: Array, last: float, total: float) -> float:
        """First command (N) of the best ones at a step, for forces without them, (HORIZON,), (N).

        last: command before (N); total: integral of all commands before (N s).
        """
        gradient = free @ self.answers[step] + total * self._of_sum
        best = -self._inverse[step] @ gradient
        changes = np.diff(best, prepend=last)
        if np.abs(best).max() > self._limit or np.abs(changes).max() > self._change:
            best = self._limited(step, gradient, last)
        return float(
            np.clip(best[0], max(-self._limit, last - self._change), min(self._limit, last + self._change))
        )

    def _limited(self, step: int, gradient: Array, last: float) -> Array:
        from scipy.sparse import csc_matrix

        # The upper triangle by columns, zeros too: its structure must not change from step to step.
        packed = self.weights[step][np.tril_indices(HORIZON)]
        low = np.concatenate([np.full(HORIZON, -self._limit), np.full(HORIZON, -self._change)])
        high = -low
        low[HORIZON], high[HORIZON] = low[HORIZON] + last, high[HORIZON] + last
        if self._solver is None:
            limits = np.vstack([np.eye(HORIZON), np.eye(HORIZON) - np.eye(HORIZON, k=-1)])
            columns = np.arange(HORIZON)
            rows = np.concatenate([columns[: k + 1] for k in columns])
            begins = np.concatenate([[0], np.cumsum(columns + 1)])
            self._solver = quadratic_solver("mpc")
            self._solver.setup(
                csc_matrix((packed, rows, begins), shape=(HORIZON, HORIZON)),
                gradient,
                csc_matrix(limits),
                low,
                high,
                verbose=False,
                eps_abs=TOLERANCE,
                eps_rel=TOLERANCE,
            )
        else:
            self._solver.update(Px=packed, q=gradient, l=low, u=high)
        best: Array = self._solver.solve(raise_error=False).x
        if not np.isfinite(best).all():
            raise InputError("mpc's quadratic program was not solved; take a larger effort.")
        return best
