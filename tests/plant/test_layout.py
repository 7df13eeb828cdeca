"""The layout of a line: each dropper has a span, a number in it, a position, and a number along the line."""

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.layout import Layout

from ..finite_element.sections import sections

UNIFORM = load_catenary("re330").layout(12)
MIXED, OVERLAPPED = (sections()[name].line.layout() for name in ("mixed", "overlap-2002"))


@pytest.mark.parametrize("layout", [UNIFORM, MIXED, OVERLAPPED], ids=["uniform", "mixed", "overlap"])
def test_a_dropper_is_found_by_its_span_and_number(layout: Layout):
    for k, dropper in enumerate(layout.droppers):
        assert layout.index(dropper.span, dropper.number) == k
        begin, end = layout.supports[dropper.span - 1 : dropper.span + 1]
        assert layout.positions[k] == dropper.position == pytest.approx(begin + dropper.place)
        assert begin < dropper.position < end
    spans = [dropper.span for dropper in layout.droppers]
    assert spans == sorted(spans)
    assert set(spans) == set(range(1, len(layout.spans) + 1))


def test_every_dropper_of_a_tension_length_is_one_of_the_line():
    parts = OVERLAPPED.tension_lengths
    assert sorted(np.concatenate([part.droppers for part in parts])) == list(range(len(OVERLAPPED.droppers)))
    for part in parts:
        for k, own in zip(part.droppers.tolist(), part.layout.droppers, strict=True):
            whole = OVERLAPPED.droppers[k]
            assert (whole.span, whole.pair) == (part.first_span + own.span, part.pair)
            assert (whole.place, whole.sag, whole.table) == (own.place, own.sag, own.table)


def test_a_dropper_that_the_line_has_not_is_refused():
    with pytest.raises(InputError, match=r"no dropper 99 in span 12: it has 12 spans of 7 droppers\."):
        UNIFORM.index(12, 99)
    with pytest.raises(InputError, match=r"no dropper 1 in span 15: it has 14 spans, and span 14 has \d+ dr"):
        MIXED.index(15, 1)
