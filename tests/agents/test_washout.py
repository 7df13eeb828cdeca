"""An agent whose action has no slow part, in lanes and as a policy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from safetensors.numpy import load_file
from typer.testing import CliRunner

from panto_agents import train
from panto_agents.model_file import read_model
from panto_agents.policy import TrainedPolicy, load
from panto_baselines.policies.repetitive import Washout, WashoutSettings
from panto_env import InputError, simulate
from panto_env.cli import make_app

from .test_agents import LINE, settings

INTERVAL = 0.01  # s


def constant(model, value, facts=None):
    """A model file's policy, its network answering a constant; with other facts if some are given."""
    own, actor = read_model(model)
    last = np.zeros_like(actor.weights[-1]), np.full_like(actor.biases[-1], value)
    actor = replace(actor, weights=(*actor.weights[:-1], last[0]), biases=(*actor.biases[:-1], last[1]))
    return TrainedPolicy(model, facts or own, actor)


@pytest.fixture(scope="module", params=[None, "fb+ff"])
def washed(request, tmp_path_factory):
    """A finished training whose agent has a washout, alone or added to a policy; read only."""
    training = settings("ppo", total_steps=128, washout={"time_constant": 0.5}, residual_of=request.param)
    return train.train(
        training, tmp_path_factory.mktemp("runs") / "washed", progress=False, command="panto train it"
    )


def test_it_is_the_filter_of_its_equation():
    from scipy.signal import lfilter

    at_once = WashoutSettings(time_constant=0.5, lag=0.0, rate=1e9)
    forces = 20 * np.random.default_rng(0).standard_normal((400, 2))
    washout = Washout(at_once, INTERVAL, 100.0, (2,))
    ours = np.array([washout(each) for each in forces])
    pole = np.exp(-INTERVAL / 0.5)
    np.testing.assert_allclose(ours, lfilter([1.0, -1.0], [1.0, -pole], forces, axis=0), atol=1e-10)


def test_an_actuator_s_mean_is_zero_where_limits_cut_one_side():
    """A pulse of 120 N for a quarter of the time, which limits of force and rate cut, and nothing between."""
    rate, step = 2500.0, 2.5e-4
    washout = Washout(WashoutSettings(time_constant=0.5, rate=rate), INTERVAL, 100.0, (1,))
    pulses = np.tile([120.0, 120.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 150)
    left = np.array([washout(np.array([each])) for each in pulses])[:, 0]
    assert np.abs(left).max() <= 100.0
    force, forces = 0.0, []
    for each in np.repeat(left, round(INTERVAL / step)):  # the actuator, in finer steps
        force += step * np.clip((each - force) / 0.015, -rate, rate)
        forces.append(force)
    settled = np.array(forces[-round(8 / step) :])
    assert settled.std() > 10
    assert abs(settled.mean()) < 0.03 * settled.std()


@pytest.mark.longer
def test_a_constant_action_leaves_the_mean_force_alone(washed):
    given = settings("ppo").arguments | {"distance": 600.0}
    base = read_model(washed.model)[0].residual_of or "passive"
    pressed, nothing = (
        simulate(**given, policy=policy, seed=3).summary() for policy in (constant(washed.model, 0.3), base)
    )
    assert abs(pressed.mean / nothing.mean - 1) < 0.003
    facts, _ = read_model(washed.model)
    without = constant(washed.model, 0.3, facts.model_copy(update={"washout": None}))
    assert simulate(**given, policy=without, seed=3).summary().mean > 1.02 * nothing.mean


@pytest.mark.longer
def test_lanes_do_as_the_policy_does(washed):
    """Two episodes of a training lane under the trained network are the policy's, bit for bit."""
    import gymnasium

    facts, actor = read_model(washed.model)
    training = settings("ppo", washout={"time_constant": 0.5}, residual_of=facts.residual_of)
    lanes, policy = train.make_lanes(training), load(washed.model)
    lanes.seed(2000)
    seen = lanes.reset()
    arguments = {key: value for key, value in LINE.items() if key != "id"}
    single = gymnasium.make(f"panto_env:{LINE['id']}", **arguments)
    observation, _ = single.reset(seed=2001)
    policy.reset(single.unwrapped.context)
    ends = 0
    for _ in range(150):
        np.testing.assert_array_equal(seen[1], observation)
        seen, *_ = lanes.step(np.array([actor.act(each) for each in seen]))
        observation, _, terminated, truncated, _ = single.step(policy.act(observation))
        if terminated or truncated:
            observation, _ = single.reset()
            policy.reset(single.unwrapped.context)
            ends += 1
    assert ends == 1


@pytest.mark.longer
def test_an_exported_model_is_the_same_policy_and_holds_nothing_pickled(washed, tmp_path):
    def export(source, target):
        return CliRunner().invoke(make_app(), ["export", str(source), str(tmp_path / target)])

    result = export(washed.best, "mine.safetensors")
    assert result.exit_code == 0, result.output
    held = load_file(tmp_path / "mine.safetensors")
    assert all(name.startswith("actor/") for name in held)
    assert read_model(tmp_path / "mine.safetensors")[0] == read_model(washed.best)[0]
    assert read_model(washed.best)[0].command == "panto train it"
    whole = load_file(washed.best)
    assert held.keys() == {name for name in whole if name.startswith("actor/")}
    for name, array in held.items():
        np.testing.assert_array_equal(array, whole[name])
    (tmp_path / "damaged.safetensors").write_bytes(washed.best.read_bytes()[:-200])
    with pytest.raises(InputError, match="not a whole model file"):
        raise export(tmp_path / "damaged.safetensors", "out.safetensors").exception
    assert not (tmp_path / "out.safetensors").exists()
