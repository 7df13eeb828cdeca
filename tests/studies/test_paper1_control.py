"""Paper 1's control study: its helpers, and every figure that it prints beside the paper's."""

import math
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from panto_env import simulate
from panto_env.plant.alignment import Alignment
from panto_env.policies import find_policy
from panto_env.studies import write
from panto_env.studies.paper1_control import passes
from panto_env.studies.paper1_control.passes import STRONG, THETAS, control

from ..pages import check_page, check_statements, same_row, statements_table, tables_of
from . import made, table

PAGE = "paper1-control.md"
CLAIMS = "The paper's claims beside ours"
LEFT_TO_THE_COMMAND = (
    "Phase angle of the feed-forward",
    "Linear model",
    "Over speed",
    "What the contact force",
    "CL (%) of FB+FF",
    "CL (%) over speed",
    "Actuators",
    "Time step and grid",
)
"""What titles of tables begin with that the page does not show."""


def test_the_policy_is_named_with_the_parameters_that_are_meant():
    policy = find_policy(control(1.25, amplitude=7.0, theta=THETAS[3], reading=passes.MS))
    assert (policy.gains, policy.amplitude, policy.theta) == ({0.0: 1.25}, 7.0, THETAS[3])
    assert (policy.reading, policy.speed_unit) == ("printed", "m/s")


def test_the_angles_go_once_round_and_meet_the_papers():
    turns = sorted(math.remainder(theta, 2 * math.pi) for theta in THETAS)
    assert turns == pytest.approx(np.linspace(-11, 12, 24) * math.pi / 12)
    assert min(abs(theta - math.pi / 6) for theta in THETAS) < 1e-12


@pytest.fixture
def short(monkeypatch):
    """Passes over eight spans, of which the last are looked at."""
    monkeypatch.setattr(passes, "SPANS", (4, 6))
    monkeypatch.setattr(passes, "RUN_SPANS", 8)


@pytest.mark.longer
def test_a_lane_is_the_pass_that_simulate_makes(short):
    cases = [passes.sampled(400, control(0.5), "realistic"), passes.sampled(400, "passive", "realistic")]
    for case, record in zip(cases, passes.records(cases), strict=True):
        alone = simulate(
            passes.LINE, passes.PANTOGRAPH, 400, case.policy, actuator="realistic",
            control_interval=passes.SAMPLED, distance=record.position[-1], **passes.USUAL,
        )  # fmt: skip
        n = len(alone.contact_force)
        assert n > 0.95 * len(record.contact_force)
        assert np.array_equal(record.contact_force[:n], alone.contact_force)


def test_what_is_kept_of_a_pass():
    """Of a force that is known: 54 N, 9 N once per span, 4 N at 11 Hz, and lost for 30 ms."""
    run = SimpleNamespace(
        time_step=1e-3, alignment=Alignment.equal(50.0, 20), inside=lambda spans: slice(None)
    )
    run.summary, run.position = lambda spans: "figures", np.arange(0.0, 800.0, 0.1)  # at 100 m/s
    wave = 9 * np.cos(2 * np.pi * run.position / 50 + 0.5) + 4 * np.sin(2 * np.pi * 11 * run.position / 100)
    run.contact_force = 54 + wave
    kept = passes.result_of(passes.Case(360), run)
    assert kept.once_per_span == pytest.approx(9 * np.exp(0.5j), abs=1e-6)
    assert kept.bands == pytest.approx((9 / math.sqrt(2), 4 / math.sqrt(2), 0.0), abs=0.01)
    assert (kept.raw_std, kept.longest_loss) == (pytest.approx(math.hypot(*kept.bands), rel=1e-3), 0.0)
    run.contact_force[[50, 52, *range(100, 130)]] = 0.0
    assert passes.result_of(passes.Case(360), run).longest_loss == pytest.approx(0.03)


@pytest.mark.parametrize(("frequency", "gain", "damping"), [(2, 1.75, 0), (11, 0, 150), (22, 1, 150)])
def test_amplification_follows_the_papers_equations_of_motion(frequency, gain, damping):
    """Eqs 1 and 2 with Table 2, written out by head, frame and contact force, over an endless string."""
    s = 2j * math.pi * frequency
    contact, wire = 32992 + 12.31 * s, 2 * math.sqrt(19.6e3 * 0.99) * s
    spring, ground = 14544 + 0.11 * s, 611.85 + 50.92 * s

    def force(gain, damping):
        system = [
            [5 * s**2 + spring, -spring, 1],
            [-spring, 10.38 * s**2 + spring + ground + damping * s, gain],
            [-contact, 0, 1 + contact / wire],
        ]
        return np.linalg.solve(system, [0, 0, -contact])[2]

    expected = abs(force(gain, damping) / force(0, 0))
    assert passes.amplification(frequency, gain, damping) == pytest.approx(expected, rel=1e-9)


@pytest.mark.longer
def test_the_passive_pantograph_has_the_mean_asked_for_and_the_same_nominal_force(short):
    result = passes.passive_at_mean(400, 48.0)
    assert result.figures.mean == pytest.approx(48.0, abs=0.1)
    assert result.mean_deviation > 54 - 48.0  # CF counts from 54 N, not from the larger static force


@pytest.fixture(scope="module")
def outcome():
    return made("paper1-control")


@pytest.mark.study
def test_gains_are_chosen_by_the_rules_that_their_comments_give(outcome):
    """Least gain without loss; least of the largest losses with the realistic actuator."""
    rows = [[float(cell) for cell in row] for row in table(outcome, "over the gain").rows]
    free = [row[0] for row in rows if max(row[1:4]) == 0]
    assert min(free) == passes.GAIN
    assert not [row for row in rows if max(row[4:7]) == 0]  # sampled every 10 ms, none is free of loss
    assert min(rows, key=lambda row: max(row[7:10]))[0] == passes.REAL_GAIN
    assert [row[0] for row in rows] == list(passes.GAINS)


@pytest.mark.study
def test_contact_is_kept_where_the_page_says_so_and_lost_at_400_kmh_on_the_other_line(outcome):
    found = table(outcome, "Time step and grid")
    usual, fine = (k for k, heading in enumerate(found.headings) if heading.startswith("CL"))
    lost = {(row[0], row[1]): (float(row[usual]), float(row[fine])) for row in found.rows}
    for name in ("frame damping alone", "FB + frame damping", passes.SHIPPED, STRONG):
        slower = [lost[f"{passes.LINE}, realistic: {name}", speed] for speed in ("300", "350")]
        assert slower == [(0, 0)] * 2
    for name, speed in (
        ("ideal: passive", "300"),
        (f"ideal: FB+FF, gain {passes.GAIN}", "350"),
        (f"realistic: {STRONG}", "300"),
        (f"realistic: {STRONG}", "350"),
    ):
        assert lost[f"{passes.OTHER_LINE}, {name}", speed] == (0, 0)
    other = [each for (name, speed), each in lost.items() if passes.OTHER_LINE in name and speed == "400"]
    assert min(map(min, other)) > 15  # whatever the control
    worst = {row[0]: [float(cell) for cell in row[1:]] for row in table(outcome, "of 300, 350 and 400").rows}
    assert worst["FB + frame damping"][:2] == [0, 0]  # ideal, delay of 5 ms
    assert worst[passes.SHIPPED][:3] == [0, 0, 0]  # lag of 15 ms
    assert worst[STRONG] == [0, 0, 0, 0]  # realistic


@pytest.mark.study
def test_a_lower_gain_with_twice_the_damping_keeps_contact_at_all_speeds(outcome):
    """With the realistic actuator and on both grids; so do the dampings beside it."""
    found = table(outcome, "pd over gain and damping")
    column = found.headings.index(f"gain {passes.STRONG_GAIN:g}")
    free = [float(row[0]) for row in found.rows if row[column] == "0.00"]
    assert free == [k for damping in (250.0, passes.STRONG_DAMPING, 350.0) for k in (damping, damping)]
    over_speed = table(outcome, "over speed on both grids")
    column = over_speed.headings.index(f"{STRONG}, realistic actuator")
    assert len(over_speed.rows) == 2 * len(passes.SPEEDS)
    assert {row[column] for row in over_speed.rows} == {"0.00"}


@pytest.mark.study
def test_a_finer_grid_and_time_step_say_the_same(outcome):
    """But of the strong feedback through the realistic actuator, which hammers the wire."""
    for name, speed, *cells in table(outcome, "Time step and grid").rows:
        loss, fine_loss, mean, fine_mean, _, _, cost, fine_cost = map(float, cells)
        if str(name).endswith(f"realistic: FB+FF, gain {passes.GAIN}"):
            assert min(loss, fine_loss) > 15
            continue
        assert fine_loss == pytest.approx(loss, abs=0.1, rel=0.02), (name, speed)
        assert (fine_loss == 0) == (loss == 0), (name, speed)
        assert fine_mean == pytest.approx(mean, abs=0.11), (name, speed)
        assert fine_cost == pytest.approx(cost, rel=0.005), (name, speed)
    for words in ("over speed on both grids", "pd over gain and damping"):
        rows = table(outcome, words).rows
        for usual, fine in zip(rows[::2], rows[1::2], strict=True):
            assert usual[0] == fine[0]
            assert [*map(float, fine[2:])] == pytest.approx([*map(float, usual[2:])], abs=0.1), usual
    best = [row[2] for row in table(outcome, "Phase angle").rows]
    speeds = len(passes.ANGLE_SPEEDS)
    assert best[:speeds] == best[speeds : 2 * speeds]


def test_a_row_of_the_page_is_known_by_every_cell():
    same = partial(same_row, "Actuators", ["control", "CL (%)", "σ (N)"])
    for row, other, alike in (
        ("a 0.52 16.1", "a 0.53 16.1", True),
        ("a 0.52 16.1", "b 0.52 16.1", False),
        ("a 0.52 16.1", "a 0.54 16.1", False),
        ("a 9.52 16.1", "a 9.52 16.3", False),
        ("a 31.49 50.1", "a 32.67 51.0", True),
        ("a 31.49 50.1", "a 31.49 53.0", False),
    ):
        assert same(row.split(), other.split()) == alike


@pytest.mark.study
def test_the_page_shows_what_the_study_prints(outcome):
    """Each table of the page with a title above it, cell by cell; all claims that do not hold among them."""
    assert all(item.note for item in outcome.comparisons if not item.agrees)
    printed = {each.title: each for each in outcome.tables}
    printed[CLAIMS] = statements_table(CLAIMS, ("claim", "unit", "ours", "the paper", "agrees"), outcome)
    shown = tables_of(PAGE)
    assert set(printed) - set(shown) == {title for title in printed if title.startswith(LEFT_TO_THE_COMMAND)}
    check_statements(PAGE, CLAIMS, outcome)
    check_page(PAGE, printed)


@pytest.mark.study
def test_the_outcome_is_written_with_a_picture_a_figure(outcome, tmp_path):
    names = {path.name for path in write(outcome, tmp_path)}
    assert {name[:5] for name in names if name.endswith(".png")} == {f"fig{n}" for n in range(13, 19)}
