"""Which parameters a motion tells, and that the extended filter and maximum likelihood find them."""

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.catalog import load_pantograph
from panto_env.estimation.estimate import estimate, filter_motion, model_of, tune
from panto_env.estimation.force import RandomWalk
from panto_env.estimation.innovations import log_likelihood
from panto_env.estimation.kalman import steady_gains
from panto_env.estimation.model import PAPER2, EstimatorSettings
from panto_env.estimation.motion import Motion
from panto_env.estimation.parameters import (
    LIFT,
    changed,
    estimate_parameters,
    frame_parameters,
    information,
    parameter_names,
)

TRUE = load_pantograph("own-two-mass")
STEP, N = 2e-3, 5000
SETTLED = 500  # samples of the first second
PLAIN = EstimatorSettings(frame_intensity=0.02, **PAPER2)


def wandering(settings=PLAIN, samples=N, seed=0, balanced=False):
    """A motion of the estimator's own model; what wanders would leave every range in the end.

    So the force is drawn back to 117 N, or, where balanced, an actuator on the frame, which is known,
    balances it.
    """
    none = np.zeros(samples)
    model = model_of(Motion(STEP, none, none, none, none, none, none, lift=120.0), TRUE, settings)
    random = np.random.default_rng(seed)
    values, vectors = np.linalg.eigh(model.process_noise)
    root = vectors * np.sqrt(np.maximum(values, 0))
    state, states = np.array([0.03, 0.05, 0, 0, 120.0]), np.empty((samples, 5))
    acting = np.zeros(samples)
    for k in range(samples):
        states[k] = state
        acting[k] = (state[4] - 117.0) * balanced
        state = model.transition @ state + model.inputs @ [120.0 + acting[k], 0.0]
        state = state + root @ random.standard_normal(5)
        state[4] -= STEP * 50.0 * (state[4] - 117.0) * (not balanced)
    noise = [settings.displacement_noise] * 2 + [settings.velocity_noise] * 2
    seen = states[:, :4] + noise * random.standard_normal((samples, 4))
    return Motion(STEP, *seen.T, acting, none, lift=120.0, contact_force=states[:, 4])


@pytest.fixture(scope="module")
def motion():
    return wandering()


def bound(motion, names, settings=PLAIN):
    """Least standard deviations that any unbiased estimate has (Cramér and Rao), relative."""
    return np.sqrt(np.diag(np.linalg.inv(information(motion, TRUE, settings, names))))


def test_names_are_those_of_the_chain():
    keys = ("masses", "stiffnesses", "dampings")
    assert parameter_names(TRUE) == tuple(f"{key}.{place}" for key in keys for place in (1, 2))
    assert frame_parameters(TRUE) == parameter_names(TRUE)[1:]
    assert "dampings.1" not in parameter_names(load_pantograph("dsa380"))  # it is 0: there is no logarithm
    other = changed(TRUE, {"masses.2": 20.0, "masses.1": 9.0, "dampings.2": 1.0})
    assert (other.masses, other.dampings) == ((9.0, 20.0), (20.0, 1.0))


def test_the_heads_mass_cannot_be_seen_and_the_frame_can(motion):
    """The freer the force, the less is told of the head's mass; of the frame the same remains."""
    told = {}
    for intensity in (1e2, 1e5):
        force = RandomWalk(intensity=intensity)
        settings = PLAIN.model_copy(update={"force_model": force})
        told[intensity] = np.diag(information(motion, TRUE, settings, parameter_names(TRUE)))
    assert told[1e5][0] < 0.1 * told[1e2][0]
    np.testing.assert_allclose(told[1e5][1:], told[1e2][1:], rtol=0.05)
    assert told[1e5][0] < 1e-4 * told[1e5][1]  # a hundred times as unsure as the frame's


def test_frame_parameters_are_told_but_for_a_common_scale_that_the_lift_tells(motion):
    names = frame_parameters(TRUE)
    assert np.all(bound(motion, names) < [0.01, 0.01, 0.1, 0.05, 0.01])
    sure = PLAIN.model_copy(update={"frame_intensity": 1e-3})
    values, vectors = np.linalg.eigh(information(motion, TRUE, sure, (*names, LIFT)))
    # All parameters and the lift by the same factor: the same motion, so that nothing tells the factor ...
    alike = np.ones(6) / np.sqrt(6)
    assert abs(vectors[:, 0] @ alike) > 0.999
    assert values[0] < 1e-4 * values[1]
    # ... and every ratio is told.
    assert values[1] > 1e4


@pytest.mark.longer
def test_the_extended_filter_finds_what_it_can_and_says_how_well(motion):
    names = frame_parameters(TRUE)
    wrong = dict(zip(names, (1.1, 0.92, 1.1, 0.9, 1.08), strict=True))
    known = changed(TRUE, {name: factor * value(name) for name, factor in wrong.items()})
    drifting = PLAIN.model_copy(update={"suspension_drift": 5.0})  # would leave the scale of all to chance
    found = estimate_parameters(motion, known, drifting)
    assert found.names == names
    true = np.array([value(name) for name in names])
    error = np.log(found.values / true)
    assert np.all(np.abs(error) < 4 * found.deviation)
    assert np.all(np.abs(error) < [0.01, 0.01, 0.15, 0.1, 0.02])
    np.testing.assert_allclose(found.deviation[:2], bound(motion, names)[:2], rtol=0.5)
    assert found.history.shape == (N, 5)
    assert np.all(found.resolved[[0, 1, 4]] > 0.9)
    assert found.pantograph.masses[1] == found.values[0]
    settings = EstimatorSettings()

    def wrong_by(force):
        return (force - motion.contact_force)[N // 2 :].std()

    assert wrong_by(estimate(motion, found.pantograph, settings).force) < wrong_by(
        estimate(motion, known, settings).force
    )


def value(name):
    key, place = name.split(".")
    return getattr(TRUE, key)[int(place) - 1]


def test_unknown_parameters_are_refused(motion):
    with pytest.raises(InputError, match=r"'masses.8' is no parameter of 'own-two-mass'"):
        estimate_parameters(motion, TRUE, PLAIN, ("masses.8",))
    with pytest.raises(InputError, match=r"The head's mass, 'masses.1', can't be estimated"):
        estimate_parameters(motion, TRUE, PLAIN, parameter_names(TRUE))
    with pytest.raises(InputError, match="at least one parameter"):
        estimate_parameters(motion, TRUE, PLAIN, ())


@pytest.mark.slow
def test_maximum_likelihood_finds_the_intensities_that_made_the_record():
    told = {"displacement_noise": 5e-5, "frame_intensity": 0.5}
    made = PLAIN.model_copy(update=told | {"force_model": RandomWalk(intensity=400.0)})
    motions = [wandering(made, 3000, seed, balanced=True) for seed in (1, 2)]
    names = ("force_model.intensity", "displacement_noise", "frame_intensity")
    found = tune(motions, TRUE, PLAIN, names)
    assert found.values["force_model.intensity"] == pytest.approx(400, rel=0.1)
    assert found.values["displacement_noise"] == pytest.approx(5e-5, rel=0.05)
    assert found.values["frame_intensity"] == pytest.approx(0.5, rel=0.15)
    assert found.settings.frame_intensity == found.values["frame_intensity"]
    assert found.log_likelihood > found.before
    assert found.at_bounds == ()
    assert found.before == pytest.approx(likelihood(motions, PLAIN) / (2 * (3000 - SETTLED)))
    # The greatest: on every side the record is less likely.
    most = likelihood(motions, found.settings)
    for name in names:
        assert likelihood(motions, moved(found.settings, name, 0.8)) < most
        assert likelihood(motions, moved(found.settings, name, 1.25)) < most


def moved(settings, name, factor):
    if name == "force_model.intensity":
        force = RandomWalk(intensity=factor * settings.force_model.intensity)
        return settings.model_copy(update={"force_model": force})
    return settings.model_copy(update={name: factor * getattr(settings, name)})


def likelihood(motions, settings):
    total = 0.0
    for motion in motions:
        model = model_of(motion, TRUE, settings)
        total += log_likelihood(filter_motion(model, steady_gains(model), motion), SETTLED)
    return total


def test_tuning_says_what_a_record_does_not_tell(motion):
    drifting = PLAIN.model_copy(update={"suspension_drift": 0.01})
    found = tune([motion], TRUE, drifting, ("suspension_drift",))  # there is none
    assert found.at_bounds == ("suspension_drift",)
    for names, message in (
        (("speed",), "Unknown value 'speed' to tune"),
        (("force_model.damping",), "Unknown value 'force_model.damping'"),
        (("suspension_drift",), "'suspension_drift' is 0, which can't be tuned"),
    ):
        with pytest.raises(InputError, match=message):
            tune([motion], TRUE, PLAIN, names)
    with pytest.raises(InputError, match="at least one healthy run"):
        tune([], TRUE, PLAIN, ("frame_intensity",))
