"""A flexible catenary for a number of lanes, and the defects of its tension lengths in the line's tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from ...line_condition import ON_WIRE, DrawnLine, LineCondition
from ...numerics import Numerics, Runs
from ...wind import draw_side_wind
from ..protocol import LineView, StartPoint, check_speeds
from ..schema import FEWEST_SPANS
from .arrays import Beside, FlexibleLine
from .blown import air_about, start_wind
from .build import Tensioned, at_rest, constants, of_tension, settle
from .defects import DefectiveLine, located_defects, shape_left, with_tension_left
from .fixed_wires import check_loaded, tensions_of_fixed
from .grid import point_gain
from .layout import Layout, TensionLength
from .plan import in_wind
from .points import with_points
from .resolution import resolution, spans_of_train
from .schema import INSTEAD, FlexibleCatenaryData
from .static import StaticShape, hang
from .view import view_of
from .wire_defects import locate


class DefectiveParts:
    """All tension lengths of a line with the defects of a condition; most lines have only one."""

    def __init__(
        self, layout: Layout, condition: LineCondition, tensions: tuple[float, float] = (1.0, 1.0)
    ) -> None:
        """Raises InputError for what the line has not.

        In an overlap the droppers of a span count from the first one of the ending wires to the last one of
        the beginning wires. Both messengers' supports at a mast are raised alike. Defects of the contact wire
        itself are on the wire in use there.
        """
        self._parts = parts = layout.tension_lengths
        broken, error, height = located_defects(layout, condition)
        self.lines = [
            DefectiveLine(
                part.layout,
                condition if len(parts) == 1 else _on_wire(part, layout, condition),
                tensions,
                located=(broken[part.droppers], error[part.droppers], height[part.inner]),
            )
            for part in parts
        ]
        """The static state of each tension length."""
        self._droppers = len(layout.droppers)
        self._rises = [slice(None)] * len(parts)  # which pieces of its pair each tension length has
        self._pieces = self._pieces_of(0), self._pieces_of(1)

    def with_tensions(self, tensions: tuple[float, float]) -> DefectiveParts:
        """The same line with wires of other tensions, as ``DrawnLine`` has them."""
        other = copy(self)
        other.lines = [each.with_tensions(tensions) for each in self.lines]
        return other

    def _pieces_of(self, pair: int) -> tuple[Array, int]:
        """Limits of a pair's contact wire's pieces (m), and their number."""
        if len(self._parts) == 1:
            own = self.lines[0]
            return (own.breaks, own.pieces) if pair < own.wires else (np.zeros(0), 0)
        breaks = [0.0]
        for k, (part, own) in enumerate(zip(self._parts, self.lines, strict=True)):
            if part.pair == pair:
                if part.begin > breaks[-1]:
                    breaks.append(part.begin)
                self._rises[k] = slice(len(breaks) - 1, len(breaks) + len(own.breaks) - 2)
                breaks += (part.begin + own.breaks[1:]).tolist()
        end = self._parts[-1].end
        breaks += [end] if breaks[-1] < end else []
        return np.array(breaks), len(breaks) - 1

    def with_tables(self, line: FlexibleLine, rows: int) -> FlexibleLine:
        """The line with tables for ``rows`` defective ones, which ``write`` fills."""
        real = line.link_static.dtype
        (first, count), (second, others) = self._pieces
        beside = Beside(line.beside.shape, np.zeros((rows, others, 5)), second)
        return line._replace(
            link_static=np.zeros((rows, self._droppers), dtype=real),
            link_gap=np.zeros((rows, self._droppers), dtype=real),
            rise=np.zeros((rows, count, 5)),
            rise_breaks=first,
            rise_decay=np.full(rows, self.lines[0].decay),
            beside=beside if others else line.beside,
        )

    def write(
        self, line: FlexibleLine, row: int, scatter: Array | None = None, heights: Array | None = None
    ) -> Array:
        """Write the state under these errors, as ``DefectiveLine.solve`` takes them, into the tables.

        Returns the tension of all droppers (N).
        """
        tension, gap = np.zeros(self._droppers), np.zeros(self._droppers)
        rises = line.rise[row], line.beside.rise[min(row, len(line.beside.rise) - 1)]
        for part, own, its_rise in zip(self._parts, self.lines, self._rises, strict=True):
            state = own.solve(
                None if scatter is None else scatter[part.droppers],
                None if heights is None else heights[part.inner],
            )
            tension[part.droppers], gap[part.droppers] = state.tension, state.gap
            for wire, rise in enumerate((state.rise, *state.further)):
                rises[part.pair + wire][its_rise] = rise
        line.link_static[row], line.link_gap[row] = tension, gap
        line.rise_decay[row] = self.lines[0].decay
        return tension


def _on_wire(part: TensionLength, layout: Layout, condition: LineCondition) -> LineCondition:
    """A condition with the defects of the contact wire of one tension length, by its own numbers of spans."""
    supports, (begin, end), first = layout.supports, part.in_use, part.first_span
    own = {
        name: tuple(
            (span - first, *rest)
            for span, *rest in getattr(condition, name)
            if begin <= supports[span - 1] + rest[0] < end
        )
        for name in ON_WIRE
    }
    own["worn_stretches"] = tuple(
        (span, offset, min(length, end - supports[first + span - 1] - offset), share)
        for span, offset, length, share in own["worn_stretches"]
    )
    return condition.model_copy(update=own)


OF_TENSION = ("shape", "stencil", "absorbing")  # tables of a line that depend on its wires' tension
Own = tuple[StaticShape, Tensioned, DefectiveParts]
"""What depends on tensions: shape, stencil, and the line with its defects."""


class FlexibleCatenary:
    """Tensioned beams with droppers between them; a run starts at the line's first anchor."""

    massless = False
    contact_share = 0.5  # the wire's mean over a step is as far from its height at mid-step as the head's

    def __init__(
        self,
        data: FlexibleCatenaryData,
        *,
        lanes: int,
        collectors: int,
        spans: int,
        numerics: Numerics,
        runs: Runs,
    ) -> None:
        """Build the line.

        Raises InputError where the line cannot hang with its values, grid and time step are not stable
        together, it has another number of spans, or a condition has a defect at a dropper, support or place
        that the line does not have.
        """
        if data.sequence and spans != data.spans:
            raise InputError(
                f"Line '{data.name}' is a sequence of {data.spans} spans, so it has no other number of them: "
                "leave out spans, or give a shorter distance."
            )
        given, runs = runs.conditions, with_points(data, runs, spans)
        condition = runs.conditions[0]
        if any(each.of_wires != condition.of_wires for each in runs.conditions):
            raise InputError(
                "All lines drawn from share their wires, so conditions must not differ in hard_spots, "
                "worn_stretches, surface_bumps, lost_contact_tension, lost_messenger_tension, ice or "
                "temperature; make a separate run for each."
            )
        self.data = data = designed = in_wind(data, spans, runs.conditions)
        self._fixed = contact, messenger = tensions_of_fixed(designed, condition)
        data = with_tension_left(designed, condition, self._fixed)
        shape = hang(designed)
        if data is not designed:
            shape = shape_left(designed, data)
        self.layout = layout = data.layout(spans)
        if designed.contact_wires > 1 and any(
            each.hard_spots or each.worn_stretches for each in runs.conditions
        ):
            raise InputError(
                f"Line '{data.name}' has two contact wires, on which hard_spots and worn_stretches are not "
                f"computed; leave them out, or give {INSTEAD}."
            )
        own = locate(designed.layout(spans), condition)
        self.wave_speed = data.wave_speed
        error = max(each.largest_tension_error for each in runs.conditions)
        check_speeds(data.name, np.sqrt(1 - error) * self.wave_speed, runs.speeds)
        tightest = with_tension_left(designed, condition, ((1 + error) * contact, (1 + error) * messenger))
        chosen = resolution(tightest, numerics, runs)
        self.time_step = chosen.time_step
        lead = 0.5 * runs.train_length
        self.line = constants(data, shape, spans, numerics, chosen, own)._replace(lead=lead)
        # By lane, where each has tensions of its own; only for pictures.
        self.shapes: dict[int | None, StaticShape] = {None: shape}
        self.wires_per_collector = self.line.pairs
        touched, beta = tightest.contact_wire, data.damping.beta
        self.contact_gain = point_gain(touched, self.line.spacing, self.time_step, beta, own.lightest)
        window = self.line.window - spans_of_train(data, runs)  # about one pantograph
        window = window if window >= FEWEST_SPANS else 0
        self.grid: Mapping[str, float] = {"spacing": self.line.spacing, "window": window}
        self.alignment = alignment = layout.alignment
        self.length = alignment.length
        self.usual_end = alignment.support(spans - 1)  # the anchor of the last span reflects waves
        self.supports = np.tile(alignment.support(np.arange(1, spans)), designed.contact_wires)
        self.droppers = layout.positions
        self._tension = shape.over(spans).dropper_tension[None]
        # The anchor does not yield: the pantograph is at rest there exactly.
        first = float(self.line.shape[0, 0])
        apart = float(self.line.beside.shape[0, 0]) - first if designed.contact_wires > 1 else 0.0
        self.start_point = StartPoint(first, 0.0, 0.0, apart)
        self._designed: FlexibleCatenaryData | None = None  # where each lane has tensions of its own
        # Of the line drawn last: lanes of a fit mostly share their tensions.
        self._latest: tuple[tuple[LineCondition, tuple[float, float]], Own] | None = None
        self._defective: dict[LineCondition, DefectiveParts] = {}
        self._lines_differ = False
        if any(condition.defective for condition in runs.conditions) or designed.arms_in_wind:
            self._make_defective(designed, given, runs.conditions, lanes)
        if data is not designed:
            both = zip(designed.layout(spans).tension_lengths, layout.tension_lengths, strict=True)
            for (was, now), line in zip(both, self._defective[given[0]].lines, strict=True):
                shape = shape_left(was.layout.line, now.layout.line)
                state = line.solve()
                for wire, (its_shape, _) in enumerate(shape.contacts):
                    check_loaded(now.layout, replace(shape, contact=its_shape), line.rise(state, wire))
        if any(each.side_wind for each in runs.conditions):
            if data.tunnels:
                raise InputError(
                    f"Line '{data.name}' has tunnels, in which no wind blows across the track; leave out "
                    "side_wind, or compute the line in parts."
                )
            air = air_about(self.line, data.wires, condition.ice, self.time_step)
            self.line = self.line._replace(air=air)
        self.wire = at_rest(self.line, lanes, collectors)

    def _make_defective(
        self,
        data: FlexibleCatenaryData,
        conditions: Sequence[LineCondition],
        pointed: Sequence[LineCondition],
        lanes: int,
    ) -> None:
        """conditions: of the runs; pointed: the same with the line's points."""
        layout = data.layout(self.alignment.spans)
        self._defective = {
            each: DefectiveParts(layout, with_its_points, self._fixed)
            for each, with_its_points in zip(conditions, pointed, strict=True)
        }
        first = conditions[0]
        self._lines_differ = len(conditions) > 1 or first.scatters
        rows = lanes if self._lines_differ else 1
        self.line = self._defective[first].with_tables(self.line, rows)
        if any(condition.tension_scatter > 0 for condition in conditions):
            self._designed = data
            beside = self.line.beside._replace(shape=np.repeat(self.line.beside.shape, lanes, axis=0))
            own: dict[str, Any] = {
                name: np.repeat(getattr(self.line, name), lanes, axis=0) for name in OF_TENSION
            }
            self.line = self.line._replace(beside=beside, **own)
        self._tension = np.repeat(self._tension, rows, axis=0)
        self._write_defects(0, DrawnLine(first))

    def _write_defects(self, row: int, drawn: DrawnLine) -> None:
        defective = self._defective[drawn.condition]
        if self._designed is not None:
            key = drawn.condition, drawn.tensions
            if self._latest is None or self._latest[0] != key:
                tensions = drawn.tensions[0] * self._fixed[0], drawn.tensions[1] * self._fixed[1]
                left = with_tension_left(self._designed, drawn.condition, tensions)
                shape = shape_left(self._designed, left)
                if drawn.tensions != (1.0, 1.0):
                    defective = defective.with_tensions(tensions)
                tensioned = of_tension(left, shape, self.line.spacing, self.time_step)
                self._latest = key, (shape, tensioned, defective)
            shape, tensioned, defective = self._latest[1]
            self.shapes[row] = shape
            self.line.stencil[row], self.line.absorbing[row] = tensioned.stencil, tensioned.absorbing
            # The anchor keeps its height, so that a run starts at rest; it would differ by 0.3 mm at most.
            self.line.shape[row] = tensioned.shape - (tensioned.shape[0] - self.start_point.height)
            self.line.beside.shape[row] = tensioned.beside
            if shape.second is not None:
                begin = self.start_point.height + self.start_point.apart
                self.line.beside.shape[row] -= tensioned.beside[0] - begin
        self._tension[row] = defective.write(self.line, row, drawn.scatter, drawn.heights)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wires at rest, on the line ``drawn``; a force (N) at the anchor moves no wire."""
        if self._lines_differ:
            self._write_defects(lane, drawn)
        settle(self.line, self.wire, lane)
        if self.line.air.drag.size:
            mean = draw_side_wind(drawn.condition.across, self.time_step)
            start_wind(self.line, self.wire, lane, mean if drawn.side_wind is None else drawn.side_wind)

    def rest_tension(self, lane: int) -> Array:
        """Tension (N), (droppers,), of one lane's droppers at rest."""
        tension: Array = self._tension[min(lane, len(self._tension) - 1)]
        return tension

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """Present shape of one lane's line within the window about the train."""
        return view_of(self, lane, begin, end)
