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


class Resolution(NamedTuple):
    """How finely a line is computed."""

    elements: int  # of each span
    time_step: float  # s
    behind: int  # spans of the window behind a train
    ahead: int  # and ahead of it, 0 for the whole line
    train: int  # spans by which a train's length makes it longer
    layers: int  # spans of the damping layer at each end

    def spans_of(self, spans: int) -> tuple[int, int]:
        """Spans of the window on a line of this many, and those about one pantograph; 0: the whole line."""
        about = self.behind + 1 + self.ahead
        return (about + self.train, about) if self.ahead and about + self.train < spans else (spans, 0)

    def layer(self, window: int) -> Array:
        """Additional damping (1/s) of the elements of a window, (window * elements,), at both ends."""
        x = (np.arange(window * self.elements) + 0.5) / self.elements
        near = np.minimum(x, window - x)
        return np.asarray(STRONGEST * np.maximum(1 - near / max(self.layers, 1), 0.0) ** 2)


def resolution(data: SingleData, numerics: Numerics, runs: Runs) -> Resolution:
    """Elements, time step and window for these runs."""
    elements = math.ceil(data.longest_span / (numerics.spacing or spacing(data, runs.speeds[1])) - 1e-9)
    step = numerics.time_step or runs.carried_step(STEPS[numerics.accuracy])
    shortest = min(data.span_lengths, default=data.span_length)
    train, layers = math.ceil(runs.train_length / shortest), math.ceil(LAYER / shortest)
    behind = ahead = math.ceil(NEAR / shortest) + layers
    if numerics.window is not None:
        behind, ahead = max(numerics.window - 1, 0) // 2, numerics.window // 2
        layers = min(layers, behind)
    return Resolution(max(elements, 2), step, behind, ahead, train, layers)


def spacing(data: SingleData, speed: float) -> float:
    """Length of elements (m) that carry the waves ahead of a train at a speed (m/s)."""
    wire = data.contact_wire
    # (2 pi f + k v)^2 = (T k^2 + EI k^4) / m: the wave that keeps its distance from the train.
    shaken, squared = 2 * math.pi * FREQUENCY, wire.tension / wire.mass - speed**2
    roots = np.roots([wire.bending_stiffness / wire.mass, 0, squared, -2 * speed * shaken, -(shaken**2)])
    real = roots.real[(roots.real > 0) & (np.abs(roots.imag) < 1e-6 * np.abs(roots.real))]
    k = real.max(initial=1e-9)  # none at a speed that is refused later
    return min(max(2 * math.pi / k / PER_WAVE, FINEST), COARSEST, data.longest_span / FEWEST)


def clear_spans(data: SingleData, numerics: Numerics, runs: Runs, last: int) -> int:
    """Spans beyond the last one of a pass that keep the line's end outside its window."""
    return max(CLEAR, resolution(data, numerics, runs).ahead + 1)


def warn_if_short(data: SingleData, numerics: Numerics, runs: Runs) -> None:
    """Warn where a given window is shorter than the usual one, which costs more than 1 % of sigma."""
    usual = resolution(data, numerics.model_copy(update={"window": None}), runs)
    enough = usual.behind + 1 + usual.ahead
    if numerics.window and numerics.window < enough:
        warnings.warn(
            f"A window of {numerics.window} spans is short for line '{data.name}', on which {enough} are "
            f"usual: standard deviation, maximum and minimum may be wrong by up to about {SHORT} %; leave out "
            "window.",
            AccuracyWarning,
            stacklevel=3,
        )
