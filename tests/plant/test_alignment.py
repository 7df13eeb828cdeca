"""Where spans begin and end, of one length and of nine."""

import numpy as np
import pytest

from panto_env.backend import kernel
from panto_env.plant.alignment import Alignment, in_spans

pytestmark = pytest.mark.plain

NINE = Alignment.of_spans([50.0, 65.0, 42.5, 60.0, 55.0, 48.0, 63.0, 57.5, 44.0])
EQUAL = Alignment.equal(60.0, 9)


@kernel
def _in_spans(alignment, positions, counted):
    for i in range(positions.size):
        counted[i] = in_spans(alignment, positions[i])


def test_limits_and_places_of_spans_of_nine_lengths_by_hand():
    assert NINE.spans == 9
    assert NINE.length == 485.0
    assert NINE.pitch is None
    assert NINE.limits((2, 3)) == (50.0, 157.5)
    assert NINE.span_of(np.array([0.0, 49.9, 50.0, 114.9, 115.0, 484.9])).tolist() == [1, 1, 2, 2, 3, 9]
    assert NINE.span_of(115.0) == 3  # a support belongs to the span that begins at it
    assert NINE.place(120.0) == 5.0
    assert NINE.length_at(120.0) == 42.5
    assert NINE.in_spans(50.0 + 65.0 / 4) == 1.25
    assert NINE.support(1.25) == 50.0 + 65.0 / 4
    assert NINE.supports_within(50.0, 157.4).tolist() == [50.0, 115.0]
    assert NINE.within(np.array([49.9, 50.0, 157.4, 157.5]), (2, 3)).tolist() == [False, True, True, False]
    assert [NINE.last_whole_span(distance) for distance in (49.9, 50.0, 485.0)] == [0, 1, 9]


def test_a_line_of_unequal_spans_continues_beyond_its_ends_with_its_outermost_spans():
    assert NINE.in_spans(485.0 + 22.0) == 9.5
    assert NINE.support(9.5) == 507.0
    assert NINE.in_spans(-25.0) == -0.5
    assert NINE.length_at(600.0) == 44.0


@pytest.mark.parametrize("alignment", [NINE, EQUAL], ids=["nine lengths", "equal"])
def test_kernels_and_python_agree(alignment):
    positions = np.linspace(-20.0, 560.0, 4001)
    counted = np.zeros_like(positions)
    _in_spans(alignment.arrays, positions, counted)
    np.testing.assert_allclose(counted, alignment.in_spans(positions), rtol=0, atol=1e-13)
    np.testing.assert_allclose(alignment.support(counted), positions, rtol=0, atol=1e-11)


def test_equal_spans_written_out_one_by_one_are_the_same_alignment():
    assert Alignment.of_spans([60.0] * 9) == EQUAL
    x = np.linspace(0.0, 539.0, 1000)
    np.testing.assert_array_equal(EQUAL.span_of(x), x // 60.0 + 1)
    np.testing.assert_array_equal(EQUAL.place(x), x % 60.0)
