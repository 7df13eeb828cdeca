"""Paper 1's control study: its helpers, and every figure that it prints beside the paper's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from panto_env import simulate
from panto_env.studies.paper1_control.angles import wrap
from panto_env.studies.paper1_control.cases import (
    ACTUATORS,
    LINE,
    MS,
    PANTOGRAPH,
    SAMPLED,
    THETAS,
    Case,
    all_cases,
    control,
    sampled,
)
from panto_env.studies.paper1_control.linear import amplification
from panto_env.studies.paper1_control.passes import band_rms, longest, pressed, records, run
from panto_env.task.policy import find_policy
from panto_env.task.task import Task

# --- helpers -------------------------------------------------------------------------------------


def test_the_policy_is_named_with_the_parameters_that_are_meant() -> None:
    policy = find_policy(control(1.25, amplitude=7.0, theta=THETAS[3], reading=MS))
    assert (policy.gains, policy.amplitude, policy.theta) == ({0.0: 1.25}, 7.0, THETAS[3])  # type: ignore[attr-defined]
    assert (policy.reading, policy.speed_unit) == ("printed", "m/s")  # type: ignore[attr-defined]


def test_the_sweep_goes_once_round_and_meets_the_papers_angle() -> None:
    assert sorted(wrap(theta) for theta in THETAS) == pytest.approx(np.linspace(-11, 12, 24) * math.pi / 12)
    assert min(abs(theta - math.pi / 6) for theta in THETAS) < 1e-12
    assert wrap(1.5 * math.pi) == pytest.approx(-0.5 * math.pi)


def test_no_pass_is_made_twice_and_every_actuator_is_known() -> None:
    cases = all_cases()
    assert len(set(cases)) == len(cases)
    for actuator in {case.actuator for case in cases}:
        Task(actuator=ACTUATORS[actuator])


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
            distance=record.position[-1],
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


def test_feedback_is_a_spring_and_frame_velocity_a_damper() -> None:
    """At rest the force's deviation falls by 1 + gain."""
    assert amplification(1e-4, 1.75) == pytest.approx(1 / 2.75, rel=1e-3)
    assert amplification(11.0, 1.75) > 2.5
    assert amplification(1e-4, 0.0, 150.0) == pytest.approx(1.0, rel=1e-3)
    assert amplification(4.0, 0.0, 150.0) < 0.85
    assert amplification(11.0, 1.0, 150.0) < amplification(11.0, 1.0)


def test_the_pressed_pantograph_has_the_mean_asked_for_and_the_same_nominal_force() -> None:
    result = pressed(400, 48.0)
    assert result.figures.mean == pytest.approx(48.0, abs=0.1)
    assert result.mean_deviation > 54 - 48.0  # CF counts from 54 N, not from the larger static force


# --- the study -----------------------------------------------------------------------------------
