"""Scores and the two ways without a belief about the force, on records whose force is known."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env.base.errors import InputError
from panto_env.catalog import load_pantograph
from panto_env.estimation.estimate import estimate, model_of, phases, score
from panto_env.estimation.force import RandomWalk
from panto_env.estimation.model import EstimatorSettings
from panto_env.estimation.motion import Motion
from panto_env.estimation.unknown_input import CUTOFF, ORDER, _gain, _system, inertia_corrected, unknown_input
from panto_env.metrics.low_pass import low_pass

from ..pantograph_alone import equations

STEP = 1e-3
HELD = RandomWalk(intensity=0.01)
TIME = STEP * np.arange(12_000)


def tones(time, seed=0, highest=15.0, count=40):
    """A force of many tones about 120 N, each of a whole number of periods in the record."""
    random = np.random.default_rng(seed)
    frequency = np.unique(random.integers(1, int(12 * highest), count)) / 12
    phase = random.uniform(0, 2 * np.pi, len(frequency))
    size = 8 * random.uniform(0.5, 1.5, len(frequency))
    return 120 + size @ np.cos(2 * np.pi * np.outer(frequency, time) + phase[:, None])


def force_of(time):
    return tones(time, seed=3, highest=8.0, count=12)


@pytest.fixture(scope="module", params=["own-two-mass", "dsa380"])
def driven(request):
    """Motion of a pantograph of two or three masses under a known contact force, by SciPy's integrator."""
    pantograph = load_pantograph(request.param)
    rates, forces = equations(pantograph)
    n, lift = len(pantograph.masses), 120 + 0.07 * pantograph.stiffnesses[-1]  # that it hovers at 70 mm
    carried = np.zeros(2 * n)
    carried[:n] = np.linalg.solve(-rates[n:, :n], forces[n:, 1] * lift - forces[n:, 0] * 120)

    def known(t):
        return 5 * np.sin(7 * t), 3 * np.cos(4 * t)

    def rate(t, z):
        frame, head = known(t)
        return rates @ z + forces @ [-float(force_of(np.array([t]))[0]), lift + frame, head]

    time = TIME[:6000]
    found = solve_ivp(rate, (0, 6), carried, t_eval=time, method="DOP853", rtol=1e-10, atol=1e-12)
    frame_force, head_force = known(time + STEP / 2)  # in the middle of the step over which they are held
    z = found.y
    motion = Motion(
        time_step=STEP,
        head=z[0],
        frame=z[n - 1],
        head_velocity=z[n],
        frame_velocity=z[-1],
        frame_force=frame_force,
        head_force=head_force,
        lift=lift,
        contact_force=force_of(time),
    )
    return motion, pantograph


def noisy(motion, seed=0):
    random = np.random.default_rng(seed)
    heights = {name: getattr(motion, name) for name in ("head", "frame")}
    rates = {name: getattr(motion, name) for name in ("head_velocity", "frame_velocity")}
    return dataclasses.replace(
        motion,
        **{name: each + 2e-5 * random.standard_normal(len(each)) for name, each in heights.items()},
        **{name: each + 5e-3 * random.standard_normal(len(each)) for name, each in rates.items()},
    )


@pytest.mark.longer
@pytest.mark.parametrize("observation", ["displacements", "displacements and velocities"])
def test_a_record_without_noise_gives_the_force_back(driven, observation):
    motion, pantograph = driven
    quiet = {"displacement_noise": 1e-8, "velocity_noise": 1e-6, "frame_intensity": 1e-3}
    settings = EstimatorSettings(observation=observation, **quiet)
    error = (estimate(motion, pantograph, settings).force - motion.contact_force)[500:]
    assert np.abs(error).max() < 1.0
    smoothed = estimate(motion, pantograph, settings.model_copy(update={"lag": 0.05}))
    assert np.abs(smoothed.force - motion.contact_force)[500:-100].max() < 0.05


@pytest.mark.longer
def test_inertia_corrected_is_the_force_low_passed(driven):
    motion, pantograph = driven
    if len(pantograph.masses) == 3:
        with pytest.raises(InputError, match=r"'dsa380' has 3 masses; .* needs two"):
            inertia_corrected(motion, pantograph)
        return
    wanted = low_pass(motion.contact_force, STEP, CUTOFF, ORDER)
    # A difference looks half a step back. Inertia may be larger than the force, and so may its delay.
    for velocities, late in ((True, 1.0), (False, 2.0)):
        found = inertia_corrected(motion, pantograph, velocities=velocities)
        told = score(wanted, found, STEP, 20.0)
        assert told.correlation > 0.998
        assert abs(told.bias) < 0.05
        assert 0 <= 1e3 * told.delay <= late
    bare = dataclasses.replace(motion, head_velocity=None, frame_velocity=None)
    with pytest.raises(InputError, match="no velocities"):
        inertia_corrected(bare, pantograph)


@pytest.mark.longer
def test_an_unknown_input_is_found_whatever_it_does(driven):
    motion, pantograph = driven
    quiet = {"displacement_noise": 1e-7, "velocity_noise": 1e-6, "frame_intensity": 1e-3}
    found = unknown_input(motion, pantograph, EstimatorSettings(**quiet), cutoff=None)
    middle = force_of(motion.time - STEP / 2)  # of the step before each sample
    assert np.abs(found - middle)[100:].max() < 0.5


def test_an_unknown_input_is_that_of_least_squares_over_the_whole_record(driven):
    """Over all starts and all forces of 40 samples at once, without a recursion."""
    motion, pantograph = driven
    motion, n = noisy(motion), 40
    settings = EstimatorSettings()
    system, contact = _system(model_of(motion, pantograph, settings.model_copy(update={"force_model": HELD})))
    size, m = len(contact), len(system.observed)
    measured, pushed = motion.measured(m)[:n], motion.inputs[:n] @ system.inputs.T
    start = system.observed.T @ measured[0]
    values, vectors = np.linalg.eigh(system.process_noise)
    values = np.maximum(values, 1e-9 * values.max())  # least squares needs some noise everywhere
    inverse = (vectors / np.sqrt(values)).T
    system = system._replace(process_noise=vectors @ np.diag(values) @ vectors.T)
    # Unknowns: n states, then n - 1 forces. Rows: start, steps, samples, each over its noise.
    unknowns = size * n + n - 1
    rows, right = [], []
    place = [slice(k * size, (k + 1) * size) for k in range(n)]

    def add(weight, parts, value):
        row = np.zeros((len(value), unknowns))
        for where, matrix in parts:
            row[:, where] += matrix
        rows.append(weight @ row)
        right.append(weight @ value)

    add(np.diag(np.diag(system.start_covariance) ** -0.5), [(place[0], np.eye(size))], start)
    noise = np.diag(np.diag(system.measurement_noise) ** -0.5)
    for k in range(n):
        add(noise, [(place[k], system.observed)], measured[k])
        if k + 1 < n:
            where = size * n + k
            parts = [(place[k + 1], np.eye(size)), (place[k], -system.transition)]
            add(inverse, [*parts, (slice(where, where + 1), -contact[:, None])], pushed[k])
    matrix, target = np.vstack(rows), np.concatenate(right)
    unit = np.linalg.norm(matrix, axis=0)
    solved = np.linalg.lstsq(matrix / unit, target, rcond=None)[0] / unit
    state, covariance = start, system.start_covariance
    for k in range(n):
        gain, of_force, corrected = _gain(system, contact, covariance)
        news = measured[k] - system.observed @ state
        force = of_force @ news
        state = system.transition @ (state + gain @ news) + pushed[k]
        covariance = system.transition @ corrected @ system.transition.T + system.process_noise
    assert force == pytest.approx(solved[-1], rel=1e-6)


@pytest.mark.parametrize("late", [-4.25, 0.0, 0.4, 3.0, 7.3])  # ms
def test_a_delay_is_exact_by_both_ways(late):
    true, estimated = tones(TIME), tones(TIME - 1e-3 * late)
    for band in (5.0, 20.0):
        told = score(true, estimated, STEP, band)
        assert 1e3 * told.delay == pytest.approx(late, abs=0.02)
        assert 1e3 * told.phase_delay == pytest.approx(late, abs=0.02)


def test_a_delay_that_grows_with_frequency_is_told_by_phase():
    """A low-pass of first order at 10 Hz delays by atan(f / 10 Hz) / (2 pi f)."""
    random, decay = np.random.default_rng(0), np.exp(-2 * np.pi * 10 * STEP)
    true = random.standard_normal(60_000)
    estimated = np.zeros_like(true)
    for k in range(1, len(true)):
        estimated[k] = decay * estimated[k - 1] + (1 - decay) * true[k]
    found = phases(true, estimated, STEP)
    for frequency in (2.0, 10.0, 20.0):
        near = np.abs(found.frequency - frequency) < 0.3
        wanted = np.arctan(frequency / 10) / (2 * np.pi * frequency)
        assert found.delay[near].mean() == pytest.approx(wanted, abs=1e-3)
        assert found.coherence[near].min() > 0.9


def test_bias_error_and_correlation_are_those_of_the_band():
    """An error outside the band does not count, one within counts whole."""
    slow, fast = 6 * np.sin(2 * np.pi * 3 * TIME + 1), 50 * np.sin(2 * np.pi * 80 * TIME)
    true = 120 + 30 * np.sin(2 * np.pi * TIME)
    told = score(true, true + 2.5 + slow + fast, STEP, 20.0)
    assert told.bias == pytest.approx(2.5, abs=0.01)
    assert told.rms == pytest.approx(6 / np.sqrt(2), rel=0.01)
    assert told.whole_rms == pytest.approx(np.sqrt((6**2 + 50**2) / 2), rel=1e-3)
    assert told.correlation == pytest.approx(1 / np.sqrt(1 + (6 / 30) ** 2), abs=1e-3)
    assert told.delay == pytest.approx(0.0, abs=2e-3)


def test_records_too_short_for_a_band_are_refused():
    with pytest.raises(InputError, match="3000 samples 1 ms apart are too short"):
        score(TIME[:3000], TIME[:3000], STEP, 2.0)
    with pytest.raises(InputError, match="too coarse"):
        score(TIME, TIME, 0.03, 20.0)
