"""Paper 1's control study: its helpers, and every figure that it prints beside the paper's."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from panto_env import simulate
from panto_env.control.settings import run_settings
from panto_env.control.task import Task
from panto_env.policies import find_policy
from panto_env.studies import Outcome, Table, find_study, write
from panto_env.studies.paper1_control.angles import wrap
from panto_env.studies.paper1_control.cases import (
    ACTUATORS,
    GAIN,
    GAINS,
    LINE,
    MS,
    PANTOGRAPH,
    REAL_GAIN,
    SAMPLED,
    SHOWN_SPEEDS,
    THETAS,
    USUAL,
    Case,
    all_cases,
    control,
    sampled,
)
from panto_env.studies.paper1_control.linear import amplification
from panto_env.studies.paper1_control.passes import band_rms, longest, passive_at_mean, records, run

# --- helpers -------------------------------------------------------------------------------------


def test_the_policy_is_named_with_the_parameters_that_are_meant() -> None:
    policy = find_policy(control(1.25, amplitude=7.0, theta=THETAS[3], reading=MS))
    assert (policy.gains, policy.amplitude, policy.theta) == ({0.0: 1.25}, 7.0, THETAS[3])  # type: ignore[attr-defined]
    assert (policy.reading, policy.speed_unit) == ("printed", "m/s")  # type: ignore[attr-defined]


def test_the_angles_go_once_round_and_meet_the_papers() -> None:
    assert sorted(wrap(theta) for theta in THETAS) == pytest.approx(np.linspace(-11, 12, 24) * math.pi / 12)
    assert min(abs(theta - math.pi / 6) for theta in THETAS) < 1e-12
    assert wrap(1.5 * math.pi) == pytest.approx(-0.5 * math.pi)


def test_no_pass_is_made_twice_and_every_actuator_is_known() -> None:
    cases = all_cases()
    assert len(set(cases)) == len(cases)
    for actuator in {case.actuator for case in cases}:
        Task(run_settings({"actuator": ACTUATORS[actuator]}))


@pytest.mark.parametrize(
    ("lost", "samples"), [([], 0), ([0, 0], 0), ([1, 1, 0, 1], 2), ([0, 1, 1, 1], 3), ([1] * 4, 4)]
)
def test_longest_loss_counts_samples_in_a_row(lost: list[int], samples: int) -> None:
    assert longest(np.array(lost, dtype=bool)) == samples


def test_a_lane_is_the_pass_that_simulate_makes() -> None:
    cases = [sampled(400, control(0.5), "realistic"), sampled(400, "passive", "realistic")]
    for case, record in zip(cases, records(cases), strict=True):
        alone = simulate(
            LINE, PANTOGRAPH, 400, case.policy, actuator="realistic", control_interval=SAMPLED,
            distance=record.position[-1], **USUAL,
        )  # fmt: skip
        n = len(alone.contact_force)
        assert n > 0.98 * len(record.contact_force)
        assert np.array_equal(record.contact_force[:n], alone.contact_force)


def test_bands_hold_the_power_of_the_sines_in_them() -> None:
    time = np.arange(2000) * 0.002
    force = 50 + 3 * np.sin(2 * np.pi * 5 * time) + 4 * np.sin(2 * np.pi * 10 * time)
    assert band_rms(force, 0.002, 0.0, 7.0) == pytest.approx(3 / math.sqrt(2))
    assert band_rms(force, 0.002, 7.0, 15.0) == pytest.approx(4 / math.sqrt(2))
    assert band_rms(force, 0.002, 0.0, 30.0) == pytest.approx(force.std())


def test_bands_and_the_part_once_per_span_stay_below_the_whole() -> None:
    (result,) = run([Case(400)])
    rms = math.hypot(*result.bands)
    assert 0.9 * result.raw_std < rms < result.raw_std
    assert 0.3 * result.bands[0] < abs(result.once_per_span) / math.sqrt(2) < result.bands[0]


@pytest.mark.parametrize("frequency", [2.0, 11.0, 22.0])
@pytest.mark.parametrize(("gain", "damping"), [(1.75, 0.0), (0.0, 150.0), (1.0, 150.0)])
def test_amplification_follows_the_papers_equations_of_motion(
    frequency: float, gain: float, damping: float
) -> None:
    """Eqs 1 and 2 with Table 2, written out by head, frame and contact force, over an endless string."""
    s = 2j * math.pi * frequency
    contact, wire = 32992 + 12.31 * s, 2 * math.sqrt(19.6e3 * 0.99) * s
    spring, ground = 14544 + 0.11 * s, 611.85 + 50.92 * s

    def force(gain: float, damping: float) -> complex:
        system = [
            [5 * s**2 + spring, -spring, 1],
            [-spring, 10.38 * s**2 + spring + ground + damping * s, gain],
            [-contact, 0, 1 + contact / wire],
        ]
        return complex(np.linalg.solve(system, [0, 0, -contact])[2])

    expected = abs(force(gain, damping) / force(0, 0))
    assert amplification(frequency, gain, damping) == pytest.approx(expected, rel=1e-9)


def test_the_passive_pantograph_has_the_mean_asked_for_and_the_same_nominal_force() -> None:
    result = passive_at_mean(400, 48.0)
    assert result.figures.mean == pytest.approx(48.0, abs=0.1)
    assert result.mean_deviation > 54 - 48.0  # CF counts from 54 N, not from the larger static force


# --- the study -----------------------------------------------------------------------------------


EXPECTED = {  # ours, and how far it may move before somebody must look
    "CL without control, 400 km/h": (5.73, 0.3),
    "CL with FB+FF, gain 1.75, 300 km/h": (0.0, 0.0),
    "CL with FB+FF, gain 1.75, 350 km/h": (0.0, 0.0),
    "CL with FB+FF, gain 1.75, 400 km/h": (0.0, 0.0),
    "CL with FB+FF, gain 1, 300 km/h": (1.43, 0.3),
    "CL with FB+FF, gain 1, 350 km/h": (0.78, 0.3),
    "CL with FB+FF, gain 1, 400 km/h": (0.0, 0.0),
    "largest CL with FB+FF, gain 1.75, 100-400 km/h": (0.0, 0.0),
    "largest CL with FB+FF, gain 1.75, 300-400 km/h, realistic actuator": (33.6, 3.0),
    "largest CL with FB+FF, best gain 0.25, 300-400 km/h, realistic actuator": (4.76, 0.3),
    "raw σ with over without control, 300 km/h": (1.153, 0.02),
    "raw σ with over without control, 350 km/h": (0.815, 0.02),
    "raw σ with over without control, 400 km/h": (0.763, 0.02),
    "CF with over without control, 300 km/h": (1.095, 0.02),
    "CF with over without control, 350 km/h": (0.762, 0.02),
    "CF with over without control, 400 km/h": (0.720, 0.02),
    "CF with over without control, largest of 100-400 km/h": (1.095, 0.02),
    "θ of the least CF, 100 km/h": (45, 15),
    "θ of the least CF, 150 km/h": (15, 15),
    "θ of the least CF, 200 km/h": (0, 14),
    "θ of the least CF, 250 km/h": (-105, 15),
    "θ of the least CF, 300 km/h": (-105, 15),
    "θ of the least CF, 350 km/h": (-45, 15),
    "θ of the least CF, 400 km/h": (45, 30),  # the minimum is flat there
}
DIFFER = {
    "CL with FB+FF, gain 1, 300 km/h",
    "CL with FB+FF, gain 1, 350 km/h",
    "largest CL with FB+FF, gain 1.75, 300-400 km/h, realistic actuator",
    "largest CL with FB+FF, best gain 0.25, 300-400 km/h, realistic actuator",
    "raw σ with over without control, 300 km/h",
    "CF with over without control, 300 km/h",
    "CF with over without control, largest of 100-400 km/h",
    "θ of the least CF, 200 km/h",
    "θ of the least CF, 250 km/h",
    "θ of the least CF, 300 km/h",
    "θ of the least CF, 350 km/h",
}


@pytest.fixture(scope="module")
def told() -> list[float]:
    return []


@pytest.fixture(scope="module")
def outcome(told: list[float]) -> Outcome:
    return find_study("paper1-control")(lambda what, share: told.append(share))


@pytest.mark.slow
def test_every_comparison_is_what_the_documents_say(outcome: Outcome) -> None:
    ours = {item.quantity: item.ours for item in outcome.comparisons}
    assert set(ours) == set(EXPECTED)
    for quantity, (value, tolerance) in EXPECTED.items():
        assert ours[quantity] == pytest.approx(value, abs=tolerance), quantity
    assert {item.quantity for item in outcome.comparisons if not item.agrees} == DIFFER
    assert all(item.note for item in outcome.comparisons if not item.agrees)


@pytest.mark.slow
def test_gains_are_chosen_by_the_rules_that_their_comments_give(outcome: Outcome) -> None:
    """Least gain without loss; least of the largest losses with the realistic actuator."""
    rows = [[float(cell) for cell in row] for row in table(outcome, "over the gain").rows]
    free = [row[0] for row in rows if max(row[1:4]) == 0]
    assert min(free) == GAIN
    assert not [row for row in rows if max(row[4:7]) == 0]  # sampled every 10 ms, none is free of loss
    assert min(rows, key=lambda row: max(row[7:10]))[0] == REAL_GAIN
    assert [row[0] for row in rows] == list(GAINS)


@pytest.mark.slow
def test_half_of_the_loss_at_400_kmh_is_saved_by_pressing_harder_alone(outcome: Outcome) -> None:
    found = table(outcome, "Control and its parts")
    rows = {row[0]: row for row in found.rows if row[1] == "400"}
    loss, mean = found.headings.index("CL (%)"), found.headings.index("F_m (N)")
    passive, active = rows["passive, pressed to that mean"], rows[f"FB+FF, gain {GAIN}"]
    assert passive[mean] == active[mean]
    assert float(passive[loss]) == pytest.approx(3.11, abs=0.3)


@pytest.mark.slow
def test_frame_damping_with_feedback_loses_nothing_through_any_actuator(outcome: Outcome) -> None:
    found = table(outcome, "Actuators")
    loss = found.headings.index("CL (%)")
    rows = [row for row in found.rows if "FB + frame damping" in str(row[0]) or "pd" in str(row[0])]
    assert len(rows) == 2 * len(ACTUATORS) * len(SHOWN_SPEEDS)
    assert {row[loss] for row in rows} == {"0.00"}


@pytest.mark.slow
def test_the_other_line_is_lost_at_400_kmh(outcome: Outcome) -> None:
    found = table(outcome, "The same on")
    loss = found.headings.index("CL (%)")
    cells = {(row[0], row[1]): float(row[loss]) for row in found.rows}
    active = f"FB+FF, gain {GAIN}"
    assert (cells["passive", "350"], cells[active, "350"]) == (pytest.approx(2.2, abs=0.5), 0.0)
    assert cells["passive", "400"] == pytest.approx(26.7, abs=1.5)
    assert cells[active, "400"] == pytest.approx(12.2, abs=1.5)


@pytest.mark.slow
def test_a_finer_grid_and_time_step_say_the_same(outcome: Outcome) -> None:
    found = table(outcome, "Time step and grid")
    loss, cost = found.headings.index("CL (%)"), found.headings.index("CF (N m)")
    for usual, fine in zip(found.rows[::2], found.rows[1::2], strict=True):
        assert float(fine[loss]) == pytest.approx(float(usual[loss]), abs=0.5), usual[:2]
        assert float(fine[cost]) == pytest.approx(float(usual[cost]), rel=0.02), usual[:2]
        if "FB+FF" in str(usual[0]):
            assert fine[loss] == "0.00"


@pytest.mark.slow
def test_the_outcome_is_written_with_a_picture_a_figure(
    outcome: Outcome, told: list[float], tmp_path: Path
) -> None:
    names = {path.name for path in write(outcome, tmp_path)}
    assert {name[:5] for name in names if name.endswith(".png")} == {f"fig{n}" for n in range(13, 19)}
    assert told == sorted(told)
    assert 0 < told[0] < told[-1] <= 1


def table(outcome: Outcome, words: str) -> Table:
    (found,) = (each for each in outcome.tables if words in each.title)
    return found
