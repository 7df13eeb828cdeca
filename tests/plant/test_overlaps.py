"""Overlaps: two pairs of wires side by side, each from anchor to anchor, each touched by a force of its own.

Finite elements of such lines are in ``tests/finite_element``.
"""

import numpy as np
import pytest
from scipy.optimize import nnls

from panto_env import InputError, simulate
from panto_env.backend import WIDTH, python_function
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.arrays import PAD
from panto_env.plant.catenary.flexible.as_run import elasticity
from panto_env.plant.catenary.flexible.shape import heights_of_pair
from panto_env.plant.catenary.flexible.static import hang
from panto_env.plant.catenary.flexible.wires import along
from panto_env.plant.numerics import Runs
from panto_env.plant.pantograph.step import shared_forces
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

from ..finite_element.sections import line_of as line_with
from ..finite_element.sections import of_catalogue
from . import test_uneven as uneven
from .test_flexible import PULSES, swing, undamped

SPANS, FIRST, LENGTH = 24, 11, 65.0
RISES = [0.1, 0.5]
MIDDLE = (FIRST + 0.5) * LENGTH
STITCH = {"length": 18.0, "tension": 3500.0, "mass": 0.31}
STITCHED_DROPPERS = {
    "positions": [2.5, 6.5, 12.5, 18.75, 25.625, 32.5, 39.375, 46.25, 52.5, 58.5, 62.5],
    "sag": [0.0] * 11,
}


def line_of(overlaps=({"first_span": FIRST, "rises": RISES},), spans=SPANS, stitched=False, **changes):
    table = of_catalogue("re330").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    if stitched:
        table |= {"stitch_wire": STITCH, "droppers": table["droppers"] | STITCHED_DROPPERS}
    # The last support is a hair higher, so that the line is no uniform one without overlaps.
    end = {"encumbrance": table["encumbrance"] + 1e-9}
    table |= {"sequence": [{}] * spans, "end_support": end, "overlaps": list(overlaps)}
    return FlexibleCatenaryData.model_validate(table | changes)


def run(line, distance=17 * LENGTH, pantograph="dsa380", speed=300.0, **settings):
    return simulate(line, pantograph, speed, distance=distance, **settings)


def test_tension_lengths_of_a_line():
    overlaps = [{"first_span": FIRST, "rises": RISES}, {"first_span": 18, "rises": [0.3]}]
    parts = first, second, third = line_of(overlaps).layout().tension_lengths
    found = [(part.first_span, len(part.layout.spans), part.pair) for part in parts]
    assert found == [(0, 13, 0), (10, 8, 1), (17, 7, 0)]
    assert (first.end, second.begin) == (13 * LENGTH, 10 * LENGTH)
    assert first.in_use == (0.0, MIDDLE)
    assert second.in_use == (MIDDLE, 17.5 * LENGTH)
    assert first.layout.contact_heights == (*[0.0] * 12, 0.1, 0.5)
    assert second.layout.contact_heights == (0.5, 0.1, *[0.0] * 6, 0.3)
    # Droppers count span by span, those of the ending wires first.
    per_span = 7
    assert first.droppers[10 * per_span :].tolist() == [70 + k + 14 * n for n in range(3) for k in range(7)]
    assert second.droppers[: 2 * per_span].tolist() == [77 + k + 14 * n for n in range(2) for k in range(7)]
    every = np.concatenate([first.droppers, second.droppers, third.droppers])
    assert sorted(every.tolist()) == list(range((SPANS + 4) * per_span))


def test_wires_in_the_middle_span_are_level_and_rise_in_a_parabola():
    line, x = line_of(), np.linspace(0, LENGTH, 131)
    shape = hang(line)
    ending, beginning = (heights_of_pair(line.layout(), shape, k, FIRST * LENGTH + x) for k in (0, 1))
    np.testing.assert_allclose(ending, beginning[::-1], atol=1e-9)
    level, at = (LENGTH + 4.0) / 2, np.array(line.droppers.positions)
    exact, wanted = (0.1 * (np.maximum(each - level, 0) / (LENGTH - level)) ** 2 for each in (at, x))
    places = np.append(FIRST * LENGTH + at, 13 * LENGTH + np.array([0.0, 1.0]))
    *found, end, beyond = heights_of_pair(line.layout(), shape, 0, places)
    np.testing.assert_allclose(found, exact, atol=1e-9)
    assert np.abs(ending - wanted).max() < 0.01  # between droppers the wire sags
    assert end == pytest.approx(0.5, abs=0.01)
    assert beyond > 50
    in_use = shape.contact.height(np.array([0.0, MIDDLE - 1e-9, MIDDLE + 1e-9, 15 * LENGTH]))
    assert np.abs(in_use).max() < 0.02


def test_compressed_droppers_are_refused_by_their_tension_length():
    with pytest.raises(
        InputError, match=r"dropper 5 of span 12 of line 're330, tension length 1'.*only pull"
    ):
        hang(line_of([{"first_span": FIRST, "rises": [0.4, 0.8]}]))


@pytest.mark.parametrize(("one", "other"), [(1.0, 1.0), (1.0, -0.5), (-1.0, 0.4), (0.3, 2.0), (-1.0, -1.0)])
def test_shared_forces_solve_the_complementarity(one, other):
    """Beside non-negative least squares: forces solve A f = b where positive, and A f >= b where 0."""
    (a, b), through = (2e-5, 3e-5), 1.3e-5
    matrix, gaps = np.array([[a, through], [through, b]]), np.array([one, other]) * 1e-3
    root = np.linalg.cholesky(matrix).T
    expected, _ = nnls(root, np.linalg.solve(root.T, gaps))
    found = python_function(shared_forces)((gaps[0], a), (gaps[1], b), through)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="module")
def new():
    return run(line_of())


def test_before_an_overlap_the_line_is_as_without_it_and_uplift_is_that_of_the_wire_in_use(new):
    """Up to where waves from the overlap meet the train."""
    without = run(line_of(()), 12 * LENGTH)
    differ = np.abs(new.contact_force[: len(without.position)] - without.contact_force)
    assert differ[without.position < 5 * LENGTH].max() < 5e-3
    assert differ[without.position < 9 * LENGTH].max() < 1.0
    assert differ[without.position > 11 * LENGTH].max() > 10.0
    uplift = new.uplift.max(axis=0)[5:16]
    assert 0.04 < uplift.min() < uplift.max() < 0.08


@pytest.mark.longer
def test_a_travelling_window_and_defects_on_both_pairs():
    """Beside the whole line; a dropper that is broken in the beginning wires, and a raised support."""
    condition = {"broken_droppers": [(FIRST, 15)], "raised_supports": [(FIRST + 1, 0.03)]}
    ours, whole, intact = (
        run(line_of(stitched=True), 14 * LENGTH, line_condition=each, precision="double", window=window)
        for each, window in ((condition, 16), (condition, 0), ("new", 16))
    )
    np.testing.assert_allclose(ours.contact_force, whole.contact_force, atol=0.02)
    np.testing.assert_allclose(ours.uplift.max(axis=0), whole.uplift.max(axis=0), atol=1e-5)
    assert whole.dropper_force[:, 10 * 11 + 14].max() == 0
    assert np.abs(ours.contact_force - intact.contact_force).max() > 5


@pytest.mark.parametrize(
    "condition",
    ["as-built", {"worn_stretches": [(FIRST, 10.0, 90.0, 0.2)]}, {"lost_contact_tension": 0.05}],
    ids=["as-built", "worn", "lost tension"],
)
def test_lines_that_are_not_as_designed_run_through_overlaps(new, condition):
    found = run(line_of(), line_condition=condition, seed=3)
    inside = found.summary((FIRST, FIRST + 2))
    assert inside.mean == pytest.approx(new.summary((FIRST, FIRST + 2)).mean, rel=0.02)
    assert inside.std > 10
    there = np.interp(new.position, found.position, found.contact_force)
    assert np.abs(there - new.contact_force).max() > 5


def test_ice_weighs_on_both_pairs_and_not_on_stitch_wires(new):
    """The wires in use hang lower, by a parabola between droppers on the messenger that sags more."""
    iced = run(line_of(), line_condition={"ice": 0.3})
    inside = (new.position > FIRST * LENGTH) & (new.position < (FIRST + 2) * LENGTH)
    assert new.wire[inside].mean() - iced.wire[inside].mean() > 0.01
    with pytest.raises(InputError, match="has stitch wires, on which ice is not computed"):
        run(line_of(stitched=True), line_condition={"ice": 0.3})
    fixed = load_catenary("re330").messenger_wire.model_dump() | {"axial_stiffness": 1e7}
    for line in (line_of(messenger_wire=fixed), line_of((), stitched=True, messenger_wire=fixed)):
        with pytest.raises(InputError, match="wires that are fixed at both ends are not computed"):
            run(line, line_condition={"temperature": 10.0})


def test_a_picture_shows_the_wires_in_use():
    """The others rise by 0.1 m and more at the overlap's ends."""
    plant = Plant(line_of(), Train.of(load_pantograph("dsa380")), runs=Runs((300 / 3.6,) * 2))
    plant.start(0, 300 / 3.6)
    shown = plant.model.view(0, (FIRST - 2) * LENGTH, (FIRST + 4) * LENGTH)
    assert shown.x[-1] - shown.x[0] > 5 * LENGTH
    assert np.abs(shown.contact).max() < 0.02
    assert max(np.abs(height).max() for _, height in shown.further) > 0.3


@pytest.mark.parametrize("stitched", [False, True])
def test_the_force_passes_from_one_wire_to_the_other(stitched):
    line = line_of(stitched=stitched)
    plant = Plant(line, Train.of(load_pantograph("dsa380")), runs=Runs((300 / 3.6,) * 2))
    plant.start(0, 300 / 3.6)
    samples, found = plant.samples(1), []
    begin, end = (int(spans * LENGTH / (300 / 3.6) / plant.time_step) for spans in (10, 13))
    plant.advance_passively(begin, samples)
    for _ in range(end - begin):
        plant.advance_passively(1, samples)
        step, total, second = (plant.of(0, row) for row in (Row.STEP, Row.CONTACT_FORCE, Row.SECOND_FORCE))
        found.append((step * plant.time_step * 300 / 3.6, total - second, second))
        assert 0 <= second <= total
    x, first, second = np.array(found).T
    touched = x[second > 0]
    assert FIRST * LENGTH - 20 < touched[0] < MIDDLE
    assert MIDDLE < x[first > 0][-1] < (FIRST + 1) * LENGTH + 20
    both = (first > 0) & (second > 0)
    assert 5 < (x[both][-1] - x[both][0]) < 65
    assert (np.abs(x[both] - MIDDLE) < 30).all()
    np.testing.assert_array_equal(second[x < FIRST * LENGTH - 20], 0.0)
    np.testing.assert_array_equal(first[x > (FIRST + 1) * LENGTH + 20], 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "pantograph", "speed", "distance", "spans"),
    [
        (line_of(), "dsa380", 300.0, 17 * LENGTH, (FIRST, FIRST + 2)),
        (uneven.line_of(uneven.MIXED), "en50318-2002", 250.0, None, (4, 13)),
    ],
    ids=["overlap", "spans that differ"],
)
def test_default_grid_is_fine_enough(line, pantograph, speed, distance, spans):
    """Sigma within 1 %, extremes within 1 % of the mean force, uplift within 0.5 mm of a fine grid's."""
    ours, fine = (
        simulate(line, pantograph, speed, distance=distance, record_droppers=False, **own).summary(spans)
        for own in ({}, {"spacing": 0.1})
    )
    assert ours.std == pytest.approx(fine.std, rel=0.01)
    assert (ours.max, ours.min) == pytest.approx((fine.max, fine.min), abs=0.01 * fine.mean)
    assert ours.max_uplift == pytest.approx(fine.max_uplift, abs=5e-4)


def test_elasticity_of_an_overlap_is_that_of_the_wire_in_use():
    places, yields = elasticity(line_of([{"first_span": 5, "rises": RISES}], 13), 100.0)
    per_span = yields.reshape(11, -1)
    outer = elasticity(of_catalogue("re330"), 100.0)[1]
    np.testing.assert_allclose(per_span[0, 3:-3], outer[3:-3], rtol=0.02)
    assert places[0] == LENGTH
    assert 0.5 * outer.min() < per_span[4:6].min()
    assert per_span[4:6].max() < 2 * outer.max()


@PULSES
@pytest.mark.slow
def test_undamped_line_keeps_its_energy_for_10_s(height, goes_slack, bar):
    """A pulse on all wires runs into the anchors, and comes back."""
    data = undamped(line_of([{"first_span": 4, "rises": RISES}], 10))
    largest, line, wire = swing(data, 10, 290.0, height, goes_slack, uneven.energy)
    assert largest < bar
    inner = slice(PAD, PAD + line.rows * WIDTH)
    beyond = np.arange(PAD, PAD + line.rows * WIDTH) * line.spacing > 6.1 * LENGTH
    assert np.abs(along(wire.displacement[0])[0, inner][beyond]).max() < 1e-12


@pytest.mark.parametrize(
    ("overlaps", "message"),
    [
        ([(23, RISES)], "spans 23 to 25, must lie within spans 1 to 24"),
        ([(1, [0.3])], "reach over 1 spans, and 3 are the least"),
        ([(24, [0.3])], "behind the last overlap .* 3 spans at least"),
        ([(11, RISES), (12, [0.3])], "Overlap 2 .* must lie within spans 14 to 24"),
    ],
)
def test_overlaps_that_the_line_has_no_room_for_are_refused(overlaps, message):
    with pytest.raises(InputError, match=message):
        hang(line_of([{"first_span": first, "rises": rises} for first, rises in overlaps]))


def test_what_knows_one_wire_refuses_overlaps():
    with pytest.raises(
        InputError, match=r"may pull \(bilateral\) has one wire, and line 're330' has overlaps"
    ):
        run(line_of(), bilateral=True)
    rig = load_catenary("rig-flexible")
    with pytest.raises(InputError, match="follows one contact wire, and its line has overlaps of two"):
        simulate(rig.model_copy(update={"line": line_of()}), "dsa380", 200.0, distance=100.0)
    uniform = of_catalogue("re330").model_dump(exclude={"sources"}, exclude_none=True)
    with pytest.raises(ValueError, match="needs a sequence of its spans"):
        FlexibleCatenaryData.model_validate(uniform | {"overlaps": [{"first_span": 4, "rises": RISES}]})


def test_a_damper_of_the_contact_feels_no_wire_that_begins_far_above():
    """The height of the second wire falls there from that of no wire, which had been taken for its motion."""
    overlap = {"first_span": 3, "rises": [0.1, 0.5]}
    line = line_with("en50318-2002", {"sequence": [{}] * 10, "overlaps": [overlap]})
    with_damper = load_pantograph("identified-2dof")
    without = with_damper.model_copy(update={"contact_damping": 0.0})
    assert with_damper.contact_damping > 0
    damped, undamped = (
        simulate(line, pantograph, 100.0, distance=300.0, record_droppers=False).summary("all")
        for pantograph in (with_damper, without)
    )
    assert damped.std == pytest.approx(undamped.std, rel=0.02)
    assert damped.max == pytest.approx(undamped.max, rel=0.02)
