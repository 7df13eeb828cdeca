"""Two contact wires under one messenger are one wire where droppers hang in pairs; otherwise they are not."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from .figures import figures
from .sections import Section
from .system import build
from .twin import ALTERNATING, CASES, IN_PAIRS, along_twins, halves, section, shared, tied

SHORT = section(160.0)


@pytest.mark.slow
def test_two_wires_whose_droppers_hang_in_pairs_are_one_wire():
    short = Section(SHORT.line, SHORT.pantograph, 160.0, spans=(2, 2))
    twins, whole = along_twins(short, IN_PAIRS, 2.5), short.by_finite_elements(2.5)
    for key in ("contact_force", "head", "wire"):
        expected = getattr(whole, key)
        np.testing.assert_allclose(getattr(twins, key), expected, rtol=0, atol=1e-6 * abs(expected).max())
    np.testing.assert_allclose(twins.wire_forces, whole.contact_force[:, None] / 2 * [1, 1], atol=1e-4)
    np.testing.assert_allclose(twins.uplift, np.tile(whole.uplift, 2), atol=1e-8)


def test_a_push_on_one_wire_moves_both_alike_and_against_each_other():
    """At rest. Half of it on both moves the equivalent wire; the other half, up and down, no messenger."""
    line, x, push = SHORT.line, 365.0, 100.0
    whole, (one, other) = build(line, line.spans, 2.5), halves(line, IN_PAIRS, 2.5)
    twins = tied(one, other)
    one_s_messenger = 4 * np.arange(one.nodes.size)[:, None] + [0, 1]

    def moved(system, force, held=()):
        """Height of each contact wire under a force on the first one (m)."""
        unknowns, values, *_ = system.contact_point(x)
        load = np.zeros(system.free.size)
        load[unknowns] = force * values
        free = np.setdiff1d(np.flatnonzero(system.free), held)
        u = np.zeros(load.size)
        u[free] = spsolve(system.stiffness[free][:, free].tocsc(), load[free])
        return [values @ u[system.contact_point(x, pair)[0]] for pair in range(len(system.pairs))]

    (alike,), (against,) = moved(whole, push), moved(one, push / 2, one_s_messenger.ravel())
    assert moved(twins, push) == pytest.approx([alike + against, alike - against], rel=1e-6)
    assert 0.1 * alike < against < alike


def test_every_second_dropper_holds_the_same_wire():
    """Also over supports; each carries twice as far along half as much wire."""
    line = SHORT.line
    whole = build(line, line.spans, 2.5)
    places = []
    for wire in halves(line, ALTERNATING, 2.5):
        lower = wire.extension.tocoo().coords[1][wire.extension.tocoo().data < 0]
        places.append(np.sort(wire.nodes[(lower - 2) // 4]))
        inner = wire.dropper_tension[6:-6]
        assert inner.mean() == pytest.approx(whole.dropper_tension.mean(), rel=0.01)
    assert places[0] == pytest.approx(np.arange(2.5, 600.0, 10.0), abs=1e-9)
    assert places[1] == pytest.approx(np.arange(7.5, 600.0, 10.0), abs=1e-9)


def test_elements_that_do_not_divide_the_distances_are_refused():
    with pytest.raises(ValueError, match="do not divide"):
        halves(SHORT.line, ALTERNATING, 0.7)


@pytest.mark.study
@pytest.mark.parametrize(("speed", "spacing"), CASES)
def test_one_wire_for_two_whose_droppers_alternate_is_as_far_off_as_documented(speed, spacing):
    """docs/model.md and docs/validation.md: mean force right, sigma and extremes off, too little uplift."""
    one = section(speed, spacing)
    twins = along_twins(one, ALTERNATING)
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
