"""Reference policies: the force for a known observation, and what they do on the line."""

import math

import pytest

from panto_baselines.policies.fb_ff import FeedbackFeedforward
from panto_baselines.policies.feedback import Proportional, ProportionalDerivative
from panto_env import InputError, simulate
from panto_env.envs import PantographEnv
from panto_env.policies import find_policy, wishes

from .laws import a_context, seen

SPEED_KMH = 300.0
POLICIES = ("passive", "p", "pd", "fb+ff")
CONTEXT = a_context(SPEED_KMH)
NOMINAL = CONTEXT.nominal_force


def force(policy, context=CONTEXT, **values):
    """Force (N) of the first action for an observation."""
    return float(policy.act(seen(context, **values)[0])[0]) * context.force_limit


def ready(policy, context=CONTEXT):
    policy.reset(context)
    return policy


@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.parametrize("place", ["frame", "head", "both"])
def test_actions_fit_any_actuator_and_only_the_first_one_acts(name, place):
    context = a_context(SPEED_KMH, actuator={"place": place})
    action = ready(find_policy(name), context).act(seen(context, contact_force=NOMINAL - 20)[0])
    assert action.shape == (context.actions,)
    assert (action[0] > 0) == (name != "passive")
    assert not action[1:].any()


@pytest.mark.parametrize("name", ["p", "pd", "fb+ff"])
def test_actions_stay_within_the_actuators_limit(name):
    context = a_context(SPEED_KMH, actuator={"force_limit": 10.0})
    policy = ready(find_policy(name), context)
    assert policy.act(seen(context, contact_force=0)[0])[0] == 1
    policy.reset(context)
    assert policy.act(seen(context, contact_force=NOMINAL + 50)[0])[0] == -1


@pytest.mark.parametrize("name", POLICIES)
def test_reset_forgets_the_last_episode(name):
    policy = find_policy(name)
    runs = []
    for _ in range(2):
        policy.reset(CONTEXT)
        runs.append([force(policy, contact_force=NOMINAL - 5 * k) for k in range(4)])
    assert runs[0] == runs[1]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("p:gain=-1", "gain must be a finite number of at least 0, not -1"),
        ("pd:washout=-1", "washout must be a finite number of at least 0, not -1"),
        ("p:gain=high", "gain must be a finite number"),
        ("p:gain=True", "gain must be a finite number"),
        ("pd:damping=1e999", "damping must be a finite number"),
        ("pd:derivative=None", "derivative must be a finite number"),
        ("fb+ff:dead_zone=-2", "dead_zone must be"),
        ("fb+ff:theta=late", "theta must be a finite number"),
        ("fb+ff:reading=loud", "reading must be one of span, printed"),
        ("fb+ff:speed_unit=mph", "speed_unit must be one of km/h, m/s"),
        ("fb+ff:gain={}", "gain must hold at least one speed"),
        ("p:gian=1", "gian"),
        ("mpc:rate=0", "rate must be a positive number"),
        ("lqg:gains=()", "gains must be finite numbers"),
        ("skyhook:gains=(1,1e999)", "gains must be finite numbers"),
        ("repetitive:gian=1", "gian"),
        ("repetitive:place='guessed'", "place must be one of read, counted"),
    ],
)
def test_bad_parameters_are_refused_by_name(source, words):
    with pytest.raises(InputError) as caught:
        find_policy(source)
    assert words in str(caught.value)
    assert f"'{source}'" in str(caught.value)


@pytest.mark.parametrize("name", ["p", "pd", "fb+ff", "tuned-pd", "tuned-fb+ff"])
def test_a_washout_is_a_parameter_and_off_by_default(name):
    """The papers' form is the default; with it a run takes the slow average of the force off."""
    assert [wishes(find_policy(f"{name}{given}"))["washout"] for given in ("", ":washout=None")] == [0.0, 0.0]
    assert wishes(find_policy(f"{name}:washout=1"))["washout"] == 1.0


def test_p_is_the_gain_times_what_the_force_lacks():
    policy = ready(Proportional(gain=0.5))
    assert force(policy, contact_force=NOMINAL - 40) == pytest.approx(20, rel=1e-5)
    assert force(policy, contact_force=NOMINAL + 30) == pytest.approx(-15, rel=1e-5)


def test_pd_adds_the_change_of_the_force_and_damps_the_frame():
    policy = ready(ProportionalDerivative(gain=0.5, derivative=0.01, damping=100))
    assert force(policy, contact_force=NOMINAL - 20) == pytest.approx(10, rel=1e-5)
    # The force fell by 5 N within 10 ms: 0.01 s x 500 N/s more.
    assert force(policy, contact_force=NOMINAL - 25) == pytest.approx(12.5 + 5, rel=1e-5)
    steady = force(policy, contact_force=NOMINAL - 25, frame_velocity=0.1)
    assert steady == pytest.approx(12.5 - 10, rel=1e-5)


def test_feedback_is_zero_in_the_dead_zone_and_counts_from_its_edge():
    policy = ready(FeedbackFeedforward(gain=2, amplitude=0, dead_zone=6))
    for lacking, expected in ((0, 0), (6, 0), (-6, 0), (10, 8), (-10, -8)):
        got = force(policy, contact_force=NOMINAL - lacking)
        assert got == pytest.approx(expected, abs=1e-4)


def test_feedback_takes_the_contact_force_in_from_0_to_300_newtons():
    context = a_context(SPEED_KMH, actuator={"force_limit": 1000.0})
    policy = ready(FeedbackFeedforward(amplitude=0), context)
    at_the_end = force(policy, context, contact_force=300)
    assert at_the_end == pytest.approx(NOMINAL - 300, rel=1e-5)
    assert force(policy, context, contact_force=450) == pytest.approx(at_the_end, rel=1e-5)
    assert force(policy, context, contact_force=-50) == pytest.approx(NOMINAL, rel=1e-5)


@pytest.mark.parametrize(("speed", "gain"), [(200, 0.4), (275, 0.55), (300, 0.6), (400, 0.8)])
def test_feedback_gain_depends_on_speed(speed, gain):
    context = a_context(speed_kmh=speed)
    policy = ready(FeedbackFeedforward(gain={400: 0.8, 200: 0.4}, amplitude=0), context)
    got = force(policy, context, contact_force=context.nominal_force - 10)
    assert got == pytest.approx(10 * gain, rel=1e-5)


@pytest.mark.parametrize(
    ("parameters", "turns_per_metre", "theta"),
    [
        ({}, 1 / 60, math.pi / 6),
        ({"reading": "printed"}, 2 * 300 / 60 / (4 * 60), -1.0),
        ({"reading": "printed", "speed_unit": "m/s"}, 2 * (300 / 3.6) / 60 / (4 * 60), math.pi / 6),
    ],
)
def test_feedforward_follows_the_equation_along_the_line(parameters, turns_per_metre, theta):
    env = PantographEnv(speed_kmh=SPEED_KMH)
    observation, _ = env.reset(seed=0)
    policy = ready(FeedbackFeedforward(gain=0, theta=theta, **parameters), env.context)
    for k in range(100):
        x = k * 0.01 * SPEED_KMH / 3.6
        action = policy.act(observation)
        expected = 10 * math.sin(2 * math.pi * turns_per_metre * x - theta)
        assert 100 * action[0] == pytest.approx(expected, abs=1e-6)
        observation, *_ = env.step(action)


def test_feedforward_refuses_sensors_that_do_not_tell_the_place():
    with pytest.raises(InputError, match="needs the place within the span"):
        simulate(policy="fb+ff", sensors="blind", distance=100.0)


def test_each_calms_the_contact_force_without_pressing_less():
    given = {"speed_kmh": SPEED_KMH, "distance": 600.0}
    figures = {name: simulate(policy=name, **given).summary((4, 8)) for name in POLICIES}
    passive = figures["passive"]
    for name in ("p", "pd", "fb+ff"):
        assert figures[name].std < 0.97 * passive.std
        assert figures[name].cost_function < passive.cost_function
        assert passive.mean < figures[name].mean < NOMINAL


def test_pd_stays_stable_under_a_real_actuator():
    given = {"actuator": "realistic", "sensors": "realistic", "distance": 500.0}
    passive, pd = (simulate(policy=policy, **given).summary((4, 7)) for policy in (None, "pd"))
    assert pd.std < passive.std
