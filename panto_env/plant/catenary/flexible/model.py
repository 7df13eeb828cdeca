"""A flexible catenary for a number of lanes, intact or with defects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from ....base.arrays import Array, Index
from ....base.errors import InputError
from ...line_condition import DrawnLine, LineCondition
from ...numerics import Numerics, Runs
from ..protocol import StartPoint, check_speeds
from ..view import LineView
from .arrays import CONTACT, MESSENGER, PAD
from .attached import dropper_positions
from .beams import Profile
from .build import at_rest, constants, of_tension, settle
from .defects import DefectiveLine
from .grid import contact_gain
from .resolution import resolution
from .scattered_build import present
from .schema import FlexibleCatenaryData
from .segments import along
from .static import StaticShape, hang
from .tension import shape_left, with_tension_left
from .wire_defects import locate

DESIGNED = -1
"""Key, instead of a lane's number, of the shape of all lanes without a shape of their own."""

VIEW_POINTS = 401
"""Number of points of a span at which the messenger's height is kept for pictures."""


class FlexibleCatenary:
    """Two tensioned beams with droppers between them; a run starts at the line's first anchor."""

    massless = False

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
        self.data, condition = data, of_wires(runs.conditions)
        designed = data
        data = with_tension_left(designed, condition)
        shape = hang(designed)
        if data is not designed:
            shape = shape_left(designed, data)
        own = locate(data, spans, condition)
        self.wave_speed = data.contact_wire.wave_speed
        error = max(each.largest_tension_error for each in runs.conditions)
        check_speeds(data.name, np.sqrt(1 - error) * self.wave_speed, runs.speeds)
        tightest = with_tension_left(designed, condition, (1 + error, 1 + error))
        chosen = resolution(tightest, numerics, runs)
        self.time_step = chosen.time_step
        self.line = constants(data, shape, spans, numerics, chosen, own)
        self._shapes = {DESIGNED: shape}  # by lane, where each has tensions of its own; only for pictures
        self.contact_gain = contact_gain(tightest, self.line.spacing, self.time_step, own.lightest)
        self.grid: Mapping[str, float] = {"spacing": self.line.spacing, "window": self.line.window}
        self._alignment = alignment = data.alignment(spans)
        self.length = alignment.length
        self.usual_end = alignment.support(spans - 1)  # the anchor of the last span reflects waves
        self.supports = alignment.support(np.arange(1, spans))
        self.droppers = dropper_positions(data, spans)
        self._tension = np.tile(shape.dropper_tension, (1, spans // shape.spans))
        # The anchor does not yield: the pantograph is at rest there exactly.
        self.start_point = StartPoint(float(self.line.shape[0, 0]), 0.0, 0.0)
        self._designed: FlexibleCatenaryData | None = None  # where each lane has tensions of its own
        self._defective: dict[LineCondition, DefectiveLine] = {}
        self._lines_differ = False
        if any(condition.defective for condition in runs.conditions):
            self._make_defective(designed, spans, runs.conditions, lanes)
        self.wire = at_rest(self.line, lanes, collectors)

    def _make_defective(
        self, data: FlexibleCatenaryData, spans: int, conditions: Sequence[LineCondition], lanes: int
    ) -> None:
        """Write the defects into the line, or tables for them where each lane draws its own."""
        self._defective = {condition: DefectiveLine(data, spans, condition) for condition in conditions}
        first = conditions[0]
        self._lines_differ = len(conditions) > 1 or first.scatters
        rows = lanes if self._lines_differ else 1
        self.line = self._defective[first].with_tables(self.line, rows)
        if any(condition.tension_scatter > 0 for condition in conditions):
            self._designed = data
            self.line = self.line._replace(
                shape=np.repeat(self.line.shape, lanes, axis=0),
                stencil=np.repeat(self.line.stencil, lanes, axis=0),
                absorbing=np.repeat(self.line.absorbing, lanes, axis=0),
            )
        self._tension = np.repeat(self._tension, rows, axis=0)
        self._write_defects(0, DrawnLine(first))

    def _write_defects(self, row: int, drawn: DrawnLine) -> None:
        defective = self._defective[drawn.condition]
        if self._designed is not None:
            self._write_tension(row, drawn)
        if drawn.tensions != (1.0, 1.0):
            assert self._designed is not None
            defective = DefectiveLine(self._designed, self._alignment.spans, drawn.condition, drawn.tensions)
        state = defective.write(self.line, row, drawn.scatter, drawn.heights)
        self._tension[row] = state.tension

    def _write_tension(self, row: int, drawn: DrawnLine) -> None:
        """Write the stencil and the static shape for a lane's own tensions."""
        assert self._designed is not None
        own = with_tension_left(self._designed, drawn.condition, drawn.tensions)
        shape = shape_left(self._designed, own)
        tensioned = of_tension(own, shape, self.line.spacing, self.time_step)
        self.line.stencil[row], self.line.absorbing[row] = tensioned.stencil, tensioned.absorbing
        self._shapes[row] = shape
        # The anchor keeps its height, so that a run starts at rest; it would differ by 0.3 mm at most.
        self.line.shape[row] = tensioned.shape - (tensioned.shape[0] - self.start_point.height)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wires at rest, on the line ``drawn``; a force (N) at the anchor moves no wire."""
        if self._lines_differ:
            self._write_defects(lane, drawn)
        settle(self.line, self.wire, lane)

    def rest_tension(self, lane: int) -> Array:
        """Tension (N), (droppers,), of one lane's droppers at rest."""
        tension: Array = self._tension[min(lane, len(self._tension) - 1)]
        return tension

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """Present shape of one lane's line within the window about the train.

        The contact wire's height is the one that the pantograph feels. The messenger's is without the static
        effect of defective droppers and supports.
        """
        line, wire = self.line, self.wire
        moved = along(wire.displacement[lane] - 0.5 * wire.increment[lane])[:, PAD:-PAD]
        x = wire.travelled[lane] * line.stride + line.spacing * np.arange(moved.shape[1])
        inside = (x >= begin) & (x <= end)
        x, moved = x[inside], moved[:, inside]
        place = x if self.data.sequence else self._alignment.place(x)
        of_shape = np.linspace(0.0, line.shape_length, line.shape.shape[1])
        contact = np.interp(place, of_shape, line.shape[min(lane, len(line.shape) - 1)])
        heights = messenger_heights(self._shapes.get(lane, self._shapes[DESIGNED]))
        messenger = np.interp(place, np.linspace(0.0, line.shape_length, len(heights)), heights)
        supports = self.supports[(self.supports >= begin) & (self.supports <= end)]
        number, tension = self._links(lane)
        droppers = self.droppers[number]
        hanging = (droppers >= begin) & (droppers <= end)
        return LineView(
            x=x,
            contact=contact + self._rise(lane, x) + moved[CONTACT],
            messenger=messenger + moved[MESSENGER],
            supports=supports,
            droppers=droppers[hanging],
            slack=(tension <= 0)[hanging],
        )

    def _links(self, lane: int) -> tuple[Index, Array]:
        """Numbers of the droppers in a lane's window, (n,), in their order, and their tension (N)."""
        line, wire = self.line, self.wire
        if line.scattered.mobility.size:
            return present(line, wire, lane)
        links = line.link_set.size
        first = int(wire.travelled[lane]) * (links // line.window)
        tension = (wire.static[lane] + wire.change[lane])[line.link_set, line.link_segment]
        return first + np.arange(links), tension

    def _rise(self, lane: int, x: Array) -> Array:
        """Static change of the contact wire's height by defects (m), (n,), as ``rise_by_defects``."""
        line = self.line
        if not line.rise.shape[1]:
            return np.zeros(len(x))
        row = min(lane, len(line.rise) - 1)
        return Profile(line.rise_breaks, line.rise[row], line.rise_decay[row]).height(x)


@lru_cache(maxsize=64)
def messenger_heights(shape: StaticShape) -> Array:
    """Height (m) of the messenger wire at even distances, ``VIEW_POINTS`` of them over one span."""
    points = (VIEW_POINTS - 1) * shape.spans + 1
    return shape.messenger.height(np.linspace(0.0, shape.messenger.breaks[-1], points))


def of_wires(conditions: Sequence[LineCondition]) -> LineCondition:
    """A condition with the wire defects that all conditions share. Raises InputError where they differ."""
    if len({condition.of_wires for condition in conditions}) > 1:
        raise InputError(
            "All lines drawn from share their wires, so conditions must not differ in hard_spots, "
            "worn_stretches, lost_contact_tension or lost_messenger_tension; make a separate run for each."
        )
    return conditions[0]
