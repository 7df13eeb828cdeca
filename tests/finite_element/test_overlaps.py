"""Overlaps in the finite elements: shapes of their wires, and what is refused."""

import numpy as np
import pytest

from .rest import pairs_of
from .sections import line_of
from .system import build
from .whole_line import ClosedLine, designed


def overlapping(name, spans, first_span, rises, level=4.0, changes=None):
    overlaps = [{"first_span": first_span, "rises": rises, "level": level}]
    return line_of(name, {"sequence": [{}] * spans, "overlaps": overlaps} | (changes or {}))


def test_wires_rise_and_come_down_as_an_overlap_says():
    """Three spans of 65 m: heights at droppers, supports and anchors, those of a line on a gradient added."""
    heights = [0.0, 0.0, 0.05, 0.1, 0.15, 0.15, 0.15]
    line = overlapping("re330", 7, 3, [0.1, 0.5], 5.0, {"sequence": [{"contact_height": h} for h in heights]})
    ending, beginning = pairs_of(line)
    assert [len(each.spans) for each in (ending, beginning)] == [5, 5]
    assert (ending.begin, beginning.begin) == (0.0, 130.0)
    assert (list(ending.in_use), list(beginning.in_use)) == ([0, 1, 2, 3], [4, 5, 6, 7])
    shapes = [
        designed(ClosedLine(each.spans, each.end, line.wires, 1.0, each.above))
        for each in (ending, beginning)
    ]
    sag, x0 = line.droppers.sag[0], 35.0
    own_x = np.array([65.0 * k + x for k in range(7) for x in line.droppers.positions])
    own = np.interp(own_x, 65.0 * np.arange(8), [*heights, 0.15]) - sag

    def rise(x):
        """Of the ending wire, at places from its first span of the overlap (m)."""
        middle = 0.1 * np.maximum((x - 65.0 - x0) / (65.0 - x0), 0.0) ** 2
        return np.where(x < 130.0, middle, 0.1 + 0.4 * (x - 130.0) / 65.0)

    for pair, shape, begin, up in (
        (ending, shapes[0], 0.0, lambda x: rise(x - 130.0)),
        (beginning, shapes[1], 130.0, lambda x: rise(325.0 - x)),
    ):
        x = own_x[(own_x > begin) & (own_x < begin + 325.0)]
        wanted = own[(own_x > begin) & (own_x < begin + 325.0)] + up(x)
        at = np.searchsorted(shape.x, x - begin - 1e-9)
        np.testing.assert_allclose(shape.contact[at], wanted, atol=1e-12)
        supports = begin + 65.0 * np.arange(len(pair.spans) + 1)
        carried = shape.support_force * np.array([2, *[1] * (len(pair.spans) - 1), 2])
        unloaded = shape.messenger[np.searchsorted(shape.x, supports - begin - 1e-9)] + carried / 5e5
        low = np.interp(supports, 65.0 * np.arange(8), [*heights, 0.15])
        np.testing.assert_allclose(unloaded - line.encumbrance - low, up(supports), atol=1e-9)


def test_an_overlap_in_which_droppers_would_push_names_them():
    with pytest.raises(ValueError, match=r"from 0 m would push: dropper \d of span 4 \(-\d+ N\)"):
        build(overlapping("en50318-2002", 7, 3, [0.3, 0.9]), 7, 1.0)
    for overlaps, message in (
        ([(2, [0.1, 0.5]), (4, [0.1])], "share a span"),
        ([(6, [0.1, 0.5])], "beyond the line's end"),
    ):
        each = [{"first_span": first, "rises": rises} for first, rises in overlaps]
        with pytest.raises(ValueError, match=message):
            build(line_of("re330", {"sequence": [{}] * 7, "overlaps": each}), 7, 1.0)
    with pytest.raises(ValueError, match="level stretch is longer"):
        build(
            overlapping("re330", 5, 2, [0.1], 50.0, {"span_length": 45.0, "droppers": {"spacing": 5}}), 5, 1.0
        )
