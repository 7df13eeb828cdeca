"""The plan of a line: reference figures of an independent model (prototypes' cases 1 to 4), and closed forms.

The reference has x along the track, positions and wind positive to the outside of a curve: of one to the left
that is to the right, as here.
"""

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.metrics.strip import strip_use, swept
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.defects import DefectiveLine
from panto_env.plant.catenary.flexible.plan import (
    contact_wire_at,
    in_wind,
    plan_view,
    pulled_arms,
    steady_arms,
    wind_loads,
)
from panto_env.plant.line_condition import LineCondition

ARM = {"mass": 1.5, "length": 1.2}
ZIGZAG, CURVE = {"stagger": (0.3, -0.3)}, {"stagger": (0.3,), "radius": -1000.0}


def line_with(plan=None, base="en50318-2002", **changes):
    table = load_catenary(base).model_dump(exclude={"sources"}, exclude_none=True)
    return FlexibleCatenaryData.model_validate(table | ({"plan": plan} if plan else {}) | changes)


# Stagger, wind; place and position of the contact wire where it is furthest out in span 8 (or 9, where that
# is in the reference's places beyond 60 m), mid-span of both wires, radial forces at 420 and 480 m, messenger
CASES = {
    "straight": (ZIGZAG, (0, 0), None, (0, 0), (-400.00, 400.00), -320.00),
    "straight, wind": (ZIGZAG, (8, 8), (66.16, 0.3077), (0.1898, 0.2127), (-899.62, -99.62), -780.38),
    "wind on the contact wire": (ZIGZAG, (8, 0), None, (0.1407, 0.0491), (-801.51, -1.51), -398.49),
    "messenger in the middle": (
        ZIGZAG | {"messenger_stagger": (0.0,)}, (0, 0), None, (0, 0), (-463.25, 463.25), 63.25,
    ),
    "messenger in the middle, wind": (
        ZIGZAG | {"messenger_stagger": (0.0,)}, (8, 8), (62.27, 0.3010), (0.1898, 0.2127), (-962.87, -36.37),
        -397.13,
    ),
    "curve": (CURVE, (0, 0), None, (-0.15, -0.15), (1200.0, 1200.0), 960.0),
    "curve, wind outward": (CURVE, (8, 8), None, (0.0398, 0.0627), (700.38, 700.38), 499.62),
    "curve, wind inward": (CURVE, (-8, -8), (30.0, -0.3398), (-0.3398, -0.3627), (1699.62, 1699.62), 1420.38),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_plan_is_the_reference_s_within_a_millimetre_and_a_newton(name):
    plan, wind, furthest, middle, radial, messenger = CASES[name]
    view = plan_view(line_with(plan).layout(14), wind)
    place, out = view.furthest(8 if furthest and furthest[0] > 60 else 7)
    if furthest is None:
        assert abs(out) == pytest.approx(0.3, abs=1e-3)
    else:
        assert (place - 420, out) == (
            pytest.approx(furthest[0], abs=0.05),
            pytest.approx(furthest[1], abs=1e-3),
        )
    for wire in range(2):
        assert view.at(np.array([450.0]), wire)[0] == pytest.approx(middle[wire], abs=1e-3)
    assert view.forces[0, 7:9] == pytest.approx(radial, abs=1)
    assert view.forces[1, 7] == pytest.approx(messenger, abs=1)


def test_a_curve_to_the_right_is_one_to_the_left_in_a_mirror():
    left = plan_view(line_with(CURVE).layout(14), (5.0, 3.0))
    right = plan_view(line_with({"stagger": (-0.3,), "radius": 1000.0}).layout(14), (-5.0, -3.0))
    assert right.lateral == pytest.approx(-left.lateral, abs=1e-12)
    assert right.forces[:, 1:-1] == pytest.approx(-left.forces[:, 1:-1], abs=1e-6)


@pytest.mark.parametrize("seed", range(2))
def test_any_plan_balances_and_its_wires_are_strings(seed):
    """What is given holds by itself: the sum of forces, and T y'' of the parabolas between droppers."""
    random = np.random.default_rng(seed)
    spans = [{"span_length": float(length)} for length in random.uniform(45, 65, 9)]
    masts = [
        {"stagger": float(a), "messenger_stagger": float(b), "radius": float(radius)}
        for a, b, radius in zip(
            *random.uniform(-0.4, 0.4, (2, 10)), random.choice([-900, 700, 2e4], 10), strict=True
        )
    ]  # fmt: skip
    line = line_with({"wind": (4.0, -2.0)}, sequence=spans, masts=masts, spans=9)
    view = plan_view(line.layout())
    lengths, tensions = np.diff(view.places), np.array(view.tensions)[:, None]
    assert view.load[0] == pytest.approx(np.repeat([4.0], len(lengths)) + view.tensions[0] * (
        view.curvature[np.searchsorted(view.supports, view.places[1:] - 1e-6) - 1]))  # fmt: skip
    begin = tensions * np.diff(view.lateral)[:, :1] / lengths[0] + view.load[:, :1] * lengths[0] / 2
    end = -tensions * np.diff(view.lateral)[:, -1:] / lengths[-1] + view.load[:, -1:] * lengths[-1] / 2
    held = np.nansum(view.forces) - begin.sum() - end.sum()  # with those of both anchors
    assert held + (view.load * lengths).sum() == pytest.approx(
        0, abs=1e-6 * np.abs(view.load * lengths).sum() + 1e-3
    )
    x, h = np.array([view.places[5] + 0.4 * lengths[5]]), 0.05
    for wire in range(2):
        second = (view.at(x + h, wire) - 2 * view.at(x, wire) + view.at(x - h, wire)) / h**2
        assert second[0] == pytest.approx(-view.load[wire, 5] / view.tensions[wire], rel=1e-6)


STRIPS = {
    "straight": (ZIGZAG, (0, 0), dict.fromkeys((-0.3, -0.2, -0.1, 0, 0.1, 0.2), 0.1667)),
    "wind": (
        ZIGZAG, (8, 8),
        {-0.3: 0.0773, -0.2: 0.0851, -0.1: 0.0961, 0: 0.1132, 0.1: 0.1459, 0.2: 0.2773, 0.3: 0.2052},
    ),
    "curve": (CURVE, (0, 0), {-0.2: 0.3333, -0.1: 0.2440, 0: 0.1680, 0.1: 0.1366, 0.2: 0.1181}),
}  # fmt: skip


@pytest.mark.parametrize("name", STRIPS)
def test_shares_of_strips_are_the_reference_s(name):
    plan, wind, expected = STRIPS[name]
    x = 420 + (np.arange(120_000) + 0.5) / 1000
    found = swept(contact_wire_at(line_with(plan).layout(14), x, wind), np.ones_like(x), 0.1)
    assert found.edges[:-1] == pytest.approx(list(expected), abs=1e-6)
    assert found.way == pytest.approx(list(expected.values()), abs=2e-4)
    assert found.wear == pytest.approx(found.way)  # under an even force


def test_wear_is_weighted_by_the_force():
    lateral, force = np.linspace(-0.2, 0.2, 4001), np.where(np.linspace(-0.2, 0.2, 4001) < 0, 300.0, 100.0)
    found = swept(lateral, force, 0.1)
    assert found.wear == pytest.approx([0.375, 0.375, 0.125, 0.125], abs=1e-3)
    assert (found.evenness, found.width) == (pytest.approx(0.25 / 0.375, abs=2e-3), pytest.approx(0.4))


@pytest.mark.parametrize(
    ("plan", "degrees", "stiffness"),
    [({"stagger": (0.2, -0.2)}, 15.41, 299), (ZIGZAG, 10.42, 373), (CURVE, 3.51, 1008)],
)
def test_a_steady_arm_is_the_reference_s_pendulum(plan, degrees, stiffness):
    arm = pulled_arms(line_with(plan, steady_arm=ARM).layout(14))[6]
    assert np.degrees(np.arctan(arm.slope)) == pytest.approx(degrees, abs=0.02)
    assert arm.stiffness == pytest.approx(stiffness, abs=0.5)
    assert arm.mass == pytest.approx(0.5)
    every = steady_arms(line_with(plan, steady_arm=ARM).layout(5))
    assert every.stiffness == pytest.approx(np.full(5, arm.stiffness), rel=1e-6)


def test_an_arm_that_holds_no_wire_carries_itself_alone():
    arm = ARM | {"holds_wire": False, "clamp_mass": 0.5}
    alike = pulled_arms(line_with(ZIGZAG, steady_arm=arm).layout(14))[6]
    assert alike.slope == pytest.approx(9.81 * (1.5 / 2 + 0.5) / 400, rel=1e-3)
    assert alike.mass == pytest.approx(0.5 + 0.5)
    unlike = pulled_arms(line_with(ZIGZAG, steady_arm=arm, sequence=[{}] * 14, spans=14).layout())[6]
    assert unlike == pytest.approx(alike, rel=1e-3)


def run(line, speed, **settings):
    """Figures of the reference's window on 14 spans."""
    run = simulate(line, "dsa380", speed, spans=14, window=0, distance=720.0, **settings)
    return run.summary((8, 11))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "plan", "waves", "whole"),
    [
        (250, {"stagger": (0.2, -0.2)}, False, 27.25),
        (250, ZIGZAG, False, 27.24),
        (250, ZIGZAG, True, 27.24),
        (300, {"stagger": (0.2, -0.2)}, True, 32.84),
        (300, ZIGZAG, True, 34.03),
        (300, CURVE, True, 35.91),
    ],
)
def test_with_sideways_waves_a_run_is_the_reference_s_in_three_dimensions(speed, plan, waves, whole):
    """Against the reference without arms, as above. Without waves it is 6 % off at 300 km/h and 0.2 m."""
    expected = whole / {250: 27.90, 300: 33.95}[speed]
    line = line_with(plan | {"sideways_waves": waves}, steady_arm=ARM)
    found = run(line, speed).std / run(line_with(), speed).std
    assert found == pytest.approx(expected, rel=0.025)
    if (speed, waves) == (300, True) and plan is not CURVE:
        still = run(line_with(plan, steady_arm=ARM), speed).std / run(line_with(), speed).std
        assert abs(found - expected) < abs(still - expected)


def test_waves_that_run_off_damp_and_do_not_hold():
    arms = steady_arms(line_with(ZIGZAG, steady_arm=ARM).layout(6))
    slope = np.tan(np.radians(10.42))
    assert arms.sideways == pytest.approx(np.full(6, 2 * 20e3 / 60 * slope**2), rel=2e-3)
    assert arms.radiation == pytest.approx(np.full(6, 2 * np.sqrt(20e3 * 1.35) * slope**2), rel=2e-3)
    assert arms.in_motion(False)[0] == pytest.approx(arms.stiffness)
    assert arms.in_motion(True)[0] == pytest.approx(arms.stiffness - arms.sideways)


def test_a_storm_raises_and_lowers_supports_as_the_reference_s():
    """8 N/m change the pull by 500 N at a slope of 10.4 degrees: 18 and 22 mm."""
    line = line_with(ZIGZAG | {"wind": (8.0, 8.0)}, steady_arm=ARM)
    layout = in_wind(line, 14, [LineCondition()]).layout()
    arms = pulled_arms(layout)
    assert [arm.pull for arm in arms[6:8]] == pytest.approx([899.6, -99.6], abs=1)
    assert arms[6].lift == pytest.approx(500 * arms[6].slope, rel=0.01)
    rested = DefectiveLine(layout, LineCondition())
    rise = 1e3 * rested.rise(rested.solve()).height(np.array([420.0, 480.0]))
    assert rise == pytest.approx([18, -22], abs=0.8)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "still", "storm"), [(250, 27.24, 30.62), (300, 34.03, 38.62)])
def test_a_storm_makes_a_run_worse_as_the_reference_s(speed, still, storm):
    calm = run(line_with(ZIGZAG, steady_arm=ARM), speed).std
    blown = run(line_with(ZIGZAG | {"wind": (8.0, 8.0)}, steady_arm=ARM), speed).std
    assert blown / calm == pytest.approx(storm / still, rel=0.03)


def test_wind_of_a_condition_and_of_the_plan_are_the_same():
    line = line_with(ZIGZAG, steady_arm=ARM)
    loads = wind_loads(line, 28.0)
    assert loads[0] == pytest.approx(0.5 * 1.225 * 1.2 * 28**2 * 2 * np.sqrt(1.35 / 8900 / np.pi), rel=1e-9)
    assert wind_loads(line, -28.0) == pytest.approx([-each for each in loads])
    one = in_wind(line, 14, [LineCondition(side_wind=28.0)])
    other = in_wind(line_with(ZIGZAG | {"wind": loads}, steady_arm=ARM), 14, [LineCondition()])
    assert steady_arms(one.layout()).lift == pytest.approx(steady_arms(other.layout()).lift)
    assert in_wind(line, 14, [LineCondition()]) is line
    plain = line_with(ZIGZAG)
    assert in_wind(plain, 14, [LineCondition(side_wind=28.0)]) is plain


@pytest.mark.longer
@pytest.mark.filterwarnings("ignore")
def test_in_unlike_winds_arms_are_as_in_still_air():
    line = line_with(ZIGZAG, steady_arm=ARM)
    conditions = [LineCondition(), LineCondition(side_wind=28.0)]
    with pytest.warns(AccuracyWarning, match="pulled as in still air.*make a run for each"):
        assert in_wind(line, 14, conditions) is line
    blown = line_with(ZIGZAG | {"wind": (4.0, 4.0)}, steady_arm=ARM)
    with pytest.warns(AccuracyWarning, match="pulled as in still air"):
        assert in_wind(blown, 14, conditions) == line
    with pytest.warns(AccuracyWarning, match="pulled as in still air"):
        found = {
            simulate(line, "dsa380", 200, line_condition=conditions, seed=k).summary().std for k in (0, 1, 2)
        }
    assert len(found) == 3  # the gusts blow on the wires


def test_a_plan_without_lengths_of_arms_changes_no_run():
    plain, planned = (run(line, 250, line_condition="as-built") for line in (line_with(), line_with(ZIGZAG)))
    assert plain == planned


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steady_arm": {"mass": 1.0, "length": 1.2, "stiffness": 300.0}}, "its stiffness or its length"),
        ({"steady_arm": {"mass": 1.0}}, "either its stiffness or its length"),
        ({"steady_arm": {"mass": 1.0, "stiffness": 0.0, "clamp_mass": 0.2}}, "clamp_mass of a steady arm"),
        ({"plan": {"stagger": (0.3, -0.3), "radius": 40.0}}, "100 m or more to either side, not 40 m"),
        ({"plan": {"stagger": (1.3,)}}, "stagger"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name(changes, message):
    with pytest.raises(ValueError, match=message):
        line_with(**changes)


def in_sequence(count, **changes):
    return line_with(steady_arm=ARM, sequence=[{}] * count, spans=count, **changes)


@pytest.mark.longer
def test_unlike_arms_need_a_sequence_and_stagger_and_pull():
    masts = [{"stagger": 0.299 if k == 5 else 0.3 * (-1) ** k} for k in range(13)]
    for line, message in (
        (line_with(steady_arm=ARM), r"Support 1 of line .* has no stagger; give plan.stagger"),
        (
            line_with({"stagger": (0.01, -0.01)}, steady_arm=ARM),
            r"is pulled with 13 N only and carries 74 N, .* slope by 80°",
        ),
        (
            line_with({"stagger": (0.3, -0.3, -0.3)}, steady_arm=ARM),
            r"pulled with .* and a line whose spans are all alike has equal ones",
        ),
        (in_sequence(12, masts=masts), r"The steady arm at support [67] of .* give more stagger there"),
    ):
        with pytest.raises(InputError, match=message):
            simulate(line, "dsa380", 250)
    line = in_sequence(12, plan={"stagger": (0.3, -0.3, -0.2)})
    assert len(set(np.round(steady_arms(line.layout()).stiffness, 3))) > 2
    assert simulate(line, "dsa380", 200, distance=480.0).summary((6, 7)).std > 0
    aside = line_with({"stagger": (0.3, -0.1)}, steady_arm=ARM)  # 0.4 m from side to side
    assert steady_arms(aside.layout(5)).stiffness.std() < 1e-6


def test_a_run_tells_where_on_the_strips_the_wire_was_within_its_survey():
    run_of = simulate(line_with(ZIGZAG), "dsa380", 250, distance=900.0)
    assert run_of.designed.line.plan.stagger == (0.3, -0.3)
    surveyed = line_with(masts=[{"stagger": 0.3 * (-1) ** k} for k in range(13)], spans=12)
    within = simulate(surveyed, "dsa380", 250, spans=12, distance=600.0)
    for found in (strip_use(run_of), strip_use(within, (6, 8))):
        assert found.width == pytest.approx(0.6)
        assert 0.8 < found.evenness <= 1
        assert found.way.sum() == pytest.approx(1)
        assert found.wear.sum() == pytest.approx(1)
    assert strip_use(simulate(surveyed, "dsa380", 250, spans=20, distance=900.0)) is None
    assert strip_use(simulate(distance=900.0)) is None


def test_overlapping_wires_have_the_plan_of_the_line():
    overlap = {"first_span": 7, "rises": (0.1, 0.5)}
    line = in_sequence(14, plan={"stagger": (0.3, -0.3)}, overlaps=(overlap,))
    parts = line.layout().tension_lengths
    assert [part.first_span for part in parts] == [0, 6]
    views = [plan_view(part.layout) for part in parts]
    assert views[1].stagger[0] == pytest.approx(views[0].stagger[0, 6] * np.resize([1, -1], 9))
    x = np.linspace(0, 840, 500)
    assert np.abs(contact_wire_at(line.layout(), x)).max() == pytest.approx(0.3, abs=1e-3)
    assert simulate(line, "dsa380", 200, distance=700.0).summary((8, 9)).std > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "plan", "none", "arms"),
    [
        (250, ZIGZAG, 27.90, 27.44), (250, CURVE, 27.90, 28.90),
        (300, {"stagger": (0.2, -0.2)}, 33.95, 34.75), (300, ZIGZAG, 33.95, 34.92),
        (300, CURVE, 33.95, 35.87),
    ],
)  # fmt: skip
def test_arms_change_a_run_as_in_the_reference_s_plane(speed, plan, none, arms):
    """Ratios, since the two grids differ by up to 3 % in sigma at 300 km/h (the reference's own says so)."""
    without = run(line_with(), speed)
    found = run(line_with(plan, steady_arm=ARM), speed)
    assert found.std / without.std == pytest.approx(arms / none, rel=0.02)
