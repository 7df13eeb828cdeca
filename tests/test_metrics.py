import numpy as np
import pytest

from panto_env import InputError
from panto_env.metrics import figures as metrics


def test_low_pass_keeps_slow_and_stops_fast_waves():
    time = np.arange(0, 10, 1e-3)
    slow, fast = np.sin(2 * np.pi * 2 * time), np.sin(2 * np.pi * 60 * time)
    edge = np.sin(2 * np.pi * 20 * time)
    steady = slice(2000, None)
    assert metrics.low_pass(slow, 1e-3)[steady].std() == pytest.approx(slow.std(), rel=1e-3)
    assert metrics.low_pass(fast, 1e-3)[steady].std() < 2e-3
    # -3 dB at the cut-off
    assert metrics.low_pass(edge, 1e-3)[steady].std() == pytest.approx(edge.std() / 2**0.5, rel=1e-2)


def test_low_pass_starts_settled():
    assert metrics.low_pass(np.full(100, 120.0), 1e-3) == pytest.approx(120.0)


def test_low_pass_refuses_samples_too_far_apart():
    with pytest.raises(InputError, match="cannot be low-passed at 20 Hz"):
        metrics.low_pass(np.ones(10), 0.025)


def test_cost_function_is_eq_14_written_out():
    force, nominal, speed_kmh, step = np.array([50.0, 60.0, 40.0, 54.0]), 54.0, 300.0, 0.002
    expected = sum(
        speed_kmh / 3.6 * step / 2 * (abs(force[i] - nominal) + abs(force[i + 1] - nominal)) for i in range(3)
    )
    assert metrics.cost_function(force, nominal, speed_kmh / 3.6 * step) == pytest.approx(expected)


def test_contact_loss_is_a_share_of_distance():
    assert metrics.contact_loss(np.array([0.0, 1.0, 0.0, 5.0])) == 50.0


def test_en50367_limits_at_both_sides_of_their_speeds():
    figures = metrics.Figures(100, 31, 0, 0, 320, 0, 0, 0.15, 0, 0, 0, 100)
    slow = metrics.en50367_checks(figures, 190 / 3.6)
    fast = metrics.en50367_checks(figures, 280 / 3.6)
    assert (slow["max"], slow["contact_loss"]) == (False, False)
    assert (fast["max"], fast["contact_loss"]) == (True, True)
    assert not fast["std"]
