"""Droppers that jump where steps lead no further, and derivatives from coarse passes."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env.fitting.misfit import OWN
from panto_env.fitting.passes import BANDS
from panto_env.fitting.solve import SURE, Solution, normal

NOISE = 0.7
"""Noise of a coefficient (N), as a record of these tests has it."""


def ended(fitting, x):
    """A fit that has ended at some values."""
    state = replace(fitting.start(), x=x, noise=np.full((1, BANDS), NOISE))
    (residual,) = fitting.residuals(state, x[None])
    return Solution(state, np.diag(fitting.prior**2), np.zeros((len(residual), len(x))), residual, True)


@pytest.fixture(scope="module")
def true(ready, truth):
    """The true values."""
    return np.array([*(truth.of(value) for value in ready.values.all), *(0.0 for _ in OWN)])


@pytest.mark.slow
@pytest.mark.parametrize("by", [0.009, -0.011])
def test_droppers_that_are_far_off_jump_back(ready, true, by):
    """Both of two, by the distance of a jump each, and no other."""
    values = ready.values
    off = [values.of_kind("droppers")[k] for k in (90, 110)]
    assert all(ready.stretch[0] < values.all[k].place < ready.stretch[1] for k in off)
    wrong = true.copy()
    wrong[off] += by
    jumped = ready._jumped(ended(ready, wrong), lambda doing: None)
    moved = jumped.x - wrong
    np.testing.assert_allclose(moved[off], -np.sign(by) * 0.01)
    assert np.flatnonzero(moved).tolist() == off


@pytest.mark.slow
def test_no_dropper_jumps_where_that_makes_nothing_better(ready, true):
    assert ready._jumped(ended(ready, true), lambda doing: None) is None


@pytest.mark.slow
def test_a_dropper_jumps_for_which_others_make_up(ready, true):
    """Its whole return, alone, would make it worse."""
    fitting = ready
    k = fitting.values.of_kind("droppers")[100]
    state = ended(fitting, true + 0.01 * (np.arange(len(true)) == k)).state
    for _ in range(3):  # steps of all values but this one
        differences = np.diag(0.1 * fitting.values.tolerances)
        state, jacobian, residual = fitting.derivatives(state, differences, "fine", lambda doing: None)
        precision, slope = normal(jacobian, residual, fitting.weights(state.noise), fitting.prior, state.x)
        found = Solution(state, np.linalg.inv(precision), jacobian, residual, converged=True)
        others = np.delete(np.arange(len(state.x)), k)
        x = state.x.copy()
        x[others] += np.linalg.solve(precision[np.ix_(others, others)], slope[others])
        state = replace(state, x=x, static_forces=fitting.static_forces(state, x))
    wrong = found.state.x
    jumped = fitting._jumped(found, lambda doing: None).x - wrong
    assert jumped[k] < -0.004
    alone = np.where(np.arange(len(wrong)) == k, wrong - 0.01, wrong)
    tried = np.array([wrong, alone])
    before, after = fitting.objective(fitting.residuals(found.state, tried), found.state.noise, tried)
    assert after > before


def test_differences_never_become_so_small_that_rounding_is_all_that_is_left(ready):
    """Where two values together are known far too well, which rounding may make a negative variance, too."""
    fitting = ready
    count, scale = len(fitting.values), fitting.values.tolerances
    usual = np.diag(np.append(0.01 * scale**2, fitting.prior[count:] ** 2))
    found = fitting._uncertain(usual) / scale
    np.testing.assert_allclose(found.T @ found, 0.01 * np.eye(count), atol=1e-15)
    for together in (1.0 - 1e-9, 1.0 + 1e-9):
        sure = usual.copy()
        sure[0, 1] = sure[1, 0] = 0.01 * together * scale[0] * scale[1]
        found = fitting._uncertain(sure) / scale
        gram = found.T @ found
        np.testing.assert_allclose(gram[2:], 0.01 * np.eye(count)[2:], atol=1e-12)
        assert np.linalg.eigvalsh(gram).min() == pytest.approx(SURE**2, rel=1e-3)
