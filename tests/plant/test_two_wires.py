"""Two contact wires under one messenger, each with droppers and steady arms of its own.

Finite elements of both wires are in ``tests/finite_element/test_two_wires.py``.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from panto_baselines.policies.line_model import mean_line
from panto_env import InputError, Trajectory, simulate
from panto_env.analysis.line_check import check
from panto_env.analysis.plots import plot_line
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control.entries import line_values
from panto_env.metrics.run_tables import samples as table_of
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.as_run import as_run, elasticity
from panto_env.plant.catenary.flexible.defects import DefectiveLine
from panto_env.plant.catenary.flexible.shape import GRAVITY
from panto_env.plant.catenary.flexible.static import hang
from panto_env.plant.catenary.flexible.whole_line import settle_line
from panto_env.plant.line_condition import LineCondition
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train
from panto_env.report.findings import Findings

from ..finite_element import twin
from ..lanes import check_lanes_are_singles
from . import test_uneven as uneven
from .test_flexible import PULSES, swing, undamped

CA = load_catenary("ca-160")
DSA = load_pantograph("dsa250")
FAR = twin.two_wires(twin.direct_current())
BESIDE = 0.1  # m, between the two droppers of a pair: the least
PLACES = (5.0, 15.0, 25.0, 35.0, 45.0, 55.0)
ARMS = {"mass": 1.0, "stiffness": 200.0, "holds_wire": True}


def changed(line, **changes):
    return FlexibleCatenaryData.model_validate(line.model_dump(exclude_none=True) | changes)


def equivalent(**changes):
    """One wire, whose droppers hang at ``PLACES``."""
    droppers = {"positions": PLACES, "pre_sag": 0.03, "stiffness": 200e3, "contact_clamp_mass": 0.4}
    return changed(twin.direct_current(), **{"droppers": droppers, "steady_arm": ARMS} | changes)


def coinciding(one):
    """Two wires of half of it, whose droppers hang beside each other, of half each."""
    places = np.add.outer(PLACES, [-BESIDE / 2, BESIDE / 2]).ravel().tolist()
    sag = np.repeat(one.droppers.sag, 2).tolist()
    half = {"positions": places, "sag": sag, "stiffness": 100e3, "contact_clamp_mass": 0.2}
    return changed(twin.two_wires(one), droppers=half)


def test_droppers_of_each_wire_carry_it_and_nothing_else():
    """Weight of wire and clamps; the messenger's support carries all. A flat wire hangs level at its own."""
    for line in (CA, FAR):
        shape, layout = hang(line), line.layout(1)
        for wire in (0, 1):
            own = layout.held == wire
            weight = line.contact_wire.mass * line.span_length + own.sum() * line.droppers.contact_clamp_mass
            weight += shape.dropper_mass[own].sum() / 2
            assert shape.dropper_tension[own].sum() == pytest.approx(GRAVITY * weight, rel=1e-9)
            heights = shape.contacts[wire][0].height(layout.positions[own])
            np.testing.assert_allclose(heights, -np.array(line.droppers.sag)[own], atol=1e-9)
        carried = line.messenger_wire.mass * line.span_length * GRAVITY
        carried += shape.dropper_tension.sum() + GRAVITY * shape.dropper_mass.sum() / 2
        given_way = line.encumbrance - float(shape.messenger.height(np.zeros(1))[0])
        assert given_way == pytest.approx(carried / line.support.stiffness, rel=1e-9)


def test_spans_one_by_one_hang_as_one_that_repeats():
    """But at the ends: a span is not its own mirror image."""
    x = np.linspace(240.0, 420.0, 500)
    ours, theirs = settle_line(CA.model_copy(update={"spans": 12})), hang(CA)
    for (own, _), (other, _) in zip(ours.contacts, theirs.contacts, strict=True):
        np.testing.assert_allclose(own.height(x), other.height(x), atol=1e-6)


def test_droppers_hold_the_wires_in_turn_unless_the_line_says_otherwise():
    def held(wire):
        droppers = FAR.droppers.model_dump(exclude_none=True) | {"wire": wire}
        return changed(FAR, droppers=droppers).layout(2).held.tolist()

    assert FAR.layout(2).held.tolist() == held([1, 2] * 6) == 2 * [0, 1] * 6
    assert held([1] * 9 + [2] * 3) == 2 * ([0] * 9 + [1] * 3)


SUNK = {"lost_contact_tension": 0.08, "lost_messenger_tension": 0.05, "raised_supports": [(10, 0.03)]}


@pytest.mark.longer
@pytest.mark.parametrize("condition", ["new", SUNK], ids=["new", "sunk"])
def test_wires_that_coincide_are_the_equivalent_wire(condition):
    """Within 1 %, for droppers of a pair hang 0.1 m apart; each wire carries half."""
    one = equivalent()
    both = [
        simulate(line, DSA, 180.0, distance=16 * 60.0, line_condition=condition)
        for line in (one, coinciding(one))
    ]
    ours, theirs = (run.summary((8, 14)) for run in reversed(both))
    for name in ("mean", "std", "max_uplift"):
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), rel=0.01), name
    assert (ours.max, ours.min) == pytest.approx((theirs.max, theirs.min), abs=0.01 * ours.mean)
    first, second = (each[7:14] for each in np.split(both[1].uplift.max(axis=0), 2))
    np.testing.assert_allclose(second, first, rtol=0.01)


CUT_LONG = {"broken_droppers": [(3, 5), (3, 6)], "miscut_droppers": [(4, 3, 0.02), (4, 4, 0.02)]}


@pytest.mark.parametrize(
    ("condition", "of_one"),
    [
        ({"lost_contact_tension": 0.1, "lost_messenger_tension": 0.05}, {}),
        ({"raised_supports": [(3, 0.05)]}, {}),
        (CUT_LONG, {"broken_droppers": [(3, 3)], "miscut_droppers": [(4, 2, 0.02)]}),
    ],
    ids=["lost tension", "raised support", "droppers"],
)
def test_a_line_at_rest_in_a_condition_is_that_of_the_equivalent_wire(condition, of_one):
    """With arms that hold the wire. So is its elasticity, whose force is shared by both wires."""
    one = equivalent()
    both, whole = (
        DefectiveLine(line.layout(6), LineCondition(**given))
        for line, given in ((coinciding(one), condition), (one, of_one or condition))
    )
    x = np.linspace(60.0, 300.0, 300)
    state, expected = both.solve(), whole.rise(whole.solve()).height(x)
    assert np.abs(expected).max() > 2e-3
    for wire in (0, 1):
        risen = both.rise(state, wire).height(x)
        np.testing.assert_allclose(risen, expected, atol=0.02 * np.abs(expected).max())
    ours, theirs = (elasticity(line, 100.0) for line in (coinciding(one), one))
    np.testing.assert_allclose(np.interp(theirs[0], *ours), theirs[1], rtol=0.02)


def test_ice_is_on_each_wire_and_a_broken_dropper_lowers_the_one_that_it_held():
    line = changed(FAR, steady_arm={"mass": 1.0, "stiffness": 0.0})  # which carries none of it
    new, iced = (as_run(line, LineCondition(ice=ice), 100.0) for ice in (0.0, 0.2))
    assert [wire.mass for wire in iced.wires] == pytest.approx([0.89 + 0.2, 1.35 + 0.2])
    carried = [sum(each.static_force for each in run.droppers) for run in (new, iced)]
    assert carried[1] - carried[0] == pytest.approx(2 * 0.2 * GRAVITY * line.span_length, rel=1e-3)
    whole = DefectiveLine(FAR.layout(6), LineCondition(broken_droppers=((3, 6),)))  # of the second wire
    rises = [whole.rise(whole.solve(), wire).height(np.array([2 * 60.0 + 27.5]))[0] for wire in (0, 1)]
    assert rises[1] < -0.01
    assert 0 < rises[0] < 0.01  # the messenger rises, as it carries less there


@pytest.mark.slow
@PULSES
def test_undamped_line_keeps_its_energy_for_10_s(height, goes_slack, bar):
    data = undamped(changed(FAR, steady_arm={"mass": 1.0, "stiffness": 0.0}))
    assert swing(data, 10, 300.0, height, goes_slack, uneven.energy)[0] < bar


@pytest.mark.longer
def test_lanes_equal_single_runs_and_a_restarted_one_forgets_the_run_before():
    uneven.test_lanes_of_a_batch_equal_single_runs_bit_for_bit(CA)
    uneven.test_restarted_lane_forgets_the_run_before(CA)


@pytest.mark.longer
def test_the_head_shares_its_force_between_the_wires():
    """Half on each in the mean, and all of it together; a wire carries most just behind its own dropper."""
    plant = Plant(changed(FAR, spans=16), Train.of(DSA), runs=Runs((160 / 3.6, 160 / 3.6)))
    plant.start(0, 160 / 3.6)
    samples, forces = plant.samples(1), []
    while plant.position(0, plant.of(0, Row.STEP))[0] < 480.0:
        plant.advance_passively(1, samples)
        forces.append([plant.of(0, row) for row in (Row.FIRST_FORCE, Row.SECOND_FORCE, Row.CONTACT_FORCE)])
    first, second, total = np.array(forces).T
    np.testing.assert_allclose(first + second, total, atol=1e-9)
    assert min(first.min(), second.min()) >= 0
    half = len(first) // 2
    assert first[half:].sum() / total[half:].sum() == pytest.approx(0.5, abs=0.01)
    assert (first - second)[half:].std() > 10.0
    with pytest.raises(InputError, match="has one wire, and line 'direct-current' has two side by side"):
        Plant(FAR, Train.of(DSA), runs=Runs((44.0, 44.0)), bilateral=True)


@pytest.mark.filterwarnings("ignore:At 3.6 km/h a train passes")
@pytest.mark.parametrize("touched", [1, 2])
def test_a_run_starts_at_rest_where_the_wires_begin_at_unlike_heights(touched):
    """The lower one is 32 mm lower, and carries all, or 3 mm, and carries more."""
    pantograph = DSA.model_copy(update={"static_force": 110.0})
    line = twin.mirrored(FAR if touched == 1 else twin.two_wires(twin.paired()))
    plant = Plant(line, Train.of(pantograph), runs=Runs((1.0, 1.0)), numerics=Numerics(window=0))
    plant.start(0, 1.0)
    nominal = plant.of(0, Row.CONTACT_FORCE)
    assert nominal == pytest.approx(
        plant.of(0, Row.NOMINAL_FORCE), rel=0.02
    )  # but for the spring to the ground
    plant.advance_passively(1, plant.samples(1))
    first, second = plant.of(0, Row.FIRST_FORCE), plant.of(0, Row.SECOND_FORCE)
    assert first + second == pytest.approx(nominal, abs=1.0)
    assert second > first
    assert (first > 0) == (touched == 2)


@pytest.mark.longer
def test_records_show_both_wires_of_each_pantograph(tmp_path):
    given = {"pantographs": [DSA, DSA], "distances": [60.0], "speed_kmh": 160.0, "distance": 800.0}
    run = simulate(CA, **given)
    assert run.uplift.shape[1] == 2 * (run.alignment.spans - 1) == len(run.support_position)
    both = run.uplift[:, [11, 11 + run.alignment.spans - 1]].max(axis=0)
    assert abs(both[1] / both[0] - 1) > 1e-3
    run.save(tmp_path / "run.parquet")
    again = Trajectory.load(tmp_path / "run.parquet")
    np.testing.assert_array_equal(again.support_position, run.support_position)
    for own, its in zip(run.train, again.train, strict=True):
        for name in ("uplift", "second_force"):
            np.testing.assert_array_equal(getattr(its, name), getattr(own, name))
        first = own.contact_force - own.second_force
        assert min(own.second_force.min(), first.min()) >= -1e-9
        late = own.position > 120.0
        assert first[late].mean() == pytest.approx(own.second_force[late].mean(), rel=0.1)
        assert abs(first - own.second_force).max() > 10
    found = {number: uplift for number, _, uplift in Findings(run, "run.parquet").uplifts}
    assert found[12] == both.max()
    alone = simulate(CA, DSA, 160.0, distance=800.0)
    near = (alone.support_position >= 600.0) & (alone.support_position <= 720.0)
    assert near.sum() == 6
    assert alone.summary((11, 12)).max_uplift == alone.uplift[:, near].max()
    assert table_of(run).headings.items() >= {
        ("uplift_0", "uplift at 60 m (m)"),
        ("second_force", "second_force (N)"),
        ("second_force@2", "second_force of pantograph 2 (N)"),
        (f"uplift_{run.alignment.spans - 1}", "uplift of wire 2 at 60 m (m)"),
    }
    one = simulate("en50318-2002", DSA, 160.0, distance=60.0)
    assert one.second_force.size == 0
    assert "second_force" not in table_of(one).headings


def test_a_view_and_a_plot_show_both_wires():
    plant = Plant(CA, Train.of(DSA), runs=Runs((44.0, 44.0)))
    plant.start(0, 44.0)
    plant.advance_passively(6000, plant.samples(1))
    view = plant.model.view(0, 120.0, 300.0)
    ((x, second),) = view.further
    np.testing.assert_array_equal(x, view.x)
    heights = [np.interp(view.droppers, x, each) for each in (view.contact, second)]
    held = plant.model.layout.held[np.searchsorted(plant.model.droppers, view.droppers - 1e-9)]
    np.testing.assert_allclose(view.bottoms, np.where(held == 0, *heights), atol=1e-9)
    assert np.abs(second - view.contact).max() > 1e-3
    wires, contact, _ = plot_line(check(CA, 100.0)).axes
    (second,) = (each for each in wires.lines if each.get_label() == "second contact wire")
    x, height = second.get_data()
    np.testing.assert_allclose(height, hang(CA).second.height(x), atol=1e-12)
    drawn = [each.get_ydata() for each in contact.lines if len(each.get_ydata()) == len(height)]
    assert any(np.allclose(each, 1e3 * height) for each in drawn)


def test_environments_and_policies_take_both_wires():
    """Lanes as single ones; a policy that knows the line knows tension and mass of both together."""
    settings = {"catenary": "ca-160", "pantograph": "dsa250", "speed_kmh": 160.0}
    check_lanes_are_singles("Pantograph-v0", settings, steps=30, lanes=2)
    one = twin.direct_current()
    np.testing.assert_allclose(line_values(twin.two_wires(one)), line_values(one), rtol=1e-12)
    both, equal = (mean_line(SimpleNamespace(catenary=line)) for line in (twin.two_wires(one), one))
    assert both.damper == pytest.approx(equal.damper)
    assert both.spring == pytest.approx(equal.spring)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stitch_wire": {"length": 12.0, "tension": 2e3, "mass": 0.3}}, "not computed with stitch wires"),
        (
            {"sequence": [{}] * 12, "overlaps": [{"first_span": 5, "rises": [0.1, 0.5]}]},
            "not computed with overlaps, which line 'ca-160' has; leave these out, or give contact_wires = 1",
        ),
        ({"steady_arm": {"mass": 0.9, "length": 1.1}}, "with steady arms whose length is given"),
        (
            {"contact_wire": CA.contact_wire.model_dump(exclude_none=True) | {"axial_stiffness": 1e7}},
            "with wires that are fixed at both ends",
        ),
        (
            {"contact_wires": 1, "droppers": {"spacing": 6.0, "stiffness": 1e5, "wire": [1, 2] * 5}},
            "have a wire each, but it has one contact wire; give contact_wires = 2",
        ),
        ({"plan": {"stagger": [0.2, -0.2]}}, "not computed with a plan"),
        ({"contact_wires": 3}, "contact_wires"),
        (
            {"droppers": {"spacing": 6.0, "stiffness": 1e5, "wire": [2] * 10}},
            "In span 1 of line 'ca-160' the droppers hold one of its two contact wires only",
        ),
        (
            {"droppers": {"spacing": 6.0, "stiffness": 1e5, "wire": [1, 2]}},
            "10 positions are given, but 2 wires",
        ),
    ],
)
def test_what_is_not_computed_with_two_wires_is_refused(changes, message):
    with pytest.raises((InputError, ValueError), match=message):
        changed(CA, **changes)


@pytest.mark.parametrize(
    "own", [{"hard_spots": [(4, 20.0, 1.0, 0.0)]}, {"worn_stretches": [(4, 10.0, 20.0, 0.1)]}], ids=list
)
def test_defects_of_the_contact_wire_itself_are_refused(own):
    with pytest.raises(InputError, match=r"'ca-160' has two contact wires, on which hard_spots and worn_"):
        simulate("ca-160", DSA, 160.0, line_condition=own)


@pytest.mark.longer
def test_a_window_about_the_train_gives_what_the_whole_line_does():
    runs = [
        simulate(FAR, DSA, 160.0, distance=1320.0, window=window).summary((10, 19)) for window in (0, None)
    ]
    for name in ("mean", "std", "max", "min", "max_uplift"):
        assert getattr(runs[1], name) == pytest.approx(getattr(runs[0], name), rel=0.01), name
