"""Static state of a line with overlaps and defects: that of each tension length, in the line's tables."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy

import numpy as np

from ....base.arrays import Array
from ...line_condition import LineCondition
from .arrays import Beside, FlexibleLine
from .defects import DefectiveLine, StaticState, check_places
from .overlaps import TensionLength, tension_lengths
from .schema import FlexibleCatenaryData
from .wire_defects import locate


class DefectiveParts:
    """All tension lengths of a line with the defects of a condition; used as a ``DefectiveLine``."""

    def __init__(
        self,
        data: FlexibleCatenaryData,
        spans: int,
        condition: LineCondition,
        tensions: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """Raises InputError for what the line has not.

        In an overlap the droppers of a span count from the first one of the ending wires to the last one of
        the beginning wires. Both messengers' supports at a mast are raised alike. Defects of the contact wire
        itself are on the wire in use there.
        """
        self._parts = tension_lengths(data)
        check_places(data, _counts(self._parts, spans), condition)
        locate(data, spans, condition)
        self.lines = [
            DefectiveLine(part.line, part.spans, _of_part(part, data, condition), tensions)
            for part in self._parts
        ]
        """The static state of each tension length."""
        self._droppers = sum(len(part.droppers) for part in self._parts)
        self._breaks = [self._breaks_of(pair)[0] for pair in (0, 1)]

    def with_tensions(self, tensions: tuple[float, float]) -> DefectiveParts:
        """The same line with wires of other tensions, as ``DrawnLine`` has them."""
        other = copy(self)
        other.lines = [each.with_tensions(tensions) for each in self.lines]
        return other

    def _breaks_of(self, pair: int) -> tuple[Array, list[slice]]:
        """Limits of all pieces of a pair's contact wire (m), and which are those of each tension length."""
        breaks, pieces = [0.0], []
        for part, own in zip(self._parts, self.lines, strict=True):
            if part.pair == pair:
                if part.begin > breaks[-1]:
                    breaks.append(part.begin)
                pieces.append(slice(len(breaks) - 1, len(breaks) + len(own.breaks) - 2))
                breaks += (part.begin + own.breaks[1:]).tolist()
        end = self._parts[-1].end
        return np.array([*breaks, end] if breaks[-1] < end else breaks), pieces

    def with_tables(self, line: FlexibleLine, rows: int) -> FlexibleLine:
        """The line with tables for ``rows`` defective ones, which ``write`` fills."""
        real = line.link_static.dtype
        first, second = self._breaks
        return line._replace(
            link_static=np.zeros((rows, self._droppers), dtype=real),
            link_gap=np.zeros((rows, self._droppers), dtype=real),
            rise=np.zeros((rows, len(first) - 1, 5)),
            rise_breaks=first,
            rise_decay=np.full(rows, self.lines[0].decay),
            beside=Beside(line.beside.shape, np.zeros((rows, len(second) - 1, 5)), second),
        )

    def write(
        self, line: FlexibleLine, row: int, scatter: Array | None = None, heights: Array | None = None
    ) -> StaticState:
        """Write the state under these errors, as ``DefectiveLine.solve`` takes them, into the tables."""
        tension, gap = np.zeros(self._droppers), np.zeros(self._droppers)
        rises = line.rise[row], line.beside.rise[row]
        places = iter(self._breaks_of(0)[1]), iter(self._breaks_of(1)[1])
        for part, own in zip(self._parts, self.lines, strict=True):
            inner = slice(part.first_span, part.first_span + part.spans - 1)
            state = own.solve(
                None if scatter is None else scatter[part.droppers],
                None if heights is None else heights[inner],
            )
            tension[part.droppers], gap[part.droppers] = state.tension, state.gap
            rises[part.pair][next(places[part.pair])] = state.rise
        line.link_static[row], line.link_gap[row] = tension, gap
        line.rise_decay[row] = self.lines[0].decay
        return StaticState(tension, gap, line.rise[row], np.zeros(0))


def _counts(parts: tuple[TensionLength, ...], spans: int) -> list[int]:
    """Number of droppers in each span of the line."""
    counts = [0] * spans
    for part in parts:
        for k, table in enumerate(part.line.dropper_tables):
            counts[part.first_span + k] += len(table.positions)
    return counts


def _of_part(part: TensionLength, data: FlexibleCatenaryData, condition: LineCondition) -> LineCondition:
    """The condition of one tension length, with its own numbers of spans, droppers and supports."""

    def local(span: int, number: int) -> tuple[int, int] | None:
        k = span - 1 - part.first_span
        if not 0 <= k < part.spans:
            return None
        counts = [len(table.positions) for table in part.line.dropper_tables]
        first = int(part.droppers[sum(counts[:k])]) - firsts[span - 1]
        return (k + 1, number - first) if 1 <= number - first <= counts[k] else None

    firsts = np.append(0, np.cumsum(_counts(tension_lengths(data), data.spans))).tolist()

    def droppers(places: tuple[tuple[int, int], ...]) -> Iterator[tuple[int, int, int]]:
        for n, place in enumerate(places):
            found = local(*place)
            if found is not None:
                yield n, *found

    cut = condition.miscut_droppers
    supports, (begin, end) = data.alignment().supports, part.in_use
    return condition.model_copy(
        update={
            "broken_droppers": tuple((a, b) for _, a, b in droppers(condition.broken_droppers)),
            "miscut_droppers": tuple(
                (a, b, cut[n][2]) for n, a, b in droppers(tuple((span, number) for span, number, _ in cut))
            ),
            "raised_supports": tuple(
                (support - part.first_span, wrong)
                for support, wrong in condition.raised_supports
                if 0 < support - part.first_span < part.spans
            ),
            "hard_spots": tuple(
                (span - part.first_span, offset, *rest)
                for span, offset, *rest in condition.hard_spots
                if begin <= supports[span - 1] + offset < end
            ),
            "worn_stretches": tuple(
                (span - part.first_span, offset, min(length, end - supports[span - 1] - offset), share)
                for span, offset, length, share in condition.worn_stretches
                if begin <= supports[span - 1] + offset < end
            ),
        }
    )
