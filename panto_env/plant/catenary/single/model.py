"""A single wire or a rail for a number of lanes: its shape at rest, its window, what it refuses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ....backend import python_function
from ....base.arrays import Array, one_thread
from ....base.errors import InputError
from ...line_condition import DrawnLine, LineCondition
from ...numerics import Numerics, Runs
from ..flexible.shape import GRAVITY, solve_band
from ..protocol import NOTHING, LineView, StartPoint, check_speeds
from .resolution import step_and_elements, window_of
from .schema import SingleData, check_sag
from .step import SingleLine, SingleWire, stiffness_terms


class Single:
    """A beam under tension on point supports; a run starts at the line's first anchor, where it is held."""

    massless = False
    wires_per_collector = 1
    contact_gain = 0.0  # a contact of any stiffness is stable
    contact_share = 1.0  # the implicit midpoint rule: a force's work is then exact
    grid: Mapping[str, float]

    def __init__(
        self,
        data: SingleData,
        *,
        lanes: int,
        collectors: int,
        spans: int,
        numerics: Numerics,
        runs: Runs,
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
        self.time_step, elements = step_and_elements(data, numerics, runs)
        runs.check_wave(self.time_step)
        travelling = window_of(data, numerics.window, runs)
        window, about_one = travelling.spans_of(spans)
        self.grid = {"spacing": data.longest_span / elements, "window": about_one}
        self.alignment = alignment = data.alignment(spans)
        alpha, beta = data.damping.alpha, data.damping.beta
        wire = data.contact_wire
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
            alpha=alpha,
            beta=beta,
            support=np.array([data.support.stiffness, data.support.damping]),
            layer=travelling.layer(elements, window),
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
        self.supports: Array = alignment.support(np.arange(1, spans))
        self.droppers: Array = np.zeros(0)
        # The anchor does not yield: the pantograph is at rest there exactly.
        self.start_point = StartPoint(float(self.line.rest[0, 0]), 0.0, 0.0)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wire at rest; a force (N) at the anchor does not move it."""
        self.wire.first[lane] = -1
        for each in (self.wire.moved, self.wire.rate, self.wire.mean):
            each[lane] = 0.0

    def rest_tension(self, lane: int) -> Array:
        """No tension: there are no droppers."""
        return np.zeros(0)

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
