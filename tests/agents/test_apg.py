"""The analytic policy gradient: its linear passes beside the plant, and trainings with it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from panto_agents import apg
from panto_agents.apg import APGLearner, PassLanes, grouped, rollout
from panto_agents.linear_pass import LinearPass, Pulsing, measure
from panto_agents.policy import NetworkPolicy, load
from panto_agents.settings import Training, parse_training
from panto_agents.train import train
from panto_baselines.benchmark.settings import TRAINING
from panto_env import InputError, simulate
from panto_env.metrics.low_pass import low_pass

torch.set_num_threads(1)
PULSING = Pulsing(400, 1)
"""Longer than the passes: nothing of a response is neglected."""
ALONE = Pulsing(1, 1)
"""As good as no responses: for the force alone."""
FEW = {"updates": 2, "batch_size": 2, "net_arch": [16, 8], "response_steps": 9}
MEMORY = {"history": 2, "memory": [0.0, 0.05, 0.1], "memory_spans": 2, "harmonics": 2}


PASS = {"id": "Pantograph-v0", "accuracy": "fast", "washout": 0, "settle": 2, "distance": 150.0}
PASS |= {"line_condition": "as-built"}


def settings(**changes: Any) -> Training:
    environment = PASS | {"speed_kmh": 300, "observation": "measured", "normalise": 300} | MEMORY
    environment |= {"actuator": "realistic", "sensors": "realistic"} | changes.pop("environment", {})
    table = {"algorithm": "apg", "total_steps": 80_000, "lanes": 2, "checkpoint_steps": 40_000, "washout": {}}
    table |= {"environment": environment, "evaluation": {"interval_steps": 80_000}}
    table["hyperparameters"] = {"updates": 2, "batch_size": 2, "net_arch": [16], "learning_rate": 1e-2}
    return parse_training(table | changes, "the test")


def learner(training: Training) -> APGLearner:
    """A learner with a network that acts, by more than 5 N rms."""
    made = APGLearner(training.hyperparameters, PassLanes(training, PULSING), training.seed)
    with torch.no_grad():
        made.network.rest[-1].weight *= 60
    return made


def own_pass(made: APGLearner, training: Training, seed: int, pulsing: Pulsing = PULSING) -> LinearPass:
    """The pass of a learner's network."""
    lanes, policy = made.get_env(), NetworkPolicy(training.hyperparameters.actor(made), training.washout)
    return measure(lanes._settings[0], policy, seed, pulsing, lanes._law, lanes.share)


def ratio(made: APGLearner, training: Training, seed: int) -> float:
    """Variance of the force over the passive one in the plant."""
    own = own_pass(made, training, seed, ALONE).judged
    return float(own.force[own.counted_from + 1 :].astype(float).var() / own.passive_variance)


def test_an_actor_is_its_network_squashed():
    torch.manual_seed(0)  # of the first weights
    network = apg.Network(5, (16,), torch.nn.Tanh, 0)
    with torch.no_grad():
        network.rest[-1].weight *= 1e3
        seen = torch.randn(5, generator=torch.Generator().manual_seed(0))
        force = network.rest[0](torch.tanh(network.first(seen)))
    actor = settings().hyperparameters.actor(SimpleNamespace(network=network))
    actor.reset(None)
    assert 0.5 < abs(force.item()) < 5
    np.testing.assert_allclose(actor.act(seen.numpy()), torch.tanh(force).numpy(), rtol=1e-5)


TRAILING = {
    "pantographs": ["dsa380", "dsa380"],
    "distances": [100],
    "controlled": 2,
    "front": [0, 5, 10],
    "spans": 8,
}
CASES = {
    "added to a policy": ({"catenary": "en50318-2002", "normalise": 270, "distance": 250.0}, "repetitive"),
    "deviations, recurrent": (
        {"catenary": "family:high-speed", "observation": "deviations", "normalise": None},
        8,
    ),
    "trailing, with front": ({"catenary": "en50318-2002", "normalise": 270, **TRAILING}, 8),
}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    given, kind = CASES[request.param]
    hyperparameters = {"net_arch": [16], "recurrent_units": kind if kind == 8 else 0}
    changes = {"residual_of": kind, "residual_share": 0.5} if kind == "repetitive" else {}
    training = settings(environment={"speed_kmh": 270, **given}, hyperparameters=hyperparameters, **changes)
    made, seed = learner(training), TRAINING[7]
    return training, made, seed, own_pass(made, training, seed)


@pytest.mark.slow
def test_a_network_repeats_its_own_pass(case):
    """Actions and variance of the pass in torch are those of the environment, washout and memory included."""
    _, made, _, own = case
    with torch.no_grad():
        ratios, _, actions = rollout(grouped([own]), *made.get_env().terms, made.network)
    assert np.sqrt(np.mean(own.actions**2)) > 0.05
    np.testing.assert_allclose(actions[0].numpy(), own.actions, atol=1e-5)
    assert float(ratios[0]) == pytest.approx(own.judged.ratio**2, rel=1e-4)


@pytest.mark.slow
def test_the_gradient_is_that_of_the_plant(case):
    """Beside differences of whole passes in the plant, along the gradient and along a random direction."""
    training, made, seed, own = case
    parameters = list(made.network.parameters())
    ratios, _, _ = rollout(grouped([own]), *made.get_env().terms, made.network)
    slopes = torch.autograd.grad(ratios[0], parameters)
    torch.manual_seed(3)
    for direction in (slopes, [torch.randn_like(each) for each in parameters]):
        length = float(torch.sqrt(sum((each**2).sum() for each in direction)))
        expected = float(sum((a * b).sum() for a, b in zip(slopes, direction, strict=True))) / length
        step, reached = 0.005, []
        for sign in (1, -2, 1):  # back at the start in the end
            with torch.no_grad():
                for each, along in zip(parameters, direction, strict=True):
                    each += sign * step * along / length
            reached += [ratio(made, training, seed)] if len(reached) < 2 else []
        assert (reached[0] - reached[1]) / (2 * step) == pytest.approx(expected, rel=0.1, abs=0.02)


def test_a_pass_is_that_of_simulate():
    """The force, filtered along the whole record, and the passive variance where an episode counts."""
    training = settings()
    lanes = PassLanes(training, ALONE)
    own = measure(lanes._settings[0], _Script({60: 0.5}), TRAINING[0], ALONE).judged
    given = {"accuracy": "fast", "speed_kmh": 300, "line_condition": "as-built", "distance": 150.0 + 120}
    given |= {"actuator": "realistic", "sensors": "realistic", "pantograph_scatter": 0.05, "speed_drift": 0.5}
    environment = training.environments[0]
    given |= {key: environment[key] for key in given if key in environment and key != "distance"}
    given["catenary"] = "en50318-2002"
    run = simulate(**given, seed=TRAINING[0], policy=_Script({60: 0.5}))
    every = round(0.01 / run.time_step)
    force = low_pass(run.contact_force, run.time_step)[every - 1 :: every]
    count = min(len(force), len(own.force) - 1)
    np.testing.assert_allclose(own.force[1 : count + 1], force[:count], atol=2.0)
    assert own.counted_from * (300 / 3.6) * 0.01 == pytest.approx(120, abs=2)


@pytest.mark.longer
def test_a_pass_that_ends_early_is_run_anew_in_the_same_environment(monkeypatch):
    training = settings(lanes=4, variants=[{"speed_kmh": 280}, {"speed_kmh": 300}])
    lanes, actor = PassLanes(training, Pulsing(10, 1)), training.hyperparameters.actor(learner(training))
    lanes.seed(1)
    called: list[tuple[float, int]] = []
    failing = [1]  # numbers of the calls

    def measured(own: Any, policy: Any, seed: int, *rest: Any) -> LinearPass:
        called.append((own.speed_kmh[0], seed))
        if len(called) - 1 in failing:
            raise InputError("It ends early.")
        return measure(own, policy, seed, *rest)

    monkeypatch.setattr(apg, "measure", measured)
    monkeypatch.setattr(apg, "in_threads", lambda jobs: [job() for job in jobs])
    groups, _ = lanes.measure(actor)
    assert [len(group.judged) for group in groups] == [4]
    speeds, seeds = zip(*called, strict=True)
    assert speeds == (280, 300, 280, 300, 300)
    assert len(set(seeds)) == 5
    called.clear()
    failing[:] = range(1000)
    with pytest.raises(InputError, match="It ends early"):
        lanes.measure(actor)
    assert len(called) == apg.MOST_FAILURES


class _Script:
    """Actions by control step; zero at all others."""

    def __init__(self, actions: dict[int, float]) -> None:
        self._actions = actions

    def reset(self, context: Any) -> None:
        self._step = -1

    def act(self, observation: Any) -> Any:
        self._step += 1
        return np.array([self._actions.get(self._step, 0.0)])


@pytest.mark.slow
def test_a_training_lowers_sigma_and_its_model_runs_as_a_policy(tmp_path):
    training = settings(
        total_steps=300_000,
        environment={"line_condition": "smooth", "distance": 250.0},
        hyperparameters={"updates": 15, "batch_size": 2, "net_arch": [16], "learning_rate": 5e-3},
    )
    folder = train(training, tmp_path / "run", progress=False)
    policy = load(folder.best)
    assert policy.memory == (0.0, 0.05, 0.1)
    arguments = {"speed_kmh": 300, "line_condition": "smooth", "seed": 1001, "actuator": "realistic"}
    arguments |= {"sensors": "realistic", "spans": 12}
    active, passive = simulate(**arguments, policy=policy), simulate(**arguments)
    assert active.summary().std < 0.97 * passive.summary().std
    assert active.summary().mean == pytest.approx(passive.summary().mean, rel=0.015)


@pytest.mark.longer
def test_a_resumed_training_goes_on_from_its_checkpoint(tmp_path):
    folder = train(settings(total_steps=1, hyperparameters=FEW), tmp_path / "run", progress=False)
    first = load(folder.model).facts
    more = settings(total_steps=first.steps + 1, hyperparameters=FEW)
    train(more, tmp_path / "run", resume=True, progress=False)
    second = load(folder.model).facts
    assert second.steps > first.steps
    assert second.updates / first.updates == second.steps / first.steps  # all rounds are alike


@pytest.mark.longer
def test_a_training_goes_on_with_the_network_that_it_starts_from(tmp_path):
    shape = FEW | {"recurrent_units": 4}
    first = train(settings(total_steps=1, hyperparameters=shape), tmp_path / "first", progress=False)
    again = settings(start_from=str(first.model), hyperparameters=shape)
    learner = again.hyperparameters.make_learner(PassLanes(again, ALONE), 1)
    again.hyperparameters.begin_as(learner, again.start_from)
    actors = again.hyperparameters.actor(learner), load(first.model).actor
    for own, known in zip(*((*each.weights, *each.biases, *each.cell) for each in actors), strict=True):
        np.testing.assert_array_equal(own, known)


OBSERVED = "apg needs the observation 'measured' or 'deviations'"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start_from": "repetitive"}, "an agent that acts alone, which 'repetitive' is not"),
        ({"start_from": "agent-train"}, "an agent that acts alone, which 'agent-train' is not"),
        (
            {"start_from": "agent-any-line"},
            r"another shape; set net_arch = .96, 96., recurrent_units = 64 and",
        ),
        ({"lines": 2}, "apg draws a line for each pass"),
        ({"hyperparameters": {"gamma": 0.9}}, "of apg is not valid: key 'gamma' is not known"),
        ({"hyperparameters": {"updates": 0}}, "updates"),
        ({"environment": {"observation": "centred", "normalise": None}}, OBSERVED),
        ({"environment": {"observation": "full"}}, OBSERVED),
        ({"residual_of": "pd"}, r"adds to policies that act in many lanes at once.*not to 'pd'"),
    ],
)
def test_what_apg_does_not_do_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        PassLanes(settings(**changes), ALONE)
