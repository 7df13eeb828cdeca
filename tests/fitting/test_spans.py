"""Intervals know where the model lacks something, and only there: on linear problems whose truth is known."""

import numpy as np
import pytest

from panto_env.fitting import fit as fitting
from panto_env.fitting.fit import INTERVAL, Fit
from panto_env.fitting.misfit import State
from panto_env.fitting.solve import Solution, normal
from panto_env.fitting.stored import doubts, knowledge, store, stored

DRAWS = 40
LONG = (83.0, 57.0, 31.0)
"""Wavelengths (m) of values that act along the whole line, as tensions do."""
HUMPS = 20
"""Values that act in places of their own, as droppers do."""
ODD, LACKING = 12, 3.0
"""Span in which the model lacks waves of 28 m, and their amplitude (N)."""


@pytest.fixture(scope="module")
def jacobian(ready):
    """Of made-up values, 3 N or 2 N for a tolerance; the other ones do nothing."""
    (part,), random = ready.parts, np.random.default_rng(1)
    place = part.measured.place
    waves = [3.0 * np.cos(2 * np.pi * (place / length + random.random())) for length in LONG]
    middles = np.linspace(place[0], place[-1], HUMPS)
    humps = 2.0 * np.exp(-(((place - middles[:, None]) / 5.0) ** 2))
    silent = np.zeros((len(ready.prior) - len(LONG) - HUMPS, len(place)))
    return (part.measured.coefficients(np.vstack([waves, humps, silent])) / ready.prior[:, None]).T


def fits(ready, jacobian, lacking=0.0):
    """Fits of drawn values to noise of 1 N and what the model lacks (N), with the true values."""
    (part,), design, start = ready.parts, ready.values.design, ready.start()
    place, count, random = part.measured.place, len(ready.band), np.random.default_rng(2)
    odd = design.catenary.alignment(design.spans).span_of(place) == ODD
    for _ in range(DRAWS):
        truth = ready.prior * random.standard_normal(len(ready.prior))
        more = odd * lacking * np.cos(2 * np.pi * (place / 28.0 + random.random()))
        force = jacobian @ truth + random.standard_normal(count) + part.measured.coefficients(more)
        precision, slope = normal(jacobian, force, np.ones(count), ready.prior, np.zeros_like(truth))
        covariance = np.linalg.inv(precision)
        x = covariance @ slope
        state = State(x, start.static_forces, np.ones_like(start.noise))
        yield Fit(ready, Solution(state, covariance, jacobian, force - jacobian @ x, True)), truth


def inside(every, covariance_of):
    """Share of the values along the whole line that lie inside their intervals."""
    errors = np.array([(fit.solution.state.x - truth)[: len(LONG)] for fit, truth in every])
    deviations = [np.sqrt(np.diag(covariance_of(fit)))[: len(LONG)] for fit, _ in every]
    return np.mean(np.abs(errors) < INTERVAL * np.array(deviations))


def widened(every):
    """By which factor deviations of those values are larger than by noise, in the mean."""
    ratios = [np.diag(fit.covariance) / np.diag(fit.solution.covariance) for fit, _ in every]
    return np.sqrt(np.array(ratios)[:, : len(LONG)]).mean()


@pytest.mark.longer
def test_a_right_model_keeps_its_intervals(ready, jacobian):
    every = list(fits(ready, jacobian))
    assert inside(every, lambda fit: fit.covariance) == pytest.approx(0.95, abs=0.03)
    same = [fit.covariance is fit.solution.covariance for fit, _ in every]
    assert same == [not fit.moved for fit, _ in every]
    assert np.mean(same) > 0.9  # five spans, of which each stands out once in some 300 times
    assert 1 <= widened(every) < 1.01


@pytest.mark.longer
def test_what_the_model_lacks_in_one_span_widens_intervals_so_that_they_hold_the_truth(ready, jacobian):
    every = list(fits(ready, jacobian, LACKING))
    assert inside(every, lambda fit: fit.solution.covariance) < 0.7
    assert inside(every, lambda fit: fit.covariance) > 0.85
    assert 1.2 < widened(every) < 2.5
    assert np.mean([ODD in fit.moved for fit, _ in every]) > 0.9


@pytest.mark.longer
def test_spans_move_values_by_as_much_as_noise_does(ready, jacobian, monkeypatch):
    """All spans together, in the mean over draws, although values follow the noise in each."""
    monkeypatch.setattr(fitting, "TOO_MUCH", -np.inf)
    every = [fit for fit, _ in fits(ready, jacobian)]
    assert len(every[0].moved) >= 5
    found = np.mean([sum(move**2 for move in fit.moved.values()) for fit in every], axis=0)
    covariance = every[0].solution.covariance
    by_noise = np.diag(covariance - covariance @ np.diag(ready.prior**-2) @ covariance)
    assert (found / np.where(by_noise > 0, by_noise, 1.0))[: len(LONG)] == pytest.approx(1.0, abs=0.25)


def test_the_span_is_named_and_the_file_of_the_fit_is_as_wide(ready, jacobian, tmp_path):
    fit = next(fit for fit, _ in fits(ready, jacobian, LACKING) if list(fit.moved) == [ODD])
    first, count = ready.values.design.first_span, len(ready.values)
    assert any(f"More is left than noise in span {ODD + first}:" in doubt for doubt in doubts(fit))
    store(knowledge(fit, "made up"), tmp_path / "a.safetensors")
    kept = stored(tmp_path / "a.safetensors").covariance
    np.testing.assert_array_equal(kept, fit.covariance[:count, :count])
    assert np.trace(kept) > np.trace(fit.solution.covariance[:count, :count])
    told = np.array([found.deviation for found in fit.found])
    every = np.sqrt(np.diag(fit.covariance))[:count]
    assert set(told) <= set(every)
