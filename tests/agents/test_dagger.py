"""Imitation in rounds: what is shown to whoever learns, what it learns from it, and what is refused."""

from __future__ import annotations

from copy import deepcopy
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from panto_agents.apg import Network
from panto_agents.dagger import TaughtLanes, along
from panto_agents.model_file import read_model
from panto_agents.settings import Training, parse_training
from panto_agents.train import train
from panto_env import InputError
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.policies import find_policy

from .test_apg import PASS
from .test_rollout import stepped

torch.set_num_threads(1)
TEACHER = "agent-any-pantograph"
SEEN = {"harmonics": 2, "history": 1, "memory": [0, 0.04, 0.1], "memory_spans": 1}
"""A part of what the teacher sees."""


def settings(**changes: Any) -> Training:
    environment = PASS | {"catenary": "re330", "pantograph": "dsa380", "speed_kmh": [260, 300]} | SEEN
    environment |= {"observation": "deviations"} | changes.pop("environment", {})
    table = {"algorithm": "dagger", "total_steps": 6000, "lanes": 6, "checkpoint_steps": 9000, "washout": {}}
    table |= {"environment": environment, "evaluation": {"interval_steps": 9000, "speeds_kmh": [280]}}
    hyperparameters = {"teacher": TEACHER, "learning_rate": [1e-2, 1e-3], "net_arch": [8]}
    table["hyperparameters"] = hyperparameters | {"recurrent_units": 4}
    return parse_training(table | changes, "the test")


@pytest.mark.longer
def test_whoever_learns_sees_a_part_and_hears_the_teacher():
    training = settings(lanes=1)
    needs = find_policy(TEACHER).facts.needs
    every = settings(lanes=1, environment={name: getattr(needs, name) for name in (*SEEN, "observation")})
    lessons = []
    for each in (training, every):
        lanes = TaughtLanes(each)
        lanes.seed(3)
        lessons += lanes.teach(None)
    part, whole = lessons
    names = [name for name, _, _ in needs.entries]
    own = [each.name for each in Task(run_settings(training.arguments)).context(0).layout.entries]
    assert len(own) < len(names)
    places = [names.index(name) for name in own]
    np.testing.assert_array_equal(part.observations, whole.observations[:, places])
    np.testing.assert_array_equal(part.wanted, whole.wanted)
    actor = find_policy(TEACHER).actor
    actor.reset(None)
    np.testing.assert_allclose([actor.act(seen)[0] for seen in whole.observations], whole.wanted, atol=1e-6)


@pytest.mark.slow
def test_it_learns_to_do_most_of_what_its_teacher_does(tmp_path):
    facts, actor = read_model(train(settings(), tmp_path / "run", progress=False).best)
    assert facts.algorithm == "dagger"
    assert facts.qualified
    assert facts.ratio < 0.8
    assert sum(each.size for each in (*actor.weights, *actor.biases)) < 500


@pytest.mark.slow
def test_round_by_round_it_comes_nearer_to_its_teacher():
    hyperparameters = {"teacher": TEACHER, "learning_rate": 1e-2, "net_arch": [8], "updates": 40}
    training, told, ends = settings(lanes=2, hyperparameters=hyperparameters | {"recurrent_units": 4}), [], []
    lanes = TaughtLanes(training)
    lanes.seed(0)
    learner = training.hyperparameters.make_learner(lanes, 0)
    learner.set_logger(SimpleNamespace(record=lambda *each: told.append(each), dump=ends.append))
    steps = [len(each.wanted) for each in deepcopy(lanes).teach(None)]
    for _ in range(3):
        learner.learn(1, MagicMock())
    errors = [value for name, value in told if name == "train/relative_error"]
    assert len(errors) == 3
    assert errors[2] < 0.85 * errors[0]
    assert ends[0] == sum(steps)
    assert learner.num_timesteps == ends[2] > 2.5 * ends[0]


def test_a_sequence_goes_through_the_network_as_step_by_step():
    torch.manual_seed(0)
    network = Network(5, (7, 6), torch.nn.Tanh, 4)
    seen = torch.randn(9, 2, 5)
    with torch.no_grad():
        network.rest[-1].weight *= 50
        for each in range(2):
            state, actions = None, []
            for step in seen[:, each : each + 1]:
                action, state = stepped(network, step[0], state)
                actions.append(float(action))
            np.testing.assert_allclose(along(network, seen)[:, each], actions, atol=1e-6)
    along(network, seen).sum().backward()
    assert all(each.grad is not None for each in network.parameters())


REFUSED = {
    "more": ({"environment": {"history": 6}}, "does not see 'head displacement deviation, 5 steps ago'"),
    "scale": ({"environment": {"observation": "measured"}}, "does not see"),
    "washout": ({"washout": None}, "another washout"),
    "start": ({"start_from": "pd"}, "leave out start_from"),
    "adds": ({"hyperparameters": {"teacher": "agent-train"}}, "which 'agent-train' is not$|is not"),
    "law": ({"hyperparameters": {"teacher": "pd"}}, "'pd' is not"),
    "lines": ({"lines": 2}, "draws a line for each pass"),
    "actuator": ({"environment": {"actuator": "head-motor:place='head'"}}, "trained with an actuator on"),
}


@pytest.mark.longer
@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_fit_is_refused_in_a_sentence(case):
    changes, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        TaughtLanes(settings(**changes))
