"""Learning beside fitted feedback and feed-forward, and paper 1's laws with fitted gains."""

import numpy as np
import pytest

from panto_baselines.policies.adaptive import (
    COUNT,
    HARMONICS,
    SIGNALS,
    Adaptive,
    AdaptiveFeedforward,
    FittedFeedback,
    LinearFeedback,
)
from panto_baselines.policies.fb_ff import FeedbackFeedforward, TunedFeedbackFeedforward
from panto_baselines.policies.feedback import ProportionalDerivative, TunedProportionalDerivative
from panto_baselines.policies.line_model import OUTPUTS, Sampled
from panto_baselines.policies.repetitive import LISTENING, Repetitive
from panto_baselines.tuning.tune import MEAN_TOLERANCE, Still, run_batch
from panto_env import InputError, simulate
from panto_env.control.settings import run_settings

from .laws import CONTEXT, MODEL, repeated, seen

FEEDBACK = np.array([0.0, 2, 0, -12, -9, 0, 0, 3, -6, -4, 0, 0, 0, 0, 2, -1.5, -1])
"""Gains that leave the loop stable and change its answers by a quarter and more."""


def test_answers_of_the_closed_loop_are_those_of_a_simulation():
    """Of the sampled model under the feedback itself, in time; slow averages are left out of the answers."""
    policy, turn = Adaptive(gains=[*FEEDBACK, 0.5, 0.0, 0.05]), 2 * np.pi * CONTEXT.control_interval
    policy.begin(CONTEXT, 1)
    interval, sampled = CONTEXT.control_interval, Sampled(MODEL, CONTEXT.control_interval)
    rows = [OUTPUTS.index(name) for name in SIGNALS]
    for frequency in (4.0, 9.0):
        feedback, state = LinearFeedback(FEEDBACK, interval, 1), np.zeros(sampled.size)
        forces = []
        for k in range(2000):
            outputs = sampled.c @ state
            forces.append(outputs[0])
            command = feedback(outputs[rows][:, None], np.array([np.cos(turn * frequency * k)]))
            feedback.remember(command)
            state = sampled.a @ state + sampled.b * command[0]
        late = np.arange(1000, 2000)
        turns = np.exp(-1j * turn * frequency * late)
        answer = 2 * np.mean(np.array(forces)[late] * turns)
        expected = policy.answers(MODEL, np.array([frequency]))[0]
        alone = sampled.response(np.exp(1j * turn * np.array([frequency])))[0, 0]

        assert abs(expected - answer) < 0.04 * abs(answer)
        assert abs(alone - answer) > 0.15 * abs(answer)


@pytest.mark.longer
def test_it_learns_beside_feedback_what_repeats_to_near_zero():
    controlled, passive = repeated(Adaptive(gains=[*FEEDBACK, 0.5, 0.0, 0.05]), 25)
    assert controlled[1] != pytest.approx(passive[1], rel=0.02)  # feedback acts from the start
    assert controlled[-1] < 0.05 * passive[-1]


@pytest.mark.longer
def test_learning_goes_on_from_the_feed_forward():
    series = np.zeros(2 * HARMONICS)
    series[[0, 15]] = 9.0, -6.0
    begun = AdaptiveFeedforward(gains=[*series, *np.zeros(COUNT), 0.5, 0.0, 0.05])
    controlled, passive = repeated(begun, 25)
    listening = int(LISTENING) - 2
    assert abs(controlled[listening] / passive[listening] - 1) > 0.02
    assert controlled[-1] < 0.05 * passive[-1]


def test_before_it_learns_it_does_what_fitted_feedback_does():
    """But for a washout of two seconds, of which a tenth of a second passes."""
    gains = np.random.default_rng(2).normal(size=2 * HARMONICS + COUNT)
    gains[-2:] = 4.0, -2.0
    policies = AdaptiveFeedforward(gains=[*gains, 0.5, 0.0, 0.05]), FittedFeedback(gains=gains.tolist())
    random, forces = np.random.default_rng(4), []
    observations = [
        seen(angle=0.1 * k, contact_force=random.normal(120, 30), frame_velocity=random.normal(0, 0.1))
        for k in range(10)
    ]
    for policy in policies:
        policy.begin(CONTEXT, 1)
        forces.append([policy.forces(each)[0] for each in observations])
    assert np.std(forces[1]) > 2.0
    assert forces[0] == pytest.approx(forces[1], abs=0.06 * np.abs(forces[1]).max())


@pytest.mark.slow
def test_without_a_place_it_takes_more_off_sigma_than_learning_alone():
    settings = run_settings(
        {"speed_kmh": 325.0, "actuator": "realistic", "sensors": "blind", "line_condition": "smooth"}
        | {"accuracy": "fast"}
    )
    laws = [Still(), Repetitive(place="counted"), Adaptive(place="counted")]
    force = run_batch(settings, laws, [1000, 1003])
    changes = (force.std[1:] / force.std[0]).mean(axis=1) - 1
    assert changes[1] < -0.2
    assert changes[1] < changes[0] - 0.01
    assert force.mean[2] == pytest.approx(force.mean[0], rel=MEAN_TOLERANCE)
    with pytest.raises(InputError, match="needs the place within the span"):
        run_batch(settings, [Adaptive()], [1003])


SINE, COSINE = float(14.0 * np.cos(0.7)), float(-14.0 * np.sin(0.7))


@pytest.mark.parametrize(
    ("tuned", "plain", "bias"),
    [
        (
            TunedProportionalDerivative(gains=(0.8, 0.004, 120.0, -3.5)),
            ProportionalDerivative(gain=0.8, derivative=0.004, damping=120.0),
            -3.5,
        ),
        (
            TunedFeedbackFeedforward(gains=(0.4, SINE, COSINE, 2.0)),
            FeedbackFeedforward(gain=0.4, theta=0.7, amplitude=14.0),
            2.0,
        ),
    ],
)
def test_tuned_laws_are_the_plain_ones_with_a_bias(tuned, plain, bias):
    tuned.reset(CONTEXT)
    plain.reset(CONTEXT)
    for force, velocity, angle in ((100.0, 0.02, 0.1), (330.0, -0.05, 2.2), (-20.0, 0.0, 4.5)):
        observation = seen(angle=angle, contact_force=force, frame_velocity=velocity)
        expected = plain.force(observation[0]) + bias
        assert tuned.forces(observation)[0] == pytest.approx(expected, abs=1e-3)


@pytest.mark.slow
def test_learning_goes_on_at_another_speed():
    """By the sigma of its first spans, at a lower speed, it would back off for ever."""
    given = {"speed_profile": "place:0=200,1500=280", "distance": 3600.0, "line_condition": "as-built"}
    runs = [simulate("re330", "dsa380", policy=policy, seed=1, **given) for policy in (None, "repetitive")]
    passive, learnt = (run.summary((40, 49)).std for run in runs)
    assert learnt < 0.75 * passive
