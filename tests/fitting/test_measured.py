"""What of a record is compared: coefficients as white as noise, from a stretch that a fit can take."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.fitting.passes import BANDS, HIGHEST, PER_SECOND, Measured, between, measured
from panto_env.records.record import Piece

SPEED, SPAN = 60.0, 60.0


def piece(force=None, samples=6000, noise=1.0, seed=0):
    """A piece at 500 samples a second and 60 m/s, 100 m from the line's begin on."""
    if force is None:
        force = 120 + noise * np.random.default_rng(seed).standard_normal(samples)
    return Piece("a", 0.002, 0.0, 100 + SPEED * 0.002 * np.arange(len(force)), force)


def taken(own, stretch=(160.0, 760.0), offset=0.0):
    return measured(own, offset, stretch, SPAN)


def test_places_lie_in_the_stretch_a_fiftieth_of_a_second_apart():
    own = taken(piece())
    assert own.place[0] == 160.0
    np.testing.assert_allclose(np.diff(own.place), SPEED / PER_SECOND)
    assert own.place[-1] == pytest.approx(760 - SPEED / PER_SECOND)
    assert taken(piece(), (0.0, 9000.0)).place[0] == 100.0  # where the record begins
    assert taken(piece(), offset=50.0).place[0] == 160.0


def test_coefficients_go_from_two_spans_to_18_hz():
    own = taken(piece())
    frequency = own.compared * PER_SECOND / (2 * len(own.place))
    step = frequency[1] - frequency[0]
    assert SPEED / (2 * SPAN) <= frequency[0] < SPEED / (2 * SPAN) + step
    assert HIGHEST - step < frequency[-1] <= HIGHEST
    counts = np.bincount(own.band, minlength=BANDS)
    assert np.ptp(counts) <= 1
    assert (np.diff(own.band) >= 0).all()


def test_coefficients_of_white_noise_are_white_with_equal_variance():
    """Not those of a record, which its 20 Hz low-pass bends above 15 Hz, but of noise at the places."""
    own = taken(piece())
    noise = np.random.default_rng(1).standard_normal((4000, len(own.place)))
    found = own.coefficients(noise)
    np.testing.assert_allclose(np.cov(found, rowvar=False), np.eye(len(own.compared)), atol=0.12)


def test_back_inverts():
    own = taken(piece())
    random = np.random.default_rng(2)
    coefficients = random.standard_normal(len(own.compared))
    force = own.back(coefficients)
    np.testing.assert_allclose(own.coefficients(force), coefficients, atol=1e-12)
    assert own.std(coefficients) == pytest.approx(force.std(), rel=1e-12)  # its mean is 0
    assert abs(force.mean()) < 1e-12
    whole = 100 + 0.1 * np.arange(len(own.place))  # a mean and a drift: no droppers
    assert own.std(own.coefficients(whole)) < 0.05 * whole.std()


def test_force_is_read_at_the_place_with_offset_and_shift():
    """A wave of 40 m, a third of the samples' distance from any of them."""

    def wave(x):
        return 120 + 20 * np.sin(2 * np.pi * x / 40)

    along = 100 + SPEED * 0.002 * np.arange(6000)
    own = taken(piece(wave(along)))
    np.testing.assert_allclose(own.force(), wave(own.place), atol=0.02)
    # Positions 3 m too small: what was felt at x was recorded as x - 3.
    short = taken(piece(wave(along + 3.0)))
    np.testing.assert_allclose(short.force(3.0), wave(short.place), atol=0.02)
    ahead = taken(piece(wave(along)), offset=25.0)
    np.testing.assert_allclose(ahead.force(), wave(ahead.place + 25.0), atol=0.02)
    assert own.force().mean() == pytest.approx(wave(own.place).mean(), abs=0.01)


def test_a_stretch_that_is_too_short_is_refused():
    with pytest.raises(InputError, match=r"It has only 179 m .* at least three spans \(180 m\)"):
        taken(piece(), (160.0, 339.0))
    assert isinstance(taken(piece(), (160.0, 341.0)), Measured)
    with pytest.raises(InputError, match="has only 0 m"):
        taken(piece(), (2000.0, 2600.0))


@pytest.mark.parametrize(("change", "refused"), [(0.02, False), (0.05, True)])
def test_a_speed_that_changes_is_refused(change, refused):
    own = piece()
    share = np.linspace(-0.5, 0.5, len(own.force))
    uneven = replace(own, position=own.position + change * SPEED * own.time[-1] * share**2)
    assert np.ptp(np.gradient(uneven.position, 0.002)) / SPEED == pytest.approx(2 * change, rel=0.01)
    if refused:
        with pytest.raises(InputError, match=r"speed differs by up to [45]\.\d % .* at most 3 %"):
            taken(uneven, (100.0, 800.0))
        taken(uneven, (300.0, 600.0))  # its middle has one speed
    else:
        taken(uneven, (100.0, 800.0))


def test_between_samples_a_wave_keeps_its_amplitude():
    """Of 18 Hz at 500 samples a second, at the ends as well; cubic courses exactly."""
    number = np.linspace(0, 39, 400)
    turn = 2 * np.pi * 18 / 500
    samples = np.stack([np.sin(turn * np.arange(40.0)), np.arange(40.0) ** 3])
    found = between(samples, number)
    np.testing.assert_allclose(found[0], np.sin(turn * number), atol=1e-4)
    np.testing.assert_allclose(found[1], number**3, rtol=1e-12, atol=1e-9)
