"""Normal equations and the noise of bands, on linear problems whose answer is known."""

import numpy as np
import pytest

from panto_env.fitting.passes import BANDS
from panto_env.fitting.solve import QUIET, noise_of, normal

NOISE = np.array([3.0, 1.0, 0.5, 2.0, 0.8, 5.0])
"""Of each band (N)."""
PRIOR = np.array([1.0, 0.5, 2.0, 0.1, 1.0, 0.3, 1.0, 1.0, 0.02, 1.5])
"""Standard deviations of the values."""
UNKNOWN = np.full((1, BANDS), np.nan)


def problem(random, count=1200, truth=None, noise=NOISE, values=10):
    """Jacobian, residual at 0, bands and values of a linear problem with one part."""
    band = np.arange(count) * BANDS // count
    jacobian = random.standard_normal((count, values))
    truth = PRIOR * random.standard_normal(values) if truth is None else truth
    return jacobian, jacobian @ truth + noise[band] * random.standard_normal(count), band, truth


def solved(jacobian, residual, band, noise, x=None):
    """Step and covariance."""
    x = np.zeros(jacobian.shape[1]) if x is None else x
    precision, slope = normal(jacobian, residual, 1 / noise[band] ** 2, PRIOR, x)
    covariance = np.linalg.inv(precision)
    return covariance @ slope, covariance


@pytest.mark.parametrize("begin", [UNKNOWN, np.full((1, BANDS), 20.0), NOISE[None]])
def test_the_noise_of_each_band_is_found_from_wherever_it_begins(begin):
    jacobian, residual, band, _ = problem(np.random.default_rng(1))
    found = noise_of(begin, jacobian, residual, band, PRIOR, np.zeros(len(PRIOR)))
    np.testing.assert_allclose(found, NOISE[None], rtol=0.15)  # 200 coefficients: 5 % rms each


def test_values_do_not_hide_noise():
    """With as many values as a quarter of the coefficients, the residual is 13 % smaller than the noise."""
    random, ratios, raw = np.random.default_rng(2), [], []
    noise, prior = np.ones(BANDS), np.full(75, 10.0)
    for _ in range(8):
        jacobian, residual, band, _ = problem(random, 300, np.zeros(75), noise, 75)
        ratios.append(noise_of(UNKNOWN, jacobian, residual, band, prior, np.zeros(75)).mean())
        raw.append((residual - jacobian @ np.linalg.lstsq(jacobian, residual)[0]).std())
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)
    assert np.mean(raw) == pytest.approx(0.87, abs=0.02)


def test_noise_does_not_fall_below_what_grid_and_time_step_leave():
    jacobian, residual, band, _ = problem(np.random.default_rng(4), noise=np.full(BANDS, 1e-3))
    assert (noise_of(UNKNOWN, jacobian, residual, band, PRIOR, np.zeros(len(PRIOR))) == QUIET).all()


def test_the_covariance_is_that_of_many_draws():
    """Truths drawn from the prior, and noise: errors have the covariance, and lie in 95 % intervals so often.

    Few, noisy coefficients, so that the prior matters: without it errors would be up to twenty times as big.
    """
    random = np.random.default_rng(5)
    errors = []
    jacobian, _, band, _ = problem(random, 24)
    for _ in range(4000):
        truth = PRIOR * random.standard_normal(len(PRIOR))
        residual = jacobian @ truth + NOISE[band] * random.standard_normal(24)
        step, covariance = solved(jacobian, residual, band, NOISE)
        errors.append(step - truth)
    scale = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        np.cov(errors, rowvar=False) / np.outer(scale, scale),
        covariance / np.outer(scale, scale),
        atol=0.08,  # five standard deviations of a variance's
    )
    assert np.mean(np.abs(errors) < 1.96 * scale) == pytest.approx(0.95, abs=0.01)
    assert scale[8] == pytest.approx(PRIOR[8], rel=0.01)  # hardly identifiable
    assert np.abs(np.mean(errors, axis=0) / scale).max() < 0.08


def test_where_a_step_begins_does_not_matter():
    """The prior pulls towards the design from anywhere: on a linear problem all steps end at one place."""
    jacobian, residual, band, _ = problem(np.random.default_rng(6), 60)
    from_design, covariance = solved(jacobian, residual, band, NOISE)
    x = PRIOR * np.linspace(-2, 2, len(PRIOR))
    step, same = solved(jacobian, residual - jacobian @ x, band, NOISE, x)
    np.testing.assert_allclose(x + step, from_design, atol=1e-12)
    np.testing.assert_allclose(same, covariance)
