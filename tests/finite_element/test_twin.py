"""Two contact wires under one messenger are not one wire where droppers alternate."""

import numpy as np
import pytest

from .figures import figures
from .system import build
from .twin import CASES, along_twins, halves, section, shared

SHORT = section(160.0)


def test_every_second_dropper_holds_the_same_wire():
    """Also over supports; each carries twice as far along half as much wire."""
    line = SHORT.line
    whole = build(line, line.spans, 2.5)
    places = []
    for wire in halves(line, 2.5):
        lower = wire.extension.tocoo().coords[1][wire.extension.tocoo().data < 0]
        places.append(np.sort(wire.nodes[(lower - 2) // 4]))
        inner = wire.dropper_tension[6:-6]
        assert inner.mean() == pytest.approx(whole.dropper_tension.mean(), rel=0.01)
    assert places[0] == pytest.approx(np.arange(2.5, 600.0, 10.0), abs=1e-9)
    assert places[1] == pytest.approx(np.arange(7.5, 600.0, 10.0), abs=1e-9)


def test_elements_that_do_not_divide_the_distances_are_refused():
    with pytest.raises(ValueError, match="do not divide"):
        halves(SHORT.line, 0.7)


@pytest.mark.study
@pytest.mark.parametrize(("speed", "spacing"), CASES)
def test_one_wire_for_two_whose_droppers_alternate_is_as_far_off_as_documented(speed, spacing):
    """docs/model.md and docs/validation.md: mean force right, sigma and extremes off, too little uplift."""
    one = section(speed, spacing)
    twins = along_twins(one)
    ours, theirs, wires = (
        figures(one.by_simulator(), one.spans),
        figures(twins, one.spans),
        shared(twins, one.spans),
    )
    assert theirs.mean == pytest.approx(ours.mean, rel=0.006)
    assert 0.9 < theirs.std / ours.std < 1.27
    assert abs(theirs.std / ours.std - 1) > 0.05
    assert theirs.minimum == pytest.approx(ours.minimum, abs=0.11 * ours.mean)
    assert theirs.maximum == pytest.approx(ours.maximum, abs=0.075 * ours.mean)
    assert 1.25 < theirs.uplift_mm / ours.uplift_mm < 1.6
    assert wires.first == pytest.approx(50.0, abs=1.0)
    assert wires.alone < 0.5
