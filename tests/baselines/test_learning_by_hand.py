"""The learner of the span's harmonics against its equation, and H-infinity's against the Riccati equation."""

import numpy as np
import pytest

from panto_baselines.policies.model_based import _stabilising
from panto_baselines.policies.repetitive import LISTENING, Pace, SpanLearner, harmonics

PER_SPAN, LIMIT = 200, 100.0
NUMBERS = np.arange(1.0, 4.0)
ANSWERS = np.array([0.8 * np.exp(0.3j), 0.5 * np.exp(-1.1j), 0.2 * np.exp(2.0j)])


def learner(pace, lanes=1):
    return SpanLearner(pace, NUMBERS, ANSWERS, 1 / PER_SPAN, LIMIT, lanes)


def feed(one, spans, error):
    """Forces, (steps, lanes), under an error of coefficients E_k in each lane; control has no part in it."""
    angles = 2 * np.pi * np.arange(round(spans * PER_SPAN)) / PER_SPAN
    felt = np.real(np.exp(1j * np.multiply.outer(angles, NUMBERS)) @ np.asarray(error).T)
    return np.array(
        [one(row, 0.0 * row, np.full(len(row), at)) for row, at in zip(felt, angles, strict=True)]
    )


def test_nothing_is_done_while_it_listens():
    assert not feed(learner(Pace(0.65, 0.01, 0.5)), LISTENING - 0.02, [[30.0, 10j, 5.0]]).any()


def test_in_a_span_it_learns_what_its_equation_says():
    """c_k changes by - learning conj(G) E / (|G|^2 + response^2) in a span, and forgets a share of itself."""
    error, (learning, forgetting, response) = np.array([3.0, 1.0 - 2j, 0.5j]), (0.65, 0.02, 0.5)
    one = learner(Pace(learning, forgetting, response))
    feed(one, LISTENING + 1, [error])
    step = -learning * error * np.conj(ANSWERS) / (np.abs(ANSWERS) ** 2 + response**2)
    np.testing.assert_allclose(one._learnt[0], step * (1 - forgetting / 2), rtol=0.02, atol=0.02)
    force = one(np.zeros(1), np.zeros(1), np.array([0.7]))
    assert force[0] == pytest.approx(np.real(one._learnt[0] @ np.exp(0.7j * NUMBERS)))


def test_what_is_learnt_never_has_a_peak_beyond_one_and_a_half_times_the_limit():
    """In the lane of a great error; the other one is left as it is."""
    one = learner(Pace(0.65, 0.0, 0.5), lanes=2)
    small = np.array([1.0, 0.5j, 0.2])
    feed(one, LISTENING + 3, [900 * small, small])
    angles = np.linspace(0, 2 * np.pi, 20_000)
    peaks = np.abs(np.real(one._learnt @ np.exp(1j * np.multiply.outer(NUMBERS, angles)))).max(axis=1)
    assert peaks[0] == pytest.approx(1.5 * LIMIT, rel=0.01)
    alone = learner(Pace(0.65, 0.0, 0.5))
    feed(alone, LISTENING + 3, [small])
    np.testing.assert_allclose(one._learnt[1], alone._learnt[0])
    assert peaks[1] < LIMIT


@pytest.mark.parametrize(("rate", "count"), [(1.5, 10), (4.0, 4), (16.0, 1), (40.0, 1)])
def test_harmonics_up_to_16_hz_are_learnt_and_the_first_in_any_case(rate, count):
    assert harmonics(rate).tolist() == list(range(1, count + 1))


@pytest.mark.parametrize("bound", [3.0, 30.0])
def test_h_infinity_s_solution_satisfies_its_riccati_equation(bound):
    random = np.random.default_rng(4)
    a = random.normal(size=(4, 4)) - 3 * np.eye(4)
    worst, b, c = (random.normal(size=shape) for shape in ((4, 1), (4, 2), (2, 4)))
    x = _stabilising(a, worst, b, c, bound)
    quadratic = worst @ worst.T / bound**2 - b @ b.T
    np.testing.assert_allclose(a.T @ x + x @ a + x @ quadratic @ x + c.T @ c, 0.0, atol=1e-9)
    assert np.linalg.eigvals(a + quadratic @ x).real.max() < 0
    assert np.linalg.eigvalsh(x).min() > 0
