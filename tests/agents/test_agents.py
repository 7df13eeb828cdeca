"""Training, its folder and resume, model files, and trained models as policies."""

from __future__ import annotations

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

import torch
from safetensors.numpy import load_file

from panto_agents import command, train
from panto_agents.evaluation import NOT_OF_A_PASS, Comparison
from panto_agents.lanes import lane_seeds
from panto_agents.model_file import read_model, restore
from panto_agents.policy import TrainedPolicy, load
from panto_agents.settings import Training, load_training, parse_training
from panto_agents.trainings import RunFolder
from panto_baselines.benchmark.settings import TRAINING, check_seeds
from panto_configs import names
from panto_env import InputError, simulate
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.envs import IDS

from ..plugin import install

torch.set_num_threads(1)  # as a training does: more of them wait for each other
TOML = """
algorithm = "ppo"
total_steps = 512
lanes = 2
checkpoint_steps = 128
environment = { id = "PantographStiffness-v0", distance = 80.0, harmonics = 3 }
evaluation = { interval_steps = 128 }
hyperparameters = { n_steps = 64, batch_size = 64, n_epochs = 1, net_arch = [8] }
"""
LINE = {"id": "PantographStiffness-v0", "distance": 80.0}  # 96 control steps at 300 km/h
SMALL = {
    "ppo": {"n_steps": 64, "batch_size": 64, "n_epochs": 2, "net_arch": [8]},
    "sac": {"batch_size": 16, "learning_starts": 50, "buffer_size": 1000, "net_arch": [8]},
}


def settings(kind: str, **changes: Any) -> Training:
    usual = {"environment": LINE, "evaluation": {"interval_steps": 128}, "hyperparameters": SMALL[kind]}
    usual |= {"seed": 1, "total_steps": 256, "lanes": 2, "checkpoint_steps": 128}
    return parse_training({"algorithm": kind} | usual | changes, "test")


@pytest.fixture(scope="session")
def runs(tmp_path_factory) -> dict[str, RunFolder]:
    """Tiny finished runs; read only."""
    folder = tmp_path_factory.mktemp("runs")
    return {kind: train.train(settings(kind), folder / kind, progress=False) for kind in SMALL}


@pytest.fixture(params=["ppo", "sac"])
def finished(request, runs) -> RunFolder:
    return runs[request.param]


@pytest.fixture
def copied(runs, tmp_path) -> RunFolder:
    """One of them, to be changed."""
    shutil.copytree(runs["ppo"].path, tmp_path / "ppo")
    return RunFolder(tmp_path / "ppo")


def algorithm_of(folder: RunFolder) -> str:
    return folder.path.name


def rows(folder: RunFolder) -> list[dict[str, str]]:
    with folder.evaluations.open(newline="") as file:
        return list(csv.DictReader(file))


def weights(path: Path) -> list[np.ndarray]:
    _, actor = read_model(path)
    return [*actor.weights, *actor.biases]


def learner(training, folder):
    return train.Run(training, folder, train.make_lanes(training))


@pytest.mark.longer
def test_a_run_s_folder_its_tables_and_its_best_model(finished):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    files = {path.name for path in finished.path.iterdir()} - {".lock"}
    tables = {"evaluations.csv", "settings.json"}
    assert files == {"best.safetensors", "checkpoints", "model.safetensors", "tensorboard"} | tables
    steps = [read_model(path)[0].steps for path in sorted(finished.checkpoints.iterdir())]
    assert steps == [128, 256]
    assert finished.read_settings() == settings(algorithm_of(finished))
    table = rows(finished)
    assert [row["steps"] for row in table] == ["128", "256"]
    assert {row["seed"] for row in table} == {"1000"}  # of those for selection
    log = EventAccumulator(str(finished.tensorboard)).Reload()
    for name in ("mean", "std", "cost_function", "contact_loss"):
        assert len(log.Scalars(f"evaluation/{name}_300_kmh")) == 2
        assert len(log.Scalars(f"episode/{name}")) == 1
    facts, _ = read_model(finished.best)
    scores = [
        (row["qualified"] == "True", -float(row["policy_std"]) / float(row["passive_std"])) for row in table
    ]
    assert str(facts.steps) == table[scores.index(max(scores))]["steps"]
    assert facts.ratio == pytest.approx(-max(scores)[1])


@pytest.mark.longer
def test_same_seed_same_weights(runs, tmp_path):
    again = train.train(settings("ppo"), tmp_path / "again", progress=False)
    for one, other in zip(weights(runs["ppo"].model), weights(again.model), strict=True):
        np.testing.assert_array_equal(one, other)
    one, other = (
        training.hyperparameters.actor(learner(training, RunFolder(tmp_path)).model).weights[0]
        for training in (settings("ppo"), settings("ppo", seed=2))
    )
    assert not np.array_equal(one, other)


@pytest.mark.longer
def test_nothing_is_left_where_a_training_cannot_begin(tmp_path):
    bad = settings("ppo").model_copy(update={"environment": LINE | {"catenary": "nowhere"}})
    many = settings("ppo", evaluation={"interval_steps": 128, "seeds": 1001})
    for training, message in ((bad, "nowhere"), (many, "Seeds for selection")):
        with pytest.raises(InputError, match=message):
            train.train(training, tmp_path / "run", progress=False)
        assert not (tmp_path / "run").exists()


class TestResume:
    @pytest.mark.longer
    def test_goes_on_from_the_newest_whole_checkpoint(self, copied):
        before, newest = weights(copied.model), copied.checkpoint(256)
        newest.write_bytes(newest.read_bytes()[:-100])
        train.train(settings(algorithm_of(copied), total_steps=512), copied.path, resume=True, progress=False)
        assert read_model(copied.model)[0].steps == 512
        assert [row["steps"] for row in rows(copied)] == ["128", "256", "384", "512"]
        assert not np.array_equal(before[0], weights(copied.model)[0])
        kept = sorted(path.name for path in copied.checkpoints.iterdir())
        assert kept == [f"step-{steps:09d}.safetensors" for steps in (256, 384, 512)]

    def test_restores_networks_optimisers_and_replay(self, finished):
        training = settings(algorithm_of(finished))
        run = learner(training, finished)
        run.restore()
        ours = run.model.get_parameters()
        saved = load_file(finished.checkpoint(256))
        for key, tensor in ours["policy"].items():
            np.testing.assert_array_equal(tensor, saved[f"learner/policy/{key}"])
        optimisers = [name for name in ours if name.endswith("optimizer")]
        for name in optimisers:
            for k, moments in ours[name]["state"].items():
                assert moments["step"] > 0
                assert moments["exp_avg"].abs().max() > 0
                for key, tensor in moments.items():
                    np.testing.assert_array_equal(tensor, saved[f"learner/{name}/{k}/{key}"])
            assert len(ours[name]["state"]) == len(ours[name]["param_groups"][0]["params"])
        assert len(optimisers) == (3 if training.algorithm == "sac" else 1)
        assert run.model.num_timesteps == 256
        if training.algorithm == "sac":
            assert run.model.log_ent_coef.item() == saved["learner/log_ent_coef"].item() != 0
            buffer = run.model.replay_buffer
            assert (buffer.pos, buffer.full) == (128, False)
            assert np.abs(buffer.observations[:128]).max(axis=(1, 2)).min() > 0
            np.testing.assert_array_equal(buffer.rewards[:128], saved["replay/rewards"])

    def test_a_finished_run_stays_as_it_is(self, runs):
        folder = runs["ppo"]
        before, same = folder.model.read_bytes(), settings("ppo")
        train.train(same, folder.path, resume=True, progress=False)
        other = settings("ppo", hyperparameters=SMALL["ppo"] | {"gamma": 0.5})
        for training, path, resume, message in (
            (same, folder.path, False, r"exists already.*--resume"),
            (other, folder.path, True, "hyperparameters.gamma is 0.5, was 0.97"),
            (settings("ppo", total_steps=128), folder.path, True, "not fewer"),
            (same, folder.path / "none", True, "no run to resume"),
        ):
            with pytest.raises(InputError, match=message):
                train.train(training, path, resume=resume, progress=False)
        assert folder.model.read_bytes() == before


class TestPolicy:
    def test_acts_as_stable_baselines_does(self, finished):
        model = learner(settings(algorithm_of(finished)), finished).model
        restore(finished.model, model)
        policy = load(finished.model)
        task = Task(run_settings(settings(algorithm_of(finished)).arguments))
        policy.reset(task.context(0))
        for observation in np.random.default_rng(0).uniform(-2, 2, (50, 9)).astype(np.float32):
            expected, _ = model.predict(observation, deterministic=True)
            action = policy.act(observation)
            np.testing.assert_allclose(action, expected, atol=1e-5)
            np.testing.assert_array_equal(action, policy.act(observation))
            assert action.dtype == np.float64
        run = simulate(**settings(algorithm_of(finished)).arguments, policy=str(finished.model))
        assert np.abs(run.frame_force).max() > 0
        assert run.policy == str(finished.model)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"observation": "full"}, "observation='measured'"),
            ({"actuator": {"place": "head"}}, "'place': 'frame'"),
            ({"actuator": {"force_limit": 50.0}}, "force_limit to 100"),
            ({"control_interval": 0.02}, "control_interval of 0.01 s"),
        ],
    )
    def test_refuses_another_task(self, runs, change, message):
        with pytest.raises(InputError, match="does not fit") as caught:
            simulate(**settings("ppo").arguments | change, policy=str(runs["ppo"].model))
        assert message in str(caught.value)
        assert "model.safetensors" in str(caught.value)


class TestSettings:
    @pytest.mark.slow
    @pytest.mark.parametrize("name", names("training"))
    def test_our_configurations_are_valid(self, name):
        assert load_training(name).total_steps > 0

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"algorithm": "pppo"}, "unknown algorithm 'pppo': did you mean 'ppo'?"),
            ({"total_step": 5}, "key 'total_step' is not known: did you mean 'total_steps'"),
            ({"total_steps": 0}, "key 'total_steps'"),
            ({"seed": -1}, "key 'seed'"),
            (
                {"hyperparameters": {"gama": 0.9}},
                "[hyperparameters] of ppo is not valid: key 'gama' is not known: did you mean 'gamma'",
            ),
            ({"hyperparameters": {"tau": 0.9}}, "key 'tau' is not known"),
            ({"hyperparameters": {"gamma": 1.5}}, "[hyperparameters] of ppo is not valid: key 'gamma'"),
            ({"hyperparameters": 3}, "[hyperparameters] of ppo must be"),
            ({"evaluation": {"interval": 5}}, "key 'evaluation.interval' is not known"),
            ({"evaluation": {"interval_steps": 5, "speeds_kmh": [-250.0]}}, "key 'evaluation.speeds_kmh.1'"),
            ({"environment": LINE | {"id": "Pantograph-v0", "speed_kmh": 2000}}, "wave speed"),
            ({"environment": {"id": "Pantograf-v0"}}, "did you mean 'Pantograph-v0'?"),
            ({"environment": {}}, "unknown id None"),
            ({"environment": LINE | {"caternary": "x"}}, "did you mean 'catenary'?"),
            ({"environment": LINE | {"catenary": "nowhere"}}, "Unknown catenary 'nowhere'"),
            ({"environment": LINE | {"reward": {"calm": 1.0}}}, "key 'calm'"),
            ({"residual_of": "agent-head"}, "the policy 'agent-head' needs harmonics = "),
            ({"start_from": "fb+fff"}, "did you mean 'fb"),
            ({"start_from": "pd", "residual_of": "pd"}, "start_from and residual_of exclude each other"),
            ({"start_from": "pd", "cloning": {"epoch": 3}}, "key 'cloning.epoch' is not known"),
            ({"washout": {"time_constant": 0.0}}, "key 'washout.time_constant'"),
        ],
    )
    def test_errors_name_the_key(self, change, message):
        with pytest.raises(InputError) as caught:
            settings("ppo", **change)
        assert message in str(caught.value)
        assert str(caught.value).startswith("test: ")
        assert "\n" not in str(caught.value)

    def test_errors_name_the_file(self, tmp_path):
        path = tmp_path / "bad.toml"
        with pytest.raises(InputError, match=r"bad.toml does not exist"):
            load_training(path)
        messages = {"algorithm = ": " is not valid TOML", 'algorithm = "ppo"': ": .*total_steps"}
        for text, said in messages.items():
            path.write_text(text)
            with pytest.raises(InputError, match=rf"bad\.toml{said}"):
                load_training(path)


class TestCommand:
    @pytest.fixture
    def panto(self):
        app = typer.Typer()
        app.command()(command.train)
        app.command()(command.evaluate)

        def run(*arguments):
            return CliRunner().invoke(app, [str(argument) for argument in arguments])

        return run

    @pytest.mark.longer
    def test_train_and_evaluate(self, panto, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        config = tmp_path / "tiny.toml"
        config.write_text(TOML.replace("distance = 80.0", "distance = 120.0, speed_kmh = 290"))
        result = panto("train", config, "--seed", 3, "--steps", 128, "--json")
        assert result.exit_code == 0, result.stderr
        report = json.loads(result.stdout)
        assert report["output"] == "runs/tiny-ppo-seed3"
        assert report["model_steps"] == 128
        assert "σ" in result.stderr  # the evaluation's line beside the bar

        result = panto("evaluate", report["best"], "--plot", "forces.png", "--json")
        assert result.exit_code == 0, result.output
        passes = json.loads(result.stdout)["passes"]
        assert [entry["speed_kmh"] for entry in passes] == [290]
        assert 1 + passes[0]["std_change_percent"] / 100 == pytest.approx(report["best_ratio"])
        assert Path("forces.png").read_bytes().startswith(b"\x89PNG")

        table = panto("evaluate", report["best"], "--speed", 280, "--seeds", 2)
        assert "standard deviation" in table.stdout
        assert "280" in table.stdout
        lines = table.stdout.strip().splitlines()
        assert lines[0] == lines[-1]
        assert lines[0].startswith("mean of all: σ")
        assert not re.search(r"v/c|Doppler|reflection", table.stdout)  # no controller changes them

        refused = panto("train", config, "--seed", 3, "--steps", 128)
        assert isinstance(refused.exception, InputError)
        resumed = panto("train", config, "--seed", 3, "--steps", 256, "--resume")
        assert resumed.exit_code == 0, resumed.output
        assert "final model (step 256)" in resumed.stdout

    def test_evaluate_takes_names(self, panto):
        result = panto("evaluate", "p", "--speed", 250, "--distance", 660, "--json")
        assert result.exit_code == 0, result.output
        (entry,) = json.loads(result.stdout)["passes"]
        own = {name: each for name, each in IDS["Pantograph-v0"].items() if name not in NOT_OF_A_PASS}
        expected = simulate(**own | {"washout": 0}, speed_kmh=250, policy="p", distance=660).summary((10, 11))
        assert entry["spans"] == "10-11"
        assert entry["policy"]["std"] == expected.std
        assert entry["passive"]["effort"] == 0
        unknown = panto("evaluate", "nobody")
        assert isinstance(unknown.exception, InputError)

    @pytest.mark.longer
    def test_a_stored_agent_is_evaluated_as_in_its_training(self, panto):
        result = panto("evaluate", "agent-any-line-five", "--speed", 275, "--distance", 900, "--json")
        assert result.exit_code == 0, result.output
        (entry,) = json.loads(result.stdout)["passes"]
        assert entry["std_change_percent"] < -35


class TestSeeds:
    def test_of_lanes_are_for_training(self):
        for seed, lanes in ((0, 2), (1, 256), (10**9, 65_536)):
            training = settings("ppo", seed=seed, lanes=lanes, hyperparameters={"batch_size": 64 * 8})
            for steps in (0, 10**8):
                seeds = lane_seeds(training, steps)
                assert len(seeds) == lanes
                assert seeds[0] in TRAINING
                assert seeds[-1] in TRAINING
        one, other = (lane_seeds(settings("ppo", seed=seed)) for seed in (0, 1))
        assert not set(one) & set(other)

    def test_lanes_run_under_them(self, tmp_path):
        training = settings("ppo")
        run = learner(training, RunFolder(tmp_path))
        run.model._setup_learn(1)
        native = run.model.get_env().unwrapped.env
        assert native.np_random_seed == tuple(lane_seeds(training))

    def test_of_another_purpose_are_refused(self):
        for seeds, message in {
            range(999, 1001): "Seeds for test are 0 to 999, not 1000",
            range(5, 6): "Seeds for training are 2,000 to 999,999, not 5",
            range(1999, 2001): "Seeds for selection are 1,000 to 1,999",
        }.items():
            with pytest.raises(InputError, match=message):
                check_seeds(seeds, message.split()[2])


LINEAR = """
import numpy as np
class Linear:
    def reset(self, context):
        names = [entry.name for entry in context.layout.entries]
        self.places = [names.index(each) for each in ("sine of span position", "frame velocity")]
    def act(self, seen):
        sine, velocity = seen[self.places]
        return np.array([0.3 * sine - 0.1 * velocity])
"""
SEEING = {"harmonics": 2, "history": 1, "normalise": 300, "reward": "agent", "actuator": "realistic"}


@pytest.fixture
def linear(tmp_path, monkeypatch):
    """An installed policy that is linear in what it sees."""
    points = {"panto_env.policies": {"linear": "linear_law:Linear"}}
    install(tmp_path / "site", points, {"linear_law": LINEAR})
    monkeypatch.syspath_prepend(tmp_path / "site")
    return "linear"


class TestStart:
    @pytest.mark.longer
    @pytest.mark.parametrize("kind", ["ppo", "sac"])
    def test_an_agent_does_what_it_has_cloned(self, kind, linear, tmp_path):
        training = settings(
            kind,
            total_steps=128,
            environment=LINE | SEEING,
            start_from=linear,
            cloning={"steps": 2500, "batch_size": 128, "learning_rate": 3e-3},
            hyperparameters=SMALL[kind] | {"net_arch": [32]},
        )
        folder = train.train(training, tmp_path / "run", progress=False)
        told = json.loads(folder.cloning.read_text())
        assert told["policy"] == linear
        assert told["rms"] > 0.1
        assert told["error"] < 0.1 * told["rms"]
        assert rows(folder)[0]["steps"] == "0"  # what it begins as is judged, and kept if it stays the best
        (taught,) = Comparison(training.arguments, (300.0,), (1000,)).run(linear)
        assert float(rows(folder)[0]["policy_std"]) == pytest.approx(taught.policy.std, rel=0.05)


@pytest.mark.longer
def test_a_residual_with_a_network_of_zeros_is_its_base_bit_for_bit(tmp_path):
    training = settings("ppo", total_steps=128, residual_of="fb+ff", environment=LINE | SEEING)
    added = train.train(training, tmp_path / "added", progress=False)
    facts, actor = read_model(added.model)
    assert facts.residual_of == "fb+ff"
    still = [np.zeros_like(each) for each in (actor.weights[-1], actor.biases[-1])]
    zeros = replace(actor, weights=(*actor.weights[:-1], still[0]), biases=(*actor.biases[:-1], still[1]))
    given = training.arguments | {"distance": 500.0}
    ours, theirs, trained = (
        simulate(**given, policy=policy, seed=3).contact_force
        for policy in (TrainedPolicy(added.model, facts, zeros), "fb+ff", str(added.model))
    )
    np.testing.assert_array_equal(ours, theirs)
    assert not np.array_equal(trained, theirs)


@pytest.mark.longer
def test_a_train_is_evaluated_by_the_controlled_pantograph_that_swings_most():
    train = {"pantographs": ["dsa380"] * 2, "distances": [80.0], "controlled": [1, 2], "accuracy": "fast"}
    (own,) = Comparison(train, (280.0,), (0,)).run("pd")
    active, passive = (simulate(**train, speed_kmh=280.0, policy=policy).train for policy in ("pd", None))
    smaller, larger = sorted(run.summary().std for run in passive)
    assert own.passive.std == larger > smaller
    assert own.policy.std == max(run.summary().std for run in active)
