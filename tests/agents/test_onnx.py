"""Networks as ONNX: ONNX Runtime gives the actions of the policies."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

import onnx
import onnxruntime

from panto_agents.model_file import Facts, Step, read_model
from panto_agents.onboard import write_onnx
from panto_agents.policy import TrainedPolicy
from panto_agents.stored import FOLDER
from panto_env import InputError, simulate
from panto_env.policies import find_policy

from ..marks import some_at_once
from .test_stored_agents import given

NAMES = ["agent-small", "agent-any-line", "agent-high-speed", "agent-head"]


def actions(path, observations, passes=1):
    """Actions of a file for observations, (steps, entries), seen by several passes side by side."""
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    start = json.loads(session.get_modelmeta().custom_metadata_map["start"])
    kinds = {"tensor(float)": np.float32, "tensor(double)": np.float64}
    state = {}
    for each in session.get_inputs()[1:]:
        first = np.array(start[each.name], dtype=kinds[each.type])
        state[each.name] = np.broadcast_to(first, (passes, each.shape[1]))
    assert set(state) == set(start)
    names = [each.name for each in session.get_outputs()]
    answered = []
    for observation in observations:
        seen = np.tile(np.asarray(observation, dtype=np.float32), (passes, 1))
        found = dict(zip(names, session.run(names, {"observation": seen, **state}), strict=True))
        state = {name: found[f"next_{name}"] for name in state}
        answered.append(found["action"])
    return np.array(answered)


@pytest.mark.parametrize("name", some_at_once(NAMES, ["agent-any-line"]))
def test_a_whole_pass_has_the_same_actions(name, tmp_path):
    policy, path, seen, answered = find_policy(name), tmp_path / "network.onnx", [], []
    write_onnx(policy, path)
    act = policy.act

    def listened(observation):
        seen.append(observation.copy())
        answered.append(act(observation))
        return answered[-1]

    policy.act = listened
    simulate(**given(name.removeprefix("agent-")), policy=policy, record_droppers=False, distance=450.0)
    assert len(answered) > 400
    assert np.std(answered) > 0.02
    assert np.abs(actions(path, seen)[:, 0] - answered).max() < 1e-6


def made_up(steps, tmp_path, **changes):
    """The policy of agent-head's task with steps before a small network, and with other facts."""
    facts, actor = read_model(FOLDER / "head.safetensors")
    facts = Facts.model_validate(facts.model_dump() | {"steps_before": steps} | changes)
    random = np.random.default_rng(0)
    shapes = (16, facts.inputs), (1, 16)
    weights = tuple((0.2 * random.standard_normal(shape)).astype(np.float32) for shape in shapes)
    biases = tuple(random.standard_normal(shape[0]).astype(np.float32) for shape in shapes)
    actor = replace(actor, weights=weights, biases=biases, activation="relu")
    return TrainedPolicy(tmp_path / "made-up.safetensors", facts, actor)


@pytest.mark.parametrize("padded", [False, True])
@pytest.mark.parametrize("washout", [None, {"time_constant": 0.3, "lag": 0.02, "rate": 400.0}])
def test_steps_before_the_network_are_in_it(padded, washout, tmp_path):
    """Scaled, stacked, scaled again; several passes side by side see the same."""
    width = len(find_policy("agent-head").facts.needs.entries)
    centre = tuple(np.linspace(-1.0, 1.0, width))
    steps = [
        Step(centre=centre, scale=(0.5,) * width, bound=1.5),
        Step(frames=3, padding=(0.25,) * width if padded else None),
        Step(centre=(0.1,) * 3 * width, scale=(2.0,) * 3 * width),
    ]
    policy = made_up([step.model_dump() for step in steps], tmp_path, washout=washout)
    needs = policy.facts.needs
    context = SimpleNamespace(
        force_limit=needs.force_limit, control_interval=needs.control_interval, actions=len(needs.channels)
    )
    policy._policy.reset(context)  # what a washout reads of an episode
    observations = np.random.default_rng(1).standard_normal((60, width)).astype(np.float32)
    expected = np.array([policy.act(each) for each in observations])
    path = tmp_path / "network.onnx"
    write_onnx(policy, path)
    onnx.checker.check_model(str(path), full_check=True)
    found = actions(path, observations, passes=2)
    assert np.abs(found - expected[:, None]).max() < 1e-6
    assert expected.std() > 0.05
    assert np.abs(expected[0] - expected[-1]).max() > 1e-3


def test_a_file_says_what_it_is(tmp_path):
    policy = find_policy("agent-any-line")
    for path in (tmp_path / "first.onnx", tmp_path / "second.onnx"):
        write_onnx(policy, path)
    assert (tmp_path / "first.onnx").read_bytes() == (tmp_path / "second.onnx").read_bytes()
    model = onnx.load(tmp_path / "first.onnx")
    onnx.checker.check_model(model, full_check=True)
    told = {each.key: each.value for each in model.metadata_props}
    assert told["command"] == policy.facts.command
    assert json.loads(told["needs"])["force_limit"] == 100.0
    assert [each["name"] for each in json.loads(told["observation"])] == [
        name for name, _, _ in policy.facts.needs.entries
    ]
    assert all(each.doc_string for each in (*model.graph.input, *model.graph.output))


def test_more_than_a_network_is_refused(tmp_path):
    needs = find_policy("agent-head").facts.needs.model_dump() | {"washout": 1.0}
    more = [find_policy(name) for name in ("pd", "agent-any-line-five", "agent-train", "guarded:agent-head")]
    for policy in (*more, made_up([], tmp_path, needs=needs)):
        with pytest.raises(InputError, match=r"export it as C instead\.$"):
            write_onnx(policy, tmp_path / "network.onnx")
    assert not list(tmp_path.iterdir())
