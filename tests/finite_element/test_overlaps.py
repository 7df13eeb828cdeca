"""Overlaps in the finite elements: wires' shapes, one line of two halves, energy, who is touched where."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from panto_env.catalog import load_pantograph

from .contacts import Collector
from .energy import balance
from .newmark import chain_matrices
from .rest import at_rest, pair_at_rest, pairs_of
from .sections import STITCHED_330, line_of, of_catalogue, sections, stitched
from .simulation import ride, simulate
from .system import build, joined, of_pair
from .whole_line import ClosedLine, designed

DSA = load_pantograph("dsa380")


def overlapping(name, spans, first_span, rises, level=4.0, changes=None):
    sequence = {
        "sequence": [{}] * spans,
        "overlaps": [{"first_span": first_span, "rises": rises, "level": level}],
    }
    return line_of(name, sequence | (changes or {}))


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


def half(span):
    """Of everything that a span has."""
    halves = {}
    for part, values in {
        "droppers": ("stiffness", "mass", "messenger_clamp_mass", "contact_clamp_mass"),
        "support": ("stiffness", "damping"),
        "steady_arm": ("mass", "stiffness"),
        "stitch_wire": ("tension", "mass", "clamp_mass"),
    }.items():
        whole = getattr(span, part)
        if whole is not None:
            halves[part] = whole.model_copy(update={key: getattr(whole, key) / 2 for key in values})
    return span.model_copy(update=halves)


@pytest.mark.slow
def test_two_coincident_half_lines_are_one_line():
    """Each with half of all, touched over the whole length by a spring and damper of half the strip's."""
    line = stitched(
        "re330",
        STITCHED_330
        | {"sequence": [{}, {"encumbrance": 1.7}, {"stitch_wire": {"length": 0.0}}, {}, {}]}
        | {"steady_arm": {"mass": 1.0, "stiffness": 200.0}},
    )
    line = line.model_copy(
        update={"droppers": line.droppers.model_copy(update={"mass": 0.1, "contact_clamp_mass": 0.2})}
    )
    (pair,) = pairs_of(line)
    wires = tuple(
        wire.model_copy(
            update={key: getattr(wire, key) / 2 for key in ("mass", "tension", "bending_stiffness")}
        )
        for wire in line.wires
    )
    rest = pair_at_rest(replace(pair, spans=[half(span) for span in pair.spans]), wires, 1.0)
    one = of_pair(rest, wires, line.damping)
    strip = {"contact_stiffness": DSA.contact_stiffness / 2, "contact_damping": 100.0}
    halves = ride(joined([one, one]), DSA.model_copy(update=strip), 280.0, 1e-3)
    whole = simulate(line, DSA.model_copy(update={"contact_damping": 200.0}), 280.0)
    for key in ("contact_force", "head", "wire"):
        expected = getattr(whole, key)
        np.testing.assert_allclose(getattr(halves, key), expected, rtol=0, atol=1e-6 * abs(expected).max())
    np.testing.assert_allclose(halves.wire_forces, whole.contact_force[:, None] / 2 * [1, 1], atol=1e-4)
    np.testing.assert_allclose(halves.uplift, np.tile(whole.uplift, 2), atol=1e-8)
    np.testing.assert_allclose(halves.dropper_tension, np.tile(whole.dropper_tension / 2, 2), atol=1e-4)
    assert (whole.dropper_tension == 0).any()


@pytest.mark.slow
def test_a_wire_high_above_is_none_and_the_second_is_none_until_it_is_touched():
    line = of_catalogue("re330")
    (rest,) = at_rest(line, 4, 1.0)
    pair = of_pair(rest, line.wires, line.damping)
    high = replace(pair, static=pair.static + np.array([0.6, 0.0]))
    alone, below = (ride(each, DSA, 250.0, 1e-3) for each in (pair, joined([high, pair])))
    np.testing.assert_allclose(below.contact_force, alone.contact_force, atol=1e-9)
    np.testing.assert_allclose(below.wire, alone.wire, atol=1e-12)
    assert (below.wire_forces[:, 0] == 0).all()

    line = overlapping("re330", 6, 2, [0.1, 0.5])
    both = simulate(line, DSA, 250.0, distance=260.0)
    first = int(np.flatnonzero(both.wire_forces[:, 1])[0])
    own = of_pair(at_rest(line, 6, 1.0)[0], line.wires, line.damping)
    alone = ride(own, DSA, 250.0, 1e-3, distance=260.0)
    np.testing.assert_allclose(both.contact_force[:first], alone.contact_force[:first], atol=1e-7)
    after = alone.contact_force.size - 1
    assert abs(both.contact_force[first:after] - alone.contact_force[first:after]).max() > 5.0


@pytest.mark.slow
def test_a_slow_strip_is_shared_as_springs_in_equilibrium_share_it():
    """Statics without steps in time: each wire's own yield, and the spring of the strip upon each."""
    line = overlapping("re330", 5, 2, [0.06, 0.3], 10.0)
    run = simulate(line, DSA, 10.0, element=2.0, time_step=4e-3, distance=190.0)
    system = build(line, 5, 2.0)
    stiffness, k = chain_matrices(DSA)[2], float(DSA.contact_stiffness)
    load = np.zeros(len(stiffness))
    load[-1] = DSA.nominal_force(10.0 / 3.6)
    yields = splu((system.stiffness + diags_array(1 - system.free)).tocsc())

    def shared(x):
        points = [system.contact_point(x, pair) for pair in (0, 1)]
        c = np.zeros(2)
        for pair, (unknowns, values, *_) in enumerate(points):
            push = np.zeros(system.free.size)
            push[unknowns] = values
            c[pair] = push @ yields.solve(push)
        free_head, rate = np.linalg.solve(stiffness, load)[0], np.linalg.inv(stiffness)[0, 0]
        heights = np.array([point[3] for point in points])
        for touched in ([0, 1], [int(heights.argmin())]):
            some = np.ix_(touched, touched)
            matrix = np.full((2, 2), rate)[some] + np.diag(c + 1 / k)[some]
            forces = np.zeros(2)
            forces[touched] = np.linalg.solve(matrix, free_head - heights[touched])
            if forces.min() >= 0:
                return forces
        raise AssertionError

    middle = 2.5 * 65.0
    for x in middle + np.array([-15.0, -8.0, -4.0, 0.0, 4.0, 8.0, 15.0]):
        near = abs(run.position - x) < 1.0
        assert run.wire_forces[near].mean(axis=0) == pytest.approx(shared(x), abs=0.6)
    assert shared(middle) == pytest.approx(shared(middle)[::-1], rel=1e-9)
    assert shared(middle - 15.0) == pytest.approx(shared(middle + 15.0)[::-1], rel=1e-6)


@pytest.mark.slow
def test_energy_is_balanced_through_an_overlap():
    section = sections()["overlap-330"]
    line = overlapping("re330", 6, 2, [0.1, 0.5])
    found = balance(line, [Collector(section.pantograph)], 250.0, distance=290.0)
    assert found.steps_with_slack > 0
    assert (found.wire_forces[:, 0] > 0).all(axis=1).any()
    assert found.error < 1e-3 * found.turnover


OVERLAPS = [name for name, section in sections().items() if section.line.overlaps]


@pytest.mark.parametrize("name", OVERLAPS)
@pytest.mark.slow
def test_the_force_passes_from_one_wire_to_the_other_in_the_middle_span(name, capsys):
    section = sections()[name]
    (overlap,) = section.line.overlaps
    run = section.by_finite_elements(1.0)
    supports = section.line.alignment().supports
    middle = overlap.first_span - 1 + len(overlap.rises) - 1
    begin, end = supports[middle], supports[middle + 1]
    touched = [np.flatnonzero(run.wire_forces[:, pair]) for pair in (0, 1)]
    first, last = run.position[touched[1][0]], run.position[touched[0][-1]]
    both = (run.wire_forces > 0).all(axis=1)
    with capsys.disabled():
        print(
            f"\n{name}: in the middle span of {end - begin:g} m the second wire is first touched at "
            f"{first - begin:.1f} m, the first one last at {last - begin:.1f} m, and both at once over "
            f"{both.sum() * (run.position[1] - run.position[0]):.1f} m"
        )
    level = (begin + end - overlap.level) / 2, (begin + end + overlap.level) / 2
    assert begin - 5 < first < level[0] < level[1] < last < end + 5
    # Nothing but the strip moves the second wire: it is first touched where the head reaches it at rest.
    system = build(section.line, section.line.spans, 1.0)
    hangs = run.position > supports[overlap.first_span - 1]
    height = np.array([system.contact_point(x, 1)[3] for x in run.position])
    assert touched[1][0] == pytest.approx(np.flatnonzero(hangs & (run.head > height))[0], abs=2)
    # On both sides of the middle; in it a dropper there may hold the second wire down for some metres.
    x, reach = run.position - (begin + end) / 2, 1.5 * overlap.level
    assert both[(-reach < x) & (x < 0)].any()
    assert both[(x > 0) & (x < reach)].any()
    np.testing.assert_allclose(run.contact_force, run.wire_forces.sum(axis=1), atol=1e-9)
    assert run.wire_forces.min() == 0
    for pair, away in ((1, begin - run.position), (0, run.position - end)):
        assert (run.wire_forces[away > 5, pair] == 0).all()
    assert (run.support_position == np.array(supports[1:-1])).all()
