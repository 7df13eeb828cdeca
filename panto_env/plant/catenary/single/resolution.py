"""How finely a single wire is computed: elements, time step, and the window that goes with the train."""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.errors import AccuracyWarning
from ...numerics import Numerics, Runs
from ..schema import CLEAR
from .schema import SingleData

STEPS = {"full": 1e-3, "fast": 2e-3}  # time steps (s)
FREQUENCY, PER_WAVE = 60.0, 4.0
"""Frequency (Hz) of the shortest wave ahead of the train that elements carry, and their number in it. The
wire then yields to a contact force as a real one, and turns as sharply at its supports."""
FEWEST, COARSEST, FINEST = 8, 1.0, 0.05  # elements of a span; lengths of elements (m)
NEAR, LAYER, STRONGEST = 90.0, 90.0, 15.0
"""Length of the window between the train and each damping layer, and of a layer (m), and damping at a layer's
end (1/s): sigma is within 1 % of that with 300 m each, on rails and on soft supports too."""
SHORT = 10  # what a shorter window costs (%)


class Window(NamedTuple):
    """Spans that are computed about a train."""

    behind: int
    ahead: int  # 0 for the whole line
    train: int  # by which a train's length makes it longer
    layers: int  # of the damping layer at each end

    @property
    def about_one(self) -> int:
        """Spans about one pantograph."""
        return self.behind + 1 + self.ahead

    def spans_of(self, spans: int) -> tuple[int, int]:
        """Spans of the window on a line of this many, and those about one pantograph; 0: the whole line."""
        whole = not self.ahead or self.about_one + self.train >= spans
        return (spans, 0) if whole else (self.about_one + self.train, self.about_one)

    def layer(self, elements: int, window: int) -> Array:
        """Additional damping (1/s) of the elements of a window, (window * elements,), at both ends.

        elements: of each span. window: its spans.
        """
        x = (np.arange(window * elements) + 0.5) / elements
        near = np.minimum(x, window - x)
        return np.asarray(STRONGEST * np.maximum(1 - near / max(self.layers, 1), 0.0) ** 2)


def window_of(data: SingleData, given: int | None, runs: Runs) -> Window:
    """The window of these runs, or with a given number of spans."""
    shortest = min(data.span_lengths, default=data.span_length)
    train, layers = math.ceil(runs.train_length / shortest), math.ceil(LAYER / shortest)
    if given is None:
        side = math.ceil(NEAR / shortest) + layers
        return Window(side, side, train, layers)
    behind = max(given - 1, 0) // 2
    return Window(behind, given // 2, train, min(layers, behind))


def step_and_elements(data: SingleData, numerics: Numerics, runs: Runs) -> tuple[float, int]:
    """Time step (s), and elements of each span."""
    step = numerics.time_step or runs.carried_step(STEPS[numerics.accuracy])
    longest = numerics.spacing or spacing(data, runs.speeds[1])
    return step, max(math.ceil(data.longest_span / longest - 1e-9), 2)


def spacing(data: SingleData, speed: float) -> float:
    """Length of elements (m) that carry the waves ahead of a train at a speed (m/s)."""
    wire = data.contact_wire
    # (2 pi f + k v)^2 = (T k^2 + EI k^4) / m: the wave that keeps its distance from the train.
    shaken, squared = 2 * math.pi * FREQUENCY, wire.tension / wire.mass - speed**2
    roots = np.roots([wire.bending_stiffness / wire.mass, 0, squared, -2 * speed * shaken, -(shaken**2)])
    real = roots.real[(roots.real > 0) & (np.abs(roots.imag) < 1e-6 * np.abs(roots.real))]
    k = float(real.max(initial=1e-9))  # none at a speed that is refused later
    return min(max(2 * math.pi / k / PER_WAVE, FINEST), COARSEST, data.longest_span / FEWEST)


def clear_spans(data: SingleData, numerics: Numerics, runs: Runs, last: int) -> int:
    """Spans beyond the last one of a pass that keep the line's end outside its window."""
    return max(CLEAR, window_of(data, numerics.window, runs).ahead + 1)


def warn_if_short(data: SingleData, numerics: Numerics, runs: Runs) -> None:
    """Warn where a given window is shorter, or elements are longer, than costs 1 % of sigma."""
    needed = spacing(data, runs.speeds[1])
    if numerics.spacing and numerics.spacing > 1.5 * needed:
        warnings.warn(
            f"Elements of {numerics.spacing:g} m are coarser than line '{data.name}' needs at this speed "
            f"({needed:.2g} m): standard deviation and extremes may be wrong by more than 1 %.",
            AccuracyWarning,
            stacklevel=3,
        )
    given, enough = numerics.window, window_of(data, None, runs).about_one
    if given and given < enough:
        warnings.warn(
            f"A window of {given} spans is short on line '{data.name}', where {enough} are usual: standard "
            f"deviation and extremes may be wrong by up to about {SHORT} %; leave out window.",
            AccuracyWarning,
            stacklevel=3,
        )
