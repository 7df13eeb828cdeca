"""The model behind an estimator against equations written out anew, SciPy's exponential and quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm
from scipy.signal import welch

from panto_env.base.errors import InputError
from panto_env.catalog import available, load_pantograph
from panto_env.estimation.force import FORCE_MODELS, Periodic, RandomWalk, Shaped, as_force_model
from panto_env.estimation.model import PAPER2, EstimatorSettings, build_model

from ..pantograph_alone import equations

SPEED, SPAN, STEP = 250 / 3.6, 60.0, 2e-3
TWO = load_pantograph("own-two-mass")


def built(pantograph=TWO, step=STEP, **settings):
    chosen = EstimatorSettings(**settings)
    return build_model(pantograph, chosen.force_model.process(SPEED, SPAN), chosen, step)


def test_two_masses_have_the_state_of_eq_7():
    """[x_a, x_q, v_a, v_q, F_C]: the force pushes the head down and is held but for noise."""
    model = built(force_model="random-walk:intensity=200", frame_intensity=0.7, **PAPER2)
    rates, forces = equations(TWO)  # forces: on the head up, on the frame up, the pair
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
    model = built(load_pantograph("dsa380"), observation="displacements", **PAPER2)
    np.testing.assert_array_equal(model.observed, np.eye(7)[[0, 2]])
    model = built(load_pantograph("dsa380"), **PAPER2)
    np.testing.assert_array_equal(model.observed, np.eye(7)[[0, 2, 3, 5]])


@pytest.mark.parametrize("name", available("pantograph"))
@pytest.mark.parametrize("force", FORCE_MODELS)
def test_two_steps_are_one_of_twice_the_length(name, force):
    pantograph = load_pantograph(name)
    one, two = (built(pantograph, step, force_model=force) for step in (STEP, 2 * STEP))
    np.testing.assert_allclose(one.transition @ one.transition, two.transition, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(one.transition @ one.inputs + one.inputs, two.inputs, rtol=1e-9, atol=1e-14)
    noise = one.transition @ one.process_noise @ one.transition.T + one.process_noise
    scale = np.sqrt(np.outer(np.diag(noise), np.diag(noise)))
    np.testing.assert_allclose(two.process_noise / scale, noise / scale, atol=1e-7)


def test_a_constant_error_of_the_suspension_pushes_head_and_frame_apart():
    model = built(suspension_drift=0.5)
    np.testing.assert_allclose(model.transition[:4, -1], model.inputs[:, 1][:4], rtol=1e-9)
    assert model.process_noise[-1, -1] == pytest.approx(0.5**2 * STEP)
    assert model.force[-1] == 0


@pytest.mark.parametrize(
    "force", [Shaped(), Shaped(damping=0.1, wavelength=8.0), Periodic(), Periodic(memory=50)]
)
def test_coloured_parts_begin_as_they_stay(force):
    """Their covariance at the start solves Lyapunov's equation; the slow part, first, only wanders."""
    process = force.process(SPEED, SPAN)
    drift, noise, start = (each[1:, 1:] for each in (process.drift, process.noise, process.start_covariance))
    left = drift @ start + start @ drift.T + noise
    np.testing.assert_allclose(left, 0, atol=1e-9 * np.abs(noise).max())
    assert process.output[0] == 1
    assert process.noise[0, 0] == force.intensity**2


def test_a_shaped_force_swings_where_droppers_pass_and_as_much_as_said():
    force = Shaped(intensity=0.01, deviation=30.0, wavelength=6.0, damping=0.05)
    model = built(force_model=force, step=1e-3)
    random = np.random.default_rng(0)
    factor = np.linalg.cholesky(model.process_noise[4:7, 4:7])
    transition, state, values = model.transition[4:7, 4:7], np.array([0.0, 30.0, 0.0]), []
    for noise in random.standard_normal((60_000, 3)):
        state = transition @ state + factor @ noise
        values.append(state[:2].sum())
    assert np.std(values) == pytest.approx(30, rel=0.1)
    frequency, power = welch(np.array(values), fs=1000, nperseg=8192)
    assert frequency[power.argmax()] == pytest.approx(SPEED / 6.0, rel=0.06)


def test_harmonics_are_those_of_passing_spans():
    process = Periodic(highest=5.0).process(SPEED, SPAN)
    turns = np.unique(np.round(np.abs(np.linalg.eigvals(process.drift).imag), 9))
    np.testing.assert_allclose(turns, 2 * np.pi * SPEED / SPAN * np.arange(5))


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
