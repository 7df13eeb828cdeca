"""Numbers that belong together: a confidence and its quantile, a unit for each parameter."""

import numpy as np
import pytest
from scipy.stats import norm

from panto_env.identification.model import CONFIDENCE, IDENTIFIED, UNITS, Fit, Z


def fit(values, std):
    return Fit("a method", {}, tuple(IDENTIFIED[: len(values)]), np.array(values), np.array(std), 1.0, 1.0)


def test_an_interval_holds_95_percent_of_a_normal_distribution():
    assert CONFIDENCE == 0.95
    assert pytest.approx(norm.ppf(0.5 + CONFIDENCE / 2), rel=1e-15) == Z
    made = fit([10.0, -4.0], [1.0, 2.0])
    low, high = norm.interval(CONFIDENCE, made.values, made.std)
    np.testing.assert_allclose(made.interval, np.column_stack([low, high]))
    assert made.rsd == pytest.approx([10.0, 50.0])


def test_what_may_as_well_be_0_is_undetermined():
    made = fit([10.0, 10.0, -10.0, 0.0], [5.1, 5.103, 6.0, 1.0])  # 10 / Z is 5.102
    assert made.undetermined == made.names[1:]
    assert set(made.parameters) == set(UNITS)
    assert np.isnan(made.parameters[next(name for name in UNITS if name not in made.names)])
