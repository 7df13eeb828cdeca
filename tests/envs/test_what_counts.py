"""What counts for reward and figures: after the spans of settle, from the target, without slow actions."""

import gymnasium
import numpy as np
import pytest

from panto_baselines.policies.repetitive import Washout, WashoutSettings
from panto_env import InputError, parallel_env, simulate
from panto_env.control.reward import REWARDS
from panto_env.envs import BARE, DrivenByPolicies
from panto_env.metrics.low_pass import low_pass
from panto_env.policies import find_policy, wishes

from ..marks import some_at_once

FLEXIBLE, LIGHT = "panto_env:Pantograph-v0", "panto_env:PantographStiffness-v0"
LINES = {FLEXIBLE: BARE | {"distance": 120.0, "accuracy": "fast"}, LIGHT: {"distance": 100.0}}


def episode(env, seed=0, action=None):
    """Rewards, terms and the last info of an episode under drawn actions, or one action."""
    env.reset(seed=seed)
    random, rewards, terms, ended = np.random.default_rng(seed), [], [], False
    while not ended:
        taken = random.uniform(-0.3, 0.3, env.action_space.shape) if action is None else action
        _, reward, *ends, info = env.step(np.asarray(taken, dtype=np.float32))
        rewards.append(reward)
        terms.append(info["reward_terms"])
        ended = any(ends)
    return np.array(rewards), terms, info


@pytest.mark.parametrize(
    ("name", "more"), [(FLEXIBLE, {"speed_drift": 5.0}), (LIGHT, {"run_in": 2.0}), (LIGHT, {})]
)
def test_figures_and_reward_are_of_what_comes_after_settle(name, more):
    env = gymnasium.make(name, **LINES[name] | more | {"settle": 2.0}).unwrapped
    rewards, terms, info = episode(env, seed=3)
    run, figures = env.trajectory, info["figures"]
    steps = env.task.length.control_steps
    uncounted = np.flatnonzero(rewards)[0]
    spans = run.alignment.in_spans(run.position)
    start = len(run.time) - steps * len(rewards)  # of the episode, behind the run-in
    first = start + steps * uncounted
    assert spans[first] - spans[start] == pytest.approx(2.0, abs=0.05)
    assert run.position[-1] - run.position[first] == pytest.approx(LINES[name]["distance"], abs=2.0)
    assert all(each[key] == 0 for each in terms[:uncounted] for key in each)
    counted, filtered = run.contact_force[first:], low_pass(run.contact_force[start:], run.time_step)
    assert figures["mean"] == pytest.approx(filtered[first - start :].mean())
    assert figures["std"] == pytest.approx(filtered[first - start :].std())
    assert figures["contact_loss"] == pytest.approx(100 * np.mean(counted <= 0))
    assert figures["distance"] == pytest.approx(run.position[-1] - run.position[first], rel=0.01)
    total = sum(each["cost_function"] for each in terms)
    assert figures["cost_function"] == pytest.approx(total)  # from the nominal force, both
    ways = np.diff(run.position[first - 1 :])
    deviation = np.abs(run.contact_force[first - 1 :] - run.lift[first - 1 :])
    by_hand = np.sum(0.5 * (deviation[1:] + deviation[:-1]) * ways)
    assert total == pytest.approx(by_hand, rel=1e-3)


def test_the_line_is_longer_by_what_settles_and_without_it_nothing_changes():
    plain, longer = (gymnasium.make("panto_env:Pantograph-v0", settle=each).unwrapped for each in (0.0, 6.0))
    assert longer.task.plant.spans == plain.task.plant.spans + 6
    assert longer.task.length.distance == pytest.approx(plain.task.length.distance + 6 * 60.0)
    zero, default = (
        episode(gymnasium.make(LIGHT, **more).unwrapped)[0] for more in ({"settle": 0.0, "washout": None}, {})
    )
    np.testing.assert_array_equal(zero, default)


TWO = BARE | {"pantographs": ["en50318-2002"] * 2, "distances": [100.0], "controlled": [1, 2]}
TWO |= {"accuracy": "fast"}
SIBLINGS = {
    "single": lambda settings: gymnasium.make(LIGHT, **settings),
    "train": lambda settings: gymnasium.make(FLEXIBLE, **TWO | settings),
    "driven": lambda settings: DrivenByPolicies(gymnasium.make(FLEXIBLE, **TWO | settings), {1: "passive"}),
    "agents": lambda settings: parallel_env(**TWO | settings),
    **{
        mode: lambda settings, mode=mode: gymnasium.make_vec(LIGHT, 2, autoreset_mode=mode, **settings)
        for mode in ("NextStep", "SameStep", "Disabled")
    },
    "lines": lambda settings: gymnasium.make_vec(LIGHT, 2, **settings | {"catenary": ["periodic-stiffness"]}),
    "vector of trains": lambda settings: gymnasium.make_vec(FLEXIBLE, 4, **TWO | settings),
    "tensors": lambda settings: gymnasium.make_vec(LIGHT, 2, device="cpu", **settings),
    "tensors of trains": lambda settings: gymnasium.make_vec(FLEXIBLE, 4, device="cpu", **TWO | settings),
}


def steps_of(env):
    """Rewards and what infos say counts, one or more each, at the start and in each step of an episode."""
    agents, ended = getattr(env, "possible_agents", None), False
    space = env.action_space(agents[0]) if agents else env.action_space
    action = np.zeros(space.shape, np.float32)
    if hasattr(env.unwrapped, "device"):
        action = pytest.importorskip("torch").from_numpy(action)
    info = env.reset(seed=0)[1]
    yield 0.0, np.asarray([each["counts"] for each in info.values()] if agents else info["counts"])
    while not ended:
        taken = env.step(dict.fromkeys(agents, action) if agents else action)
        _, reward, *ends, info = (list(each.values()) for each in taken) if agents else taken
        counts = [each["counts"] for each in info] if agents else info.get("final_info", info)["counts"]
        ended = np.asarray(ends).any()
        yield np.asarray(reward), np.asarray(counts)


@pytest.mark.longer
@pytest.mark.parametrize("name", some_at_once(SIBLINGS, set(SIBLINGS) - {"tensors of trains"}))
def test_infos_say_whether_a_reward_counts(name):
    """A reward of 0 does not, in any kind of environment: that of a step that counts is never so exact."""
    (_, first), *steps = steps_of(SIBLINGS[name]({"distance": 100.0, "settle": 2.0, "run_in": 1.0}))
    assert first.dtype == np.bool_
    assert not first.any()
    for reward, counts in steps:
        np.testing.assert_array_equal(reward != 0, counts)
    share = np.mean([counts for _, counts in steps])
    assert 0.2 < share < 0.8


def test_an_episode_of_which_nothing_would_count_is_refused():
    env = gymnasium.make("panto_env:Pantograph-v0", spans=8, settle=8.0)
    with pytest.raises(InputError, match="nothing of the episode is left to count"):
        env.reset(seed=0)


def test_an_early_end_before_anything_counts_is_charged_for_what_would_have_counted():
    settings = {"distance": 100.0, "settle": 2.0, "actuator": {"force_limit": 2000.0}}
    env = gymnasium.make(LIGHT, **settings).unwrapped
    rewards, _, info = episode(env, action=[-1.0])
    assert info["counts"]
    assert env.trajectory.terminated
    counted = 100.0 / (env.context.speed * env.context.control_interval)
    assert rewards[:-1].any() == 0
    assert rewards[-1] == pytest.approx(-2 * counted, rel=0.02)  # as if without contact: CF and CL are 1
    assert "std" not in info["figures"]  # it has none


def test_a_washout_is_that_of_the_policies_where_the_actuator_is_ideal():
    """Independent code: what a policy's own high-pass makes of the same actions."""
    settings = {"distance": 150.0, "actuator": {"force_limit": 50.0, "place": "both"}}
    inside, outside = (gymnasium.make(LIGHT, **settings, **more) for more in ({"washout": 0.7}, {}))
    shape = inside.action_space.shape
    own = Washout(WashoutSettings(time_constant=0.7, lag=0.0, rate=1e12), 0.01, 50.0, shape)
    for each in (inside, outside):
        each.reset(seed=1)
    random = np.random.default_rng(2)
    for _ in range(100):
        action = np.clip(random.normal(0.4, 0.5, shape), -1, 1)
        seen = inside.step(action)
        expected = outside.step(own(50.0 * action) / 50.0)
        np.testing.assert_allclose(seen[0], expected[0], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(seen[1], expected[1], rtol=1e-9)


@pytest.mark.parametrize("actuator", ["ideal", "realistic"])
def test_with_a_washout_no_constant_action_moves_the_mean(actuator):
    """The actuator's force itself has no average, whatever the actuator makes of a command."""
    settings = {"distance": 800.0, "actuator": actuator, "settle": 6.0}
    means = {}
    for washout in (None, 1.0):
        env = gymnasium.make(LIGHT, **settings, washout=washout).unwrapped
        episode(env, action=[0.5])
        run = env.trajectory
        means[washout] = np.mean((run.frame_force + run.head_force)[-len(run.time) // 2 :])
    assert abs(means[1.0]) < 0.02 * abs(means[None])


def test_with_the_target_passive_the_cost_function_counts_from_the_passive_mean():
    settings = BARE | {"distance": 180.0, "reward": "benchmark"}
    env = gymnasium.make("panto_env:Pantograph-v0", **settings).unwrapped
    rewards, terms, _ = episode(env)
    run = env.trajectory
    mean = simulate().summary().mean
    assert abs(mean - run.nominal_force) > 3
    deviation = np.abs(run.contact_force - mean)
    by_hand = np.sum(0.5 * (deviation[1:] + deviation[:-1])) * run.stride
    assert sum(each["cost_function"] for each in terms) == pytest.approx(by_hand, rel=1e-3)
    weights = REWARDS["benchmark"]
    sums = {name: sum(each[name] for each in terms) for name in terms[0]}
    relative = sums["cost_function"] / run.nominal_force / run.stride / env.task.length.control_steps
    expected = weights.cost_function * relative + weights.rate * sums["rate"]
    assert rewards.sum() == pytest.approx(-expected - weights.low_passed * sums["low_passed"])


def test_where_a_mean_is_required_the_nominal_target_is_that_mean():
    settings = {"distance": 100.0, "mean_force": 60.0, "pantograph": "identified-2dof"}
    env = gymnasium.make(LIGHT, **settings).unwrapped
    _, terms, info = episode(env)
    run = env.trajectory
    assert run.nominal_force > 65
    deviation = np.abs(run.contact_force - 60.0)
    by_hand = np.sum(0.5 * (deviation[1:] + deviation[:-1])) * run.stride
    assert sum(each["cost_function"] for each in terms) == pytest.approx(by_hand, rel=1e-3)
    assert info["figures"]["cost_function"] != pytest.approx(by_hand, rel=1e-3)


def test_policies_command_forces_as_they_are_unless_they_ask_for_a_washout():
    policy = find_policy("pd")
    assert wishes(policy)["washout"] == 0.0
    policy.washout = 2.0
    assert wishes(policy)["washout"] == 2.0
    run = simulate("periodic-stiffness", "three-mass", policy=policy, distance=60.0)
    assert run.settings["washout"] == 2.0
