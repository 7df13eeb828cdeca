"""Records by frequency, against sines that are known."""

import numpy as np
import pytest

from panto_env.metrics.low_pass import amplitudes, band_rms, in_band

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
