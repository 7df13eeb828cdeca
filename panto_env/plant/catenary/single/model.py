"""A single wire or a rail for a number of lanes: its elements, window, shape at rest, and what it refuses."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ....backend import python_function
from ....base.arrays import Array, one_thread
from ....base.errors import AccuracyWarning, InputError
from ...line_condition import DrawnLine, LineCondition
from ...numerics import Numerics, Runs
from ..flexible.shape import GRAVITY, solve_band
from ..protocol import NOTHING, CatenaryModel, LineView, StartPoint, check_speeds
from ..schema import CLEAR
from .schema import SingleData, check_sag
from .step import SingleLine, SingleWire, stiffness_terms

STEPS = {"full": 1e-3, "fast": 2e-3}  # time steps (s)
FREQUENCY, PER_WAVE = 60.0, 4.0
"""Frequency (Hz) of the shortest wave ahead of the train that elements carry, and their number in it. The
wire then yields to a contact force as a real one, and turns as sharply at its supports."""
FEWEST, COARSEST, FINEST = 8, 1.0, 0.05  # elements of a span; lengths of elements (m)
NEAR, LAYER, STRONGEST = 90.0, 90.0, 15.0
"""Length of the window between the train and each damping layer, and of a layer (m), and damping at a layer's
end (1/s): sigma is within 1 % of that with 300 m each, on rails and on soft supports too."""
SHORT = 10  # what a shorter window costs (%)


class Single(CatenaryModel):
    """A beam under tension on point supports; a run starts at the line's first anchor, where it is held."""

    contact_share = 1.0  # the implicit midpoint rule: a force's work is exact, any contact stable

    def __init__(
        self, data: SingleData, *, lanes: int, collectors: int, spans: int, numerics: Numerics, runs: Runs
    ) -> None:
        """Build the line.

        Raises InputError for conditions that a single wire has not, for a speed that is too high, for a sag
        out of a head's reach, and where lengths of spans are given for another number of spans.
        """
        if data.span_lengths and spans != data.spans:
            raise InputError(
                f"Line '{data.name}' has {data.spans} span_lengths, so it has no other number of spans: "
                "leave out spans, or give a shorter distance."
            )
        check_sag(data)
        refuse_conditions(data, runs.conditions)
        self.wave_speed = data.wave_speed
        check_speeds(data.name, self.wave_speed, runs.speeds)
        self.time_step = numerics.time_step or runs.carried_step(STEPS[numerics.accuracy])
        runs.check_wave(self.time_step)
        longest = numerics.spacing or spacing(data, runs.speeds[1])
        elements = max(math.ceil(data.longest_span / longest - 1e-9), 2)
        travelling = window_of(data, numerics.window, runs)
        window = travelling.about_one + travelling.train
        whole = not travelling.ahead or window >= spans
        window = spans if whole else window
        self.grid = {"spacing": data.longest_span / elements, "window": 0 if whole else travelling.about_one}
        self.alignment = alignment = data.alignment(spans)
        wire, damping = data.contact_wire, data.damping
        # Additional damping (1/s) of the window's elements towards both its ends.
        x = (np.arange(window * elements) + 0.5) / elements
        near = np.minimum(x, window - x)
        layer = STRONGEST * np.maximum(1 - near / max(travelling.layers, 1), 0.0) ** 2
        line = SingleLine(
            alignment=alignment.arrays,
            elements=elements,
            window=window,
            behind=travelling.behind,
            train=runs.train_length,
            time_step=self.time_step,
            mass=wire.mass,
            tension=wire.tension,
            bending=wire.bending_stiffness,
            alpha=damping.alpha,
            beta=damping.beta,
            support=np.array([data.support.stiffness, data.support.damping]),
            layer=layer,
            rest=np.zeros((0, 2)),
            free_uplift=data.free_uplift,
        )
        self.line: Any = line._replace(rest=shape_at_rest(data, line, alignment.lengths))
        each, nodes = (lanes, collectors), window * elements + 1
        self.wire: Any = SingleWire(
            first=np.full(lanes, -1),
            element=np.zeros(each, dtype=np.int64),
            affected=np.zeros((*each, 2), dtype=np.int64),
            weight=np.zeros((*each, 4)),
            moved=np.zeros((lanes, nodes, 2)),
            rate=np.zeros((lanes, nodes, 2)),
            mean=np.zeros((lanes, nodes, 2)),
            pivot=np.zeros((lanes, nodes, 3)),
            lower=np.zeros((lanes, nodes, 4)),
            response=np.zeros((*each, nodes, 2)),
        )
        self.length = alignment.length
        self.usual_end = alignment.support(spans - 1)  # the anchor of the last span reflects waves
        self.supports = alignment.support(np.arange(1, spans))
        # The anchor does not yield: the pantograph is at rest there exactly.
        self.start_point = StartPoint(float(self.line.rest[0, 0]), 0.0, 0.0)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wire at rest; a force (N) at the anchor does not move it."""
        self.wire.first[lane] = -1
        for each in (self.wire.moved, self.wire.rate, self.wire.mean):
            each[lane] = 0.0

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """Present shape of one lane's line within the window about the train."""
        moved, elements = self.wire.moved[lane, :, 0], self.line.elements
        first = max(int(self.wire.first[lane]), 0) * elements
        inside = slice(first, first + len(moved))
        x, contact = nodes_of(self.alignment.lengths, elements)[inside], self.line.rest[inside, 0] + moved
        shown = (x >= begin) & (x <= end)
        supports = self.alignment.supports_within(max(begin, x[0]), min(end, x[-1]))
        return NOTHING._replace(x=x[shown], contact=contact[shown], supports=supports)


FLEXIBLE_ALONE = (
    ("droppers", "", ("broken_droppers", "miscut_droppers", "dropper_scatter")),
    ("messenger wire", "", ("raised_supports", "support_scatter", "lost_messenger_tension")),
    (
        "tension but its data's",
        "change contact_wire.tension there, ",
        ("tension_scatter", "lost_contact_tension", "temperature"),
    ),
    ("load of ice", "raise contact_wire.mass in its data, ", ("ice",)),
    ("spots or stretches unlike the rest", "", ("hard_spots", "worn_stretches", "surface_bumps")),
    ("plan seen from above", "", ("side_wind",)),
)
"""What a single wire has not, what to do instead, and the values of a line condition that are about it."""


def refuse_conditions(data: SingleData, conditions: Sequence[LineCondition]) -> None:
    """Raise InputError for a line condition that a single wire has not."""
    for what, instead, names in FLEXIBLE_ALONE:
        for name in names:
            if any(getattr(condition, name) for condition in conditions):
                raise InputError(
                    f"Line '{data.name}' is a single wire or rail and has no {what}, which {name} is about: "
                    f"{instead}take another line_condition, such as 'fair', or a flexible line."
                )


def nodes_of(lengths: Array, elements: int) -> Array:
    """Places of all nodes (m), (spans * elements + 1,), for spans of these lengths (m)."""
    return np.append(0.0, np.cumsum(np.repeat(lengths / elements, elements)))


def shape_at_rest(data: SingleData, line: SingleLine, lengths: Array) -> Array:
    """Heights (m) and slopes (-) of all nodes, (nodes, 2), with a ramp; lengths: of the spans (m)."""
    rest = at_rest(line, lengths)
    if data.ramp is not None:
        bent = np.maximum(1 - nodes_of(lengths, line.elements) / data.ramp.length, 0.0)
        rest[:, 0] += data.ramp.rise * bent**2
        rest[:, 1] -= 2 * data.ramp.rise / data.ramp.length * bent
    return rest


def lower_diagonals(line: SingleLine, h: Array) -> Array:
    """Lower diagonals, (4, unknowns), of the stiffness of elements of lengths h (m), (elements,), alone."""
    a, b, c, d = python_function(stiffness_terms)(line, h)
    band = np.zeros((4, 2 * len(h) + 2))
    for k, size in enumerate((a, c)):
        band[0, k:-2:2] += size
        band[0, k + 2 :: 2] += size
    band[1, :-2:2] += b
    band[1, 2::2] -= b
    band[1, 1:-2:2], band[2, :-2:2], band[2, 1:-2:2], band[3, :-2:2] = -b, -a, d, b
    return band


def at_rest(line: SingleLine, lengths: Array) -> Array:
    """Heights (m) and slopes (-) of all nodes, (nodes, 2), under the wire's weight, at 0 m at all supports.

    lengths: of the spans (m). The ends may turn, so that a rail sags more in its first and last span.
    """
    h = np.repeat(lengths / line.elements, line.elements)
    band = lower_diagonals(line, h)
    load, half = np.zeros(2 * len(h) + 2), GRAVITY * line.mass * h / 2
    load[:-2:2] -= half
    load[2::2] -= half
    load[1:-2:2] -= half * h / 6
    load[3::2] += half * h / 6
    held = np.arange(0, len(load), 2 * line.elements)
    load[held], band[1:, held] = 0.0, 0.0
    for k in range(1, 4):
        band[k, held[1:] - k] = 0.0
    with one_thread():
        return solve_band(band, load).reshape(-1, 2)


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


def window_of(data: SingleData, given: int | None, runs: Runs) -> Window:
    """The window of these runs, or with a given number of spans."""
    shortest = min(data.span_lengths, default=data.span_length)
    train, layers = math.ceil(runs.train_length / shortest), math.ceil(LAYER / shortest)
    if given is None:
        side = math.ceil(NEAR / shortest) + layers
        return Window(side, side, train, layers)
    behind = max(given - 1, 0) // 2
    return Window(behind, given // 2, train, min(layers, behind))


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
