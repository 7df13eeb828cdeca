"""The reward and its terms, worked out by hand from actions and recorded forces."""

import gymnasium
import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfilt_zi

from panto_env import InputError, simulate
from panto_env.control.reward import REWARDS

pytestmark = pytest.mark.plain

NAME = "panto_env:PantographStiffness-v0"
WEIGHTS = {"cost_function": 0.7, "contact_loss": 3.0, "effort": 0.2, "rate": 0.4}
BOTH = {"place": "both", "force_limit": 250.0}


def play(env, actions, seed=0):
    """Rewards, terms and infos under given actions, or until the episode ends."""
    env.reset(seed=seed)
    rewards, terms, ended = [], {name: [] for name in WEIGHTS}, (False, False)
    for action in actions:
        _, reward, *ended, info = env.step(action)
        rewards.append(reward)
        for name, values in terms.items():
            values.append(info["reward_terms"][name])
        if any(ended):
            break
    return np.array(rewards), {name: np.array(values) for name, values in terms.items()}, ended


def effort_and_rate(actions):
    """Squared action, and squared half change of action, summed over the actuators; the first change is
    from no action."""
    actions = np.clip(actions, -1, 1)
    changes = np.diff(actions, axis=0, prepend=np.zeros((1, actions.shape[1])))
    return (actions**2).sum(axis=1), ((changes / 2) ** 2).sum(axis=1)


@pytest.fixture
def actions():
    """Beyond the limits too, where they are clipped before anything is counted."""
    return np.random.default_rng(0).uniform(-1.5, 1.5, (60, 2))


def test_effort_and_rate_are_those_of_the_clipped_actions(actions):
    env = gymnasium.make(NAME, actuator=BOTH).unwrapped
    effort, rate = effort_and_rate(actions)
    for seed in (0, 1):  # a second episode begins from no action too
        _, terms, _ = play(env, actions, seed)
        assert terms["effort"] == pytest.approx(effort)
        assert terms["rate"] == pytest.approx(rate)


def test_full_force_reversed_within_a_step_costs_one():
    env = gymnasium.make(NAME, reward={"cost_function": 0.0, "contact_loss": 0.0, "rate": 1.0}).unwrapped
    rewards, _, _ = play(env, [[1.0], [-1.0], [1.0], [1.0]])
    assert rewards == pytest.approx([-0.25, -1.0, -1.0, 0.0])


def test_reward_is_the_weighted_sum_by_hand(actions):
    env = gymnasium.make(NAME, actuator=BOTH, reward=WEIGHTS, speed_kmh=330).unwrapped
    rewards, terms, _ = play(env, actions)
    run = env.trajectory
    steps = round(0.01 / run.time_step)
    # Eq. 14 over a control step: trapezoids between samples; there is no interval before the first.
    deviation = np.abs(run.contact_force - run.nominal_force)
    intervals = np.append(0.0, 0.5 * (deviation[1:] + deviation[:-1])).reshape(-1, steps)
    lost = (run.contact_force <= 0).reshape(-1, steps)
    assert 0 < lost.mean() < 0.5
    effort, rate = effort_and_rate(actions)
    expected = (
        WEIGHTS["cost_function"] * intervals.mean(axis=1) / run.nominal_force
        + WEIGHTS["contact_loss"] * lost.mean(axis=1)
        + WEIGHTS["effort"] * effort
        + WEIGHTS["rate"] * rate
    )
    assert rewards == pytest.approx(-expected, rel=1e-9)
    stride = run.speed_kmh / 3.6 * run.time_step
    assert terms["cost_function"] == pytest.approx(stride * intervals.sum(axis=1), rel=1e-9)
    # Of the whole episode's distance, so that the sum is the share of it.
    distance = env.context.catenary.spans * run.alignment.mean_length
    control_steps = np.ceil(distance / (run.speed_kmh / 3.6 * 0.01))
    share = 100 * lost.sum(axis=1) / (control_steps * steps)
    assert terms["contact_loss"] == pytest.approx(share, rel=1e-9)


def test_early_end_is_charged_as_if_contact_were_lost_to_the_end():
    weights = {"cost_function": 0.5, "contact_loss": 2.0}
    actuator = {"force_limit": 400.0}
    env = gymnasium.make(NAME, actuator=actuator, reward=weights, distance=400.5).unwrapped
    rewards, terms, (terminated, truncated) = play(env, np.full((1000, 1), -1.0))
    assert (terminated, truncated) == (True, False)
    run = env.trajectory
    stride = run.speed_kmh / 3.6 * run.time_step
    steps = round(0.01 / run.time_step)
    left = np.ceil(400.5 / (stride * steps)) - len(rewards)
    assert left > 100
    cost = terms["cost_function"][-1] / (stride * steps * run.nominal_force)
    assert run.contact_force[-steps:].max() == 0.0
    assert rewards[-1] == pytest.approx(-(0.5 * cost + 2.0) - left * (0.5 + 2.0), rel=1e-9)


@pytest.mark.parametrize("target", ["nominal", "passive"])
def test_term_of_the_low_passed_force_is_scipy_s(target):
    """Behind a Butterworth filter of sixth order at 20 Hz, settled at the first sample."""
    weights = {"cost_function": 0.0, "contact_loss": 0.0, "low_passed": 0.5, "target": target}
    given = {"reward": weights, "speed_kmh": 300, "pantograph": "identified-2dof"}
    env = gymnasium.make(NAME, **given).unwrapped
    env.reset(seed=0)
    rewards, told, ended = [], [], False
    random = np.random.default_rng(0)
    while not ended:
        _, reward, *ends, info = env.step(random.uniform(-0.3, 0.3, 1))
        rewards.append(reward)
        told.append(info["reward_terms"]["low_passed"])
        ended = any(ends)
    run = env.trajectory
    sections = butter(6, 20, fs=1 / run.time_step, output="sos")
    force = run.contact_force
    filtered, _ = sosfilt(sections, force, zi=sosfilt_zi(sections) * force[0])
    aim = scale = run.nominal_force
    if target == "passive":
        passive = simulate("periodic-stiffness", "identified-2dof", 300.0).summary()
        aim, scale = passive.mean, passive.std
        assert aim < 0.9 * run.nominal_force  # a spring pulls back
    expected = (((filtered - aim) / scale) ** 2).reshape(len(rewards), -1).mean(axis=1)
    assert told == pytest.approx(expected, rel=1e-6)
    assert rewards == pytest.approx(-0.5 * expected, rel=1e-6)


def test_running_mean_counts_from_the_passive_mean_too():
    weights = {"cost_function": 0.0, "contact_loss": 0.0, "mean_force": 1.0}
    given = {"speed_kmh": 300, "pantograph": "identified-2dof", "distance": 300.0}
    sums = {}
    for target in ("nominal", "passive"):
        env = gymnasium.make(NAME, reward=weights | {"target": target}, **given).unwrapped
        env.reset(seed=0)
        answers = [env.step([0.0]) for _ in range(300)][100:]
        sums[target] = np.mean([reward for _, reward, *_ in answers])
        terms = [info["reward_terms"]["mean_force"] for *_, info in answers]
        assert terms == pytest.approx([-reward for _, reward, *_ in answers])
    assert sums["nominal"] < -0.01
    assert -0.002 < sums["passive"] <= 0.0


def test_presets_of_the_reward():
    pushes = np.full((30, 1), 0.5)
    weights = {"cost_function": 1.0, "contact_loss": 1.0, "effort": 0.0, "rate": 0.0}
    usual, preset, spelled, other = (
        play(gymnasium.make(NAME, reward=reward).unwrapped, pushes)[0].tolist()
        for reward in (None, "paper1", weights, "paper1:effort=0.1")
    )
    assert usual == preset == spelled != other
    assert REWARDS["agent"].low_passed > 0
    with pytest.raises(InputError, match="reward must be 'paper1' or 'benchmark' or 'agent'"):
        gymnasium.make(NAME, reward="papr1")


def test_early_end_is_no_way_out_of_the_low_passed_term():
    given = {"actuator": {"force_limit": 400.0}, "distance": 400.5, "reward": "agent:mean_force=0,rate=0"}
    env = gymnasium.make(NAME, **given).unwrapped
    rewards, _, (terminated, _) = play(env, np.full((1000, 1), -1.0))
    assert terminated
    steps = np.ceil(400.5 / (env.trajectory.speed_kmh / 3.6 * 0.01)) - len(rewards)
    passive = simulate("periodic-stiffness", "three-mass", 300.0).summary()
    charge = steps * (1.0 + (passive.mean / passive.std) ** 2)
    assert rewards[-1] == pytest.approx(rewards[-2] - charge, rel=0.02)
