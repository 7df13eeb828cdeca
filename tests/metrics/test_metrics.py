from dataclasses import fields

import numpy as np
import pytest
from scipy import signal

from panto_env import InputError
from panto_env.metrics.figures import LABELS, Figures, contact_loss, cost_function
from panto_env.metrics.low_pass import amplitudes, band_rms, in_band, low_pass, low_pass_sections
from panto_env.plant.alignment import Alignment


@pytest.mark.parametrize("step", [1e-4, 1.25e-3, 5e-3, 0.02])
def test_the_filter_is_scipy_s_butterworth_filter(step):
    sections, settled = low_pass_sections(step)
    theirs = signal.butter(6, 20.0, fs=1 / step, output="sos")
    frequency = np.linspace(0, 0.5 / step, 200)
    for each in (sections, theirs):
        assert each.shape == (3, 6)
    ours, wanted = (signal.freqz_sos(each, worN=frequency, fs=1 / step)[1] for each in (sections, theirs))
    np.testing.assert_allclose(ours, wanted, atol=1e-9)
    np.testing.assert_allclose(settled, signal.sosfilt_zi(sections), rtol=1e-9, atol=1e-12)


def test_low_pass_keeps_slow_and_stops_fast_waves():
    time = np.arange(0, 10, 1e-3)
    slow, fast = np.sin(2 * np.pi * 2 * time), np.sin(2 * np.pi * 60 * time)
    edge = np.sin(2 * np.pi * 20 * time)
    steady = slice(2000, None)
    assert low_pass(slow, 1e-3)[steady].std() == pytest.approx(slow.std(), rel=1e-3)
    assert low_pass(fast, 1e-3)[steady].std() < 2e-3
    # -3 dB at the cut-off
    assert low_pass(edge, 1e-3)[steady].std() == pytest.approx(edge.std() / 2**0.5, rel=1e-2)


def test_series_are_low_passed_one_by_one_from_a_settled_start():
    assert low_pass(np.full(100, 120.0), 1e-3) == pytest.approx(120.0)
    forces = np.random.default_rng(0).normal(100, 20, (3, 2, 200))
    together = low_pass(forces, 1e-3)
    for own, expected in zip(together.reshape(6, 200), forces.reshape(6, 200), strict=True):
        np.testing.assert_allclose(own, low_pass(expected, 1e-3), rtol=1e-12)


def test_low_pass_refuses_samples_too_far_apart():
    with pytest.raises(InputError, match="cannot be low-passed at 20 Hz"):
        low_pass(np.ones(10), 0.025)


def test_cost_function_is_eq_14_written_out():
    force, nominal, speed_kmh, step = np.array([50.0, 60.0, 40.0, 54.0]), 54.0, 300.0, 0.002
    expected = sum(
        speed_kmh / 3.6 * step / 2 * (abs(force[i] - nominal) + abs(force[i + 1] - nominal)) for i in range(3)
    )
    assert cost_function(force, nominal, speed_kmh / 3.6 * step) == pytest.approx(expected)
    assert contact_loss(np.array([0.0, 1.0, 0.0, 5.0])) == 50.0


def test_every_figure_has_its_label_in_its_unit():
    per_si = {"N": 1.0, "N/s": 1.0, "N m": 1.0, "%": 1.0, "m": 1.0, "mm": 1e3}
    assert list(LABELS) == [field.name for field in fields(Figures)]
    assert {name: label.scale for name, label in LABELS.items()} == {
        name: per_si[label.unit] for name, label in LABELS.items()
    }
    assert LABELS["max_uplift"].heading == "maximum uplift at the supports (mm)"
    assert LABELS["contact_loss"].column == "CL\n(%)"


def test_spans_begin_at_a_support_and_end_before_the_next():
    position = np.array([0.0, 49.9, 50.0, 99.9, 100.0, 149.9, 150.0])
    line = Alignment.equal(50.0, 20)
    assert line.limits((2, 3)) == (50.0, 150.0)
    assert line.within(position, (2, 3)).tolist() == [False, False, True, True, True, True, False]
    assert line.within(position, (1, 1)).sum() == 2


STEP = 1e-3


TIME = STEP * np.arange(4000)
SLOW, FAST = 3 * np.sin(2 * np.pi * 4 * TIME), 2 * np.sin(2 * np.pi * 15 * TIME)


def test_a_band_holds_what_swings_in_it():
    assert in_band(7 + SLOW + FAST, STEP, 0, 10) == pytest.approx(SLOW, abs=1e-9)
    assert in_band(7 + SLOW + FAST, STEP, 4, 15) == pytest.approx(FAST, abs=1e-9)
    assert band_rms(7 + SLOW + FAST, STEP, 0, 15) == pytest.approx(np.std(SLOW + FAST))


def test_a_peak_is_as_high_as_its_harmonic_wherever_the_record_ends():
    for length in (4000, 3911):
        frequency, amplitude = amplitudes((SLOW + FAST)[:length], STEP)
        for wanted, height in ((4, 3), (15, 2)):
            near = np.abs(frequency - wanted) < 0.5
            assert amplitude[near].max() == pytest.approx(height, rel=0.08)
    assert amplitudes(SLOW, STEP)[1].max() == pytest.approx(3, rel=1e-3)
