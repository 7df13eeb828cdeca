"""Models against equations written out anew; filters, smoother and likelihood against a dense Gaussian."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm
from scipy.signal import welch
from scipy.stats import chi2, kstest, multivariate_normal, norm

from panto_env.base.errors import InputError
from panto_env.catalog import load_pantograph
from panto_env.estimation.force import FORCE_MODELS, Periodic, RandomWalk, Shaped, as_force_model
from panto_env.estimation.innovations import consistency, log_likelihood, nis, whiteness
from panto_env.estimation.kalman import (
    Gains,
    force_variance,
    run_filter,
    smooth_force,
    steady_covariance,
    steady_gain,
    steady_gains,
    time_varying_gains,
)
from panto_env.estimation.model import PAPER2, EstimatorSettings, build_model

from ..pantograph_alone import equations

PANTOGRAPH = load_pantograph("own-two-mass")
SPEED, SPAN, STEP = 250 / 3.6, 60.0, 2e-3
N = 14
"""Samples of small problems."""


def built(step=5e-3, pantograph=PANTOGRAPH, **settings):
    chosen = EstimatorSettings(**settings)
    return build_model(pantograph, chosen.force_model.process(SPEED, SPAN), chosen, step)


def simulated(model, samples, seed, start=None, inputs=None):
    """Measured, (n, m), and states, (n, N), of the model itself."""
    pushed = np.zeros((samples, 2)) if inputs is None else inputs
    random = np.random.default_rng(seed)
    size, m = model.observed.shape[1], len(model.observed)
    values, vectors = np.linalg.eigh(model.process_noise)
    root = vectors * np.sqrt(np.maximum(values, 0))
    state = np.zeros(size) if start is None else start
    states, noise = np.empty((samples, size)), np.sqrt(np.diag(model.measurement_noise))
    for k in range(samples):
        states[k] = state
        state = model.transition @ state + model.inputs @ pushed[k]
        state = state + root @ random.standard_normal(size)
    return states @ model.observed.T + noise * random.standard_normal((samples, m)), states


class Dense:
    """All states and samples of a record as one Gaussian, written out without a recursion of covariances."""

    def __init__(self, model, start, inputs):
        n, size, m = len(inputs), len(start), len(model.observed)
        means, maps = [start], [np.eye(size, size * n)]
        for k in range(1, n):  # state k from the start and what noise added after each step
            means.append(model.transition @ means[-1] + model.inputs @ inputs[k - 1])
            maps.append(model.transition @ maps[-1] + np.eye(size, size * n, k * size))
        self.mean, whole = np.array(means), np.vstack(maps)
        sources = np.zeros((size * n, size * n))
        for k in range(n):
            part = slice(k * size, (k + 1) * size)
            sources[part, part] = model.start_covariance if k == 0 else model.process_noise
        self.states = whole @ sources @ whole.T
        self.seen = np.kron(np.eye(n), model.observed)
        self.samples = self.seen @ self.states @ self.seen.T + np.kron(np.eye(n), model.measurement_noise)
        self.size, self.m = size, m

    def state(self, measured, k, until):
        """Mean and covariance of state k given samples 0 to ``until`` - 1."""
        part, given = slice(k * self.size, (k + 1) * self.size), until * self.m
        cross = (self.states @ self.seen.T)[part, :given]
        unit = np.sqrt(np.diag(self.samples)[:given])
        scaled = self.samples[:given, :given] / np.outer(unit, unit)
        gain = np.linalg.solve(scaled, (cross / unit).T).T / unit
        news = (measured - self.mean @ self.seen[: self.m, : self.size].T).ravel()[:given]
        return self.mean[k] + gain @ news, self.states[part, part] - gain @ cross.T


@pytest.fixture(scope="module", params=["displacements", "displacements and velocities"])
def small(request):
    """A record of N samples, its model, its filter, and its dense Gaussian."""
    model = built(observation=request.param)
    # A start that is known within bounds in which the dense Gaussian is not rounded away.
    deviation = np.array([1e-3, 1e-3, 0.1, 0.1, 20.0, 5.0])
    model = model._replace(start_covariance=np.diag(deviation**2))
    random = np.random.default_rng(1)
    start, inputs = np.array([0.05, 0.07, 0, 0, 110.0, 1.0]), 120 + 10 * random.standard_normal((N, 2))
    measured, _ = simulated(model, N, 2, start, inputs)
    filtered = run_filter(model, time_varying_gains(model, N), measured, inputs, start)
    return model, measured, filtered, Dense(model, start, inputs)


def test_the_filter_is_the_conditional_mean_of_each_state(small):
    model, measured, filtered, dense = small
    for k in range(N):
        before, covariance = dense.state(measured, k, k)
        after, corrected = dense.state(measured, k, k + 1)
        unit = np.sqrt(np.diag(covariance))
        np.testing.assert_allclose(filtered.predicted[k] / unit, before / unit, atol=1e-6)
        np.testing.assert_allclose(filtered.state[k] / unit, after / unit, atol=1e-6)
        gains = filtered.gains.of(np.array([k]))
        np.testing.assert_allclose(
            gains.force[0] / unit, covariance @ model.force / unit, rtol=1e-5, atol=1e-5
        )
        assert force_variance(model, gains) == pytest.approx(model.force @ corrected @ model.force, rel=1e-5)


def test_the_smoother_is_the_conditional_mean_given_later_samples(small):
    model, measured, filtered, dense = small
    for lag in (0, 1, 5, 100):
        force = smooth_force(model, filtered, lag)
        wanted = [model.force @ dense.state(measured, k, min(k + lag + 1, N))[0] for k in range(N)]
        np.testing.assert_allclose(force, wanted, atol=1e-5)


def test_the_likelihood_is_the_density_of_all_samples(small):
    model, measured, filtered, dense = small
    mean = dense.mean @ model.observed.T
    unit = np.sqrt(np.diag(dense.samples))  # scaled: the density's covariance is near singular otherwise
    normal = multivariate_normal(np.zeros(len(unit)), dense.samples / np.outer(unit, unit))
    wanted = normal.logpdf((measured - mean).ravel() / unit) - np.log(unit).sum()
    assert log_likelihood(filtered) == pytest.approx(wanted, rel=1e-7)
    m = len(model.observed)
    given = multivariate_normal(np.zeros(3 * m), (dense.samples / np.outer(unit, unit))[: 3 * m, : 3 * m])
    first = given.logpdf(((measured - mean).ravel() / unit)[: 3 * m]) - np.log(unit[: 3 * m]).sum()
    assert log_likelihood(filtered, 3) == pytest.approx(wanted - first, rel=1e-7)


@pytest.mark.longer
@pytest.mark.parametrize("force", ["random-walk", "shaped", "periodic:highest=6"])
@pytest.mark.parametrize("observation", ["displacements", "displacements and velocities"])
def test_the_steady_gain_is_the_limit_of_the_time_varying_one(force, observation):
    model = built(force_model=force, observation=observation, suspension_drift=5.0)
    gains = time_varying_gains(model, 20_000)
    assert len(gains.gain) < 20_000  # settled
    unit = np.sqrt(np.diag(steady_covariance(*model.linear)))
    measured = np.sqrt(np.diag(gains.innovation[-1]))
    scale = measured / unit[:, None]
    np.testing.assert_allclose(gains.gain[-1] * scale, steady_gain(*model.linear) * scale, atol=1e-5)
    steady = steady_gains(model)
    np.testing.assert_allclose(steady.innovation[0], gains.innovation[-1], rtol=1e-5, atol=1e-12)
    assert force_variance(model, steady) == pytest.approx(force_variance(model, gains), rel=1e-5)


def test_steady_filter_and_smoother_are_those_of_a_record_that_begins_as_it_stays():
    """From the steady covariance on the time-varying filter's gains never change."""
    model = built()
    model = model._replace(start_covariance=steady_covariance(*model.linear))
    measured, states = simulated(model, 3000, 5)
    inputs = np.zeros((3000, 2))
    steady = run_filter(model, steady_gains(model), measured, inputs, np.zeros(6))
    many = Gains(*(np.repeat(each, 3000, axis=0) for each in steady_gains(model)))
    for lag in (0, 20):
        np.testing.assert_allclose(
            smooth_force(model, steady, lag),
            smooth_force(model, run_filter(model, many, measured, inputs, np.zeros(6)), lag),
            atol=1e-6,
        )
    true = states @ model.force
    filter_error = (steady.state @ model.force - true).std()
    smoother_error = (smooth_force(model, steady, 20) - true)[:-20].std()
    assert filter_error == pytest.approx(np.sqrt(force_variance(model, steady.gains)), rel=0.08)
    assert smoother_error == pytest.approx(np.sqrt(force_variance(model, steady.gains, 20)), rel=0.08)
    assert smoother_error < 0.75 * filter_error


def test_a_true_model_passes_and_wrong_ones_fail():
    model = built(step=1e-3)
    time = 1e-3 * np.arange(8000)
    inputs = np.column_stack([30 * np.sin(2 * np.pi * 1.2 * time), 0 * time])
    measured, _ = simulated(model, 8000, 7, inputs=inputs)

    def tested(other):
        filtered = run_filter(other, steady_gains(other), measured, inputs, np.zeros(6))
        return filtered, consistency(filtered, time, 1000)

    filtered, right = tested(model)
    assert right.nis_bounds[0] < right.nis < right.nis_bounds[1]
    assert abs(right.whiteness.largest) < right.whiteness.bound
    assert right.whiteness.probability > 0.01
    assert kstest(nis(filtered)[1000::7], chi2(4).cdf).pvalue > 0.01
    assert right.nis_bounds == pytest.approx((chi2.ppf(0.005, 28e3) / 28e3, chi2.ppf(0.995, 28e3) / 28e3))
    _, noisy = tested(model._replace(measurement_noise=0.8 * model.measurement_noise))
    assert noisy.nis > noisy.nis_bounds[1]
    _, slow = tested(built(step=1e-3, force_model="random-walk:intensity=50"))
    assert abs(slow.whiteness.largest) > slow.whiteness.bound
    assert slow.whiteness.probability < 1e-6
    heavy = PANTOGRAPH.model_copy(update={"masses": (8.0, 17.0)})
    _, wrong = tested(built(step=1e-3, pantograph=heavy))
    assert wrong.nis > 1.2


def test_whiteness_is_ljung_and_box_s_sum_term_by_term():
    """Of so few samples that each factor counts: n (n + 2) / (n - lag), and the number of quantities."""
    values = np.random.default_rng(0).standard_normal((60, 2))
    values[1:, 0] += 0.25 * values[:-1, 0]
    sums = []
    for column in values.T - values.mean(axis=0)[:, None]:
        shifted = np.correlate(column, column, "full")[len(column) :]
        correlation = shifted[:20] / (column @ column)
        sums.append(60 * 62 * sum(r**2 / (60 - lag) for lag, r in enumerate(correlation, 1)))
    found = whiteness(values)
    assert found.probability == pytest.approx(2 * chi2.sf(max(sums), 20))
    assert 0.001 < found.probability < 0.9
    assert found.bound == pytest.approx(norm.isf((1 - 0.99 ** (1 / 40)) / 2) / np.sqrt(60))


def test_the_size_of_innovations_is_judged_piece_by_piece():
    """A record of 3 s whose last second is twice as loud, in pieces of half a second."""
    time, sizes = 0.01 * np.arange(300), np.repeat([1.0, 1.0, 2.0], 100)
    innovations = sizes[:, None] * np.random.default_rng(1).choice([-1.0, 1.0], (300, 2))
    unit = Gains(np.zeros((1, 4, 2)), np.eye(2)[None], np.zeros((1, 4)))
    found = consistency(SimpleNamespace(innovations=innovations, gains=unit), time)
    np.testing.assert_allclose(found.window_nis, [1, 1, 1, 1, 4, 4])
    np.testing.assert_allclose(found.window_time, 0.245 + 0.5 * np.arange(6))
    assert found.nis == pytest.approx(2.0)


def test_what_has_no_steady_gain_is_told():
    model = built()
    blind = model._replace(observed=0 * model.observed)
    with pytest.raises(InputError, match="no steady gain"):
        steady_gain(*blind.linear)


def test_two_masses_have_the_state_of_eq_7():
    """[x_a, x_q, v_a, v_q, F_C]: the force pushes the head down and is held but for noise."""
    model = built(STEP, force_model="random-walk:intensity=200", frame_intensity=0.7, **PAPER2)
    rates, forces = equations(PANTOGRAPH)  # forces: on the head up, on the frame up, the pair
    drift = np.zeros((5, 5))
    drift[:4, :4], drift[:4, 4] = rates, -forces[:, 0]
    np.testing.assert_allclose(model.transition, expm(STEP * drift), rtol=1e-11, atol=1e-15)
    held = quad_vec(lambda time: expm(time * drift)[:, :4] @ forces[:, 1:], 0, STEP)[0]
    np.testing.assert_allclose(model.inputs, held, rtol=1e-9, atol=1e-15)
    noise = np.zeros((5, 5))
    noise[4, 4] = 200.0**2
    noise[:4, :4] = 0.7**2 * np.outer(forces[:, 1], forces[:, 1])
    added = quad_vec(lambda time: expm(time * drift) @ noise @ expm(time * drift).T, 0, STEP)[0]
    scale = np.sqrt(np.outer(np.diag(added), np.diag(added)))
    np.testing.assert_allclose(model.process_noise / scale, added / scale, atol=1e-8)
    np.testing.assert_array_equal(model.observed, np.eye(5)[:4])
    np.testing.assert_array_equal(model.force, [0, 0, 0, 0, 1])
    np.testing.assert_allclose(np.diag(model.measurement_noise), [4e-10, 4e-10, 2.5e-5, 2.5e-5])


def test_displacements_are_those_of_head_and_frame():
    model = built(STEP, load_pantograph("dsa380"), observation="displacements", **PAPER2)
    np.testing.assert_array_equal(model.observed, np.eye(7)[[0, 2]])
    model = built(STEP, load_pantograph("dsa380"), **PAPER2)
    np.testing.assert_array_equal(model.observed, np.eye(7)[[0, 2, 3, 5]])


@pytest.mark.parametrize("name", ["own-two-mass", "dsa380"])
@pytest.mark.parametrize("force", FORCE_MODELS)
def test_two_steps_are_one_of_twice_the_length(name, force):
    pantograph = load_pantograph(name)
    one, two = (built(step, pantograph, force_model=force) for step in (STEP, 2 * STEP))
    np.testing.assert_allclose(one.transition @ one.transition, two.transition, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(one.transition @ one.inputs + one.inputs, two.inputs, rtol=1e-9, atol=1e-14)
    noise = one.transition @ one.process_noise @ one.transition.T + one.process_noise
    scale = np.sqrt(np.outer(np.diag(noise), np.diag(noise)))
    np.testing.assert_allclose(two.process_noise / scale, noise / scale, atol=1e-7)


@pytest.mark.parametrize("force", [Shaped(), Shaped(damping=0.1, wavelength=8.0), Periodic(memory=50)])
def test_coloured_parts_begin_as_they_stay(force):
    """Their covariance at the start solves Lyapunov's equation; the slow part, first, only wanders."""
    process = force.process(SPEED, SPAN)
    drift, noise, start = (each[1:, 1:] for each in (process.drift, process.noise, process.start_covariance))
    left = drift @ start + start @ drift.T + noise
    np.testing.assert_allclose(left, 0, atol=1e-9 * np.abs(noise).max())
    assert process.output[0] == 1
    assert process.noise[0, 0] == force.intensity**2
    if isinstance(force, Periodic):  # harmonics are those of passing spans
        turns = np.unique(np.round(np.abs(np.linalg.eigvals(process.drift).imag), 9))
        np.testing.assert_allclose(turns, 2 * np.pi * SPEED / SPAN * np.arange(len(turns)))
        assert 19 < SPEED / SPAN * (len(turns) - 1) <= 20


def test_a_shaped_force_swings_where_droppers_pass_and_as_much_as_said():
    force = Shaped(intensity=0.01, deviation=30.0, wavelength=6.0, damping=0.05)
    model = built(1e-3, force_model=force)
    random = np.random.default_rng(0)
    factor = np.linalg.cholesky(model.process_noise[4:7, 4:7])
    transition, state, values = model.transition[4:7, 4:7], np.array([0.0, 30.0, 0.0]), []
    for noise in random.standard_normal((60_000, 3)):
        state = transition @ state + factor @ noise
        values.append(state[:2].sum())
    assert np.std(values) == pytest.approx(30, rel=0.1)
    frequency, power = welch(np.array(values), fs=1000, nperseg=8192)
    assert frequency[power.argmax()] == pytest.approx(SPEED / 6.0, rel=0.06)


def test_what_a_force_model_needs_and_does_not_get():
    assert as_force_model("shaped:wavelength=5") == Shaped(wavelength=5)
    assert as_force_model({"kind": "periodic", "memory": 30}) == Periodic(memory=30)
    assert as_force_model("random-walk") == RandomWalk()
    with pytest.raises(InputError, match="The shaped force model needs the speed of the train, which is not"):
        Shaped().process(None, 60.0)
    with pytest.raises(InputError, match="The periodic force model needs the length of a span"):
        Periodic().process(70.0, None)
    with pytest.raises(InputError, match="Spans pass at 70 Hz, above the highest harmonic of 20 Hz"):
        Periodic().process(70.0, 1.0)
    with pytest.raises(InputError, match="'white'"):
        as_force_model("white")
