"""Training, its folder and resume, model files, and trained models as policies."""

from __future__ import annotations

import csv
import json
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from safetensors.numpy import load_file, save_file

from panto_agents import command, train
from panto_agents import command as packages
from panto_agents.cloning import Demonstrations, returns
from panto_agents.evaluation import NOT_OF_A_PASS, Comparison
from panto_agents.lanes import lane_seeds
from panto_agents.model_file import read_model, restore
from panto_agents.policy import TrainedPolicy, load
from panto_agents.run_folder import RunFolder
from panto_agents.settings import Training, load_training, parse_training
from panto_baselines.benchmark.settings import TRAINING, check_seeds
from panto_env import InputError, simulate
from panto_env.base.checksums import write_arrays
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.envs import IDS

from ..plugin import install

CONFIGS = Path(__file__).parents[2] / "configs"
LINE = {"id": "PantographStiffness-v0", "distance": 80.0}  # 96 control steps at 300 km/h
SMALL = {
    "ppo": {"n_steps": 64, "batch_size": 64, "n_epochs": 2, "net_arch": [8]},
    "sac": {"batch_size": 16, "learning_starts": 50, "buffer_size": 1000, "net_arch": [8]},
}


def settings(kind: str, **changes: Any) -> Training:
    table = {
        "algorithm": kind,
        "seed": 1,
        "total_steps": 256,
        "lanes": 2,
        "checkpoint_steps": 128,
        "environment": LINE,
        "evaluation": {"interval_steps": 128},
        "hyperparameters": SMALL[kind],
    }
    return parse_training(table | changes, "test")


@pytest.fixture(scope="session", params=["ppo", "sac"])
def finished(request, tmp_path_factory) -> RunFolder:
    """A tiny finished run; read only."""
    folder = tmp_path_factory.mktemp("runs") / request.param
    return train.train(settings(request.param), folder, progress=False)


@pytest.fixture
def copied(finished, tmp_path) -> RunFolder:
    """The same, to be changed."""
    shutil.copytree(finished.path, tmp_path / finished.path.name)
    return RunFolder(tmp_path / finished.path.name)


def algorithm_of(folder: RunFolder) -> str:
    return folder.path.name


def rows(folder: RunFolder) -> list[dict[str, str]]:
    with folder.evaluations.open(newline="") as file:
        return list(csv.DictReader(file))


def weights(path: Path) -> list[np.ndarray]:
    _, actor = read_model(path)
    return [*actor.weights, *actor.biases]


class TestRun:
    def test_folder(self, finished):
        names = sorted(path.name for path in finished.path.iterdir() if path.name != ".lock")
        assert names == [
            "best.safetensors",
            "checkpoints",
            "evaluations.csv",
            "model.safetensors",
            "settings.json",
            "tensorboard",
        ]
        steps = [read_model(path)[0].steps for path in sorted(finished.checkpoints.iterdir())]
        assert steps == [128, 256]
        assert finished.read_settings() == settings(algorithm_of(finished))
        assert [row["steps"] for row in rows(finished)] == ["128", "256"]
        assert float(rows(finished)[0]["policy_std"]) > 0

    def test_tensorboard_holds_the_figures(self, finished):
        from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

        log = EventAccumulator(str(finished.tensorboard)).Reload()
        for name in ("mean", "std", "cost_function", "contact_loss"):
            assert len(log.Scalars(f"evaluation/{name}_300_kmh")) == 2
            assert len(log.Scalars(f"episode/{name}")) == 1

    def test_best_is_the_best_evaluation(self, finished):
        facts, _ = read_model(finished.best)
        table = rows(finished)
        scores = [
            (row["qualified"] == "True", -float(row["policy_std"]) / float(row["passive_std"]))
            for row in table
        ]
        best = table[scores.index(max(scores))]
        assert str(facts.steps) == best["steps"]
        assert facts.ratio == pytest.approx(-max(scores)[1])

    def test_refuses_to_overwrite(self, copied):
        before = copied.model.read_bytes()
        with pytest.raises(InputError, match=r"exists already.*--resume"):
            train.train(settings(algorithm_of(copied)), copied.path, progress=False)
        assert copied.model.read_bytes() == before

    def test_same_seed_same_weights(self, finished, tmp_path):
        again = train.train(settings(algorithm_of(finished)), tmp_path / "again", progress=False)
        for one, other in zip(weights(finished.model), weights(again.model), strict=True):
            np.testing.assert_array_equal(one, other)
        other = train.train(settings(algorithm_of(finished), seed=2), tmp_path / "b", progress=False)
        assert not np.array_equal(weights(finished.model)[0], weights(other.model)[0])

    def test_nothing_is_left_where_the_environment_is_not_valid(self, tmp_path):
        bad = settings("ppo").model_copy(update={"environment": LINE | {"catenary": "nowhere"}})
        with pytest.raises(InputError, match="nowhere"):
            train.train(bad, tmp_path / "run", progress=False)
        assert not (tmp_path / "run").exists()


class TestResume:
    def test_goes_on_with_the_steps(self, copied):
        longer = settings(algorithm_of(copied), total_steps=512)
        before = weights(copied.model)
        train.train(longer, copied.path, resume=True, progress=False)
        assert read_model(copied.model)[0].steps == 512
        assert [row["steps"] for row in rows(copied)] == ["128", "256", "384", "512"]
        assert not np.array_equal(before[0], weights(copied.model)[0])
        kept = sorted(path.name for path in copied.checkpoints.iterdir())
        assert kept == [f"step-{steps:09d}.safetensors" for steps in (256, 384, 512)]

    def test_restores_networks_optimisers_and_replay(self, finished):
        training = settings(algorithm_of(finished))
        run = train.Run(training, finished, train.make_lanes(training))
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
            assert buffer.pos == 128
            assert not buffer.full
            assert np.abs(buffer.observations[:128]).max(axis=(1, 2)).min() > 0
            np.testing.assert_array_equal(buffer.rewards[:128], saved["replay/rewards"])

    def test_after_an_interruption(self, copied):
        """The newest checkpoint is half-written: the one before it serves."""
        newest = copied.checkpoint(256)
        newest.write_bytes(newest.read_bytes()[:-100])
        copied.model.unlink()
        train.train(settings(algorithm_of(copied)), copied.path, resume=True, progress=False)
        assert read_model(copied.model)[0].steps == 256
        assert [row["steps"] for row in rows(copied)] == ["128", "256"]

    def test_of_a_finished_run_changes_nothing(self, copied):
        before = copied.model.read_bytes()
        train.train(settings(algorithm_of(copied)), copied.path, resume=True, progress=False)
        assert copied.model.read_bytes() == before

    def test_refuses_other_settings(self, copied):
        algorithm = algorithm_of(copied)
        other = settings(algorithm, hyperparameters=SMALL[algorithm] | {"gamma": 0.5})
        with pytest.raises(InputError, match=r"hyperparameters.gamma is 0.5, was 0.97"):
            train.train(other, copied.path, resume=True, progress=False)
        with pytest.raises(InputError, match="not fewer"):
            train.train(settings(algorithm, total_steps=128), copied.path, resume=True, progress=False)
        with pytest.raises(InputError, match="no run to resume"):
            train.train(settings(algorithm), copied.path / "none", resume=True, progress=False)


class TestPolicy:
    def test_acts_as_stable_baselines_does(self, finished):
        training = settings(algorithm_of(finished))
        model = train.Run(training, finished, train.make_lanes(training)).model
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

    def test_is_a_policy_by_its_path(self, finished):
        line = settings(algorithm_of(finished)).arguments
        one, other = (simulate(**line, policy=str(finished.model), seed=seed) for seed in (0, 0))
        np.testing.assert_array_equal(one.contact_force, other.contact_force)
        assert np.abs(one.frame_force).max() > 0
        assert one.policy == str(finished.model)

    def test_takes_part_in_the_benchmark(self, finished):
        from panto_baselines.benchmark.run import run
        from panto_baselines.benchmark.settings import BenchmarkSettings, Line

        line = Line(distance=310.0, speeds_kmh=(300.0,), spans=(3, 5))
        path = str(finished.best)
        outcome = run(BenchmarkSettings(policies=(path,), lines=(line,), seeds=(0,)), workers=1)
        assert [cell.policy for cell in outcome.cells] == ["passive", path]
        assert outcome.cells[1].figures["effort"] > 0

    def test_needs_no_torch(self, finished):
        code = (
            "import sys, panto_env\n"
            f"panto_env.simulate('periodic-stiffness', 'three-mass', policy={str(finished.model)!r})\n"
            "assert not {'torch', 'stable_baselines3'} & set(sys.modules)"
        )
        subprocess.run([sys.executable, "-c", code], check=True)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"observation": "full"}, "observation='measured'"),
            ({"actuator": {"place": "head"}}, "'place': 'frame'"),
            ({"actuator": {"force_limit": 50.0}}, "force_limit to 100"),
            ({"control_interval": 0.02}, "control_interval of 0.01 s"),
        ],
    )
    def test_refuses_another_task(self, finished, change, message):
        line = settings(algorithm_of(finished)).arguments | change
        with pytest.raises(InputError, match="does not fit") as caught:
            simulate(**line, policy=str(finished.model))
        assert message in str(caught.value)
        assert finished.model.name in str(caught.value)

    def test_broken_files(self, copied, tmp_path):
        whole = copied.model.read_bytes()
        damaged = bytearray(whole)
        damaged[-100:-92] = b"\xff" * 8
        for content in (b"", b"no model", whole[: len(whole) // 2], whole[:-30], bytes(damaged)):
            path = tmp_path / "broken.safetensors"
            path.write_bytes(content)
            with pytest.raises(InputError, match=r"broken.safetensors is not a whole model file"):
                load(path)
        other = tmp_path / "other.safetensors"
        save_file({"notes": np.zeros(3)}, other)
        with pytest.raises(InputError, match="it was not written by panto-env"):
            simulate(policy=str(other))
        write_arrays(other, {"format": 9}, {})
        with pytest.raises(InputError, match="its facts are not valid"):
            load(other)
        with pytest.raises(InputError, match=r"none.safetensors does not exist"):
            load(tmp_path / "none.safetensors")


class TestSettings:
    @pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.toml")), ids=lambda path: path.stem)
    def test_our_configurations_are_valid(self, path):
        if "algorithm" not in tomllib.loads(path.read_text()):
            pytest.skip("not a training")
        assert load_training(path).total_steps > 0

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"algorithm": "pppo"}, "unknown algorithm 'pppo': did you mean 'ppo'?"),
            ({"total_step": 5}, "unknown key 'total_step' in the top level: did you mean 'total_steps'?"),
            ({"total_steps": 0}, "key 'total_steps'"),
            ({"total_steps": "many"}, "key 'total_steps'"),
            ({"seed": -1}, "key 'seed'"),
            ({"hyperparameters": {"gama": 0.9}}, "'gama' in [hyperparameters] of ppo: did you mean 'gamma'?"),
            ({"hyperparameters": {"tau": 0.9}}, "unknown key 'tau'"),
            ({"hyperparameters": {"gamma": 1.5}}, "[hyperparameters] is not valid: key 'gamma'"),
            ({"hyperparameters": {"batch_size": 100}}, "must be a multiple of batch_size = 100"),
            ({"hyperparameters": 3}, "[hyperparameters] must be"),
            ({"evaluation": {"interval": 5}}, "unknown key 'interval' in [evaluation]"),
            ({"evaluation": {"interval_steps": 5, "speeds_kmh": [-250.0]}}, "key 'evaluation.speeds_kmh.1'"),
            ({"environment": LINE | {"id": "Pantograph-v0", "speed_kmh": 2000}}, "wave speed"),
            ({"environment": {"id": "Pantograf-v0"}}, "did you mean 'Pantograph-v0'?"),
            ({"environment": {}}, "unknown id None"),
            ({"environment": LINE | {"caternary": "x"}}, "did you mean 'catenary'?"),
            ({"environment": LINE | {"catenary": "nowhere"}}, "Unknown catenary 'nowhere'"),
            ({"environment": LINE | {"reward": {"calm": 1.0}}}, "key 'calm'"),
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
        path.write_text("algorithm = ")
        with pytest.raises(InputError, match=r"bad\.toml is not valid TOML"):
            load_training(path)
        path.write_text('algorithm = "ppo"')
        with pytest.raises(InputError, match=r"bad\.toml: .*total_steps"):
            load_training(path)

    def test_learning_starts_in_time(self):
        with pytest.raises(InputError, match="learning_starts = 300"):
            settings("sac", hyperparameters={"learning_starts": 300})


class TestCommand:
    @pytest.fixture
    def panto(self):
        app = typer.Typer()
        app.command()(command.train)
        app.command()(command.evaluate)

        def run(*arguments):
            return CliRunner().invoke(app, [str(argument) for argument in arguments])

        return run

    @pytest.fixture
    def config(self, tmp_path):
        path = tmp_path / "tiny.toml"
        path.write_text(
            'algorithm = "ppo"\ntotal_steps = 1\nlanes = 2\ncheckpoint_steps = 128\n'
            '[environment]\nid = "PantographStiffness-v0"\ndistance = 120\nspeed_kmh = [250, 300]\n'
            "[evaluation]\ninterval_steps = 128\n"
            "[hyperparameters]\nn_steps = 64\nbatch_size = 64\nn_epochs = 1\nnet_arch = [8]\n"
        )
        return path

    def test_train_and_evaluate(self, panto, config, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        result = panto("train", config, "--seed", 3, "--steps", 128, "--json")
        assert result.exit_code == 0, result.stderr
        report = json.loads(result.stdout)
        assert report["output"] == "runs/tiny-ppo-seed3"
        assert report["model_steps"] == 128
        assert "σ" in result.stderr  # the evaluation's line beside the bar

        result = panto("evaluate", report["best"], "--plot", "forces.png", "--json")
        assert result.exit_code == 0, result.output
        passes = json.loads(result.stdout)["passes"]
        assert [entry["speed_kmh"] for entry in passes] == [250, 275, 300]
        assert np.mean([1 + entry["std_change_percent"] / 100 for entry in passes]) == pytest.approx(
            report["best_ratio"]
        )
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

    @pytest.mark.parametrize("name", ["agent-any-line", "agent-any-line-five"])
    def test_a_stored_agent_is_evaluated_as_in_its_training(self, panto, name):
        result = panto("evaluate", name, "--speed", 275, "--seeds", 1, "--json")
        assert result.exit_code == 0, result.output
        (entry,) = json.loads(result.stdout)["passes"]
        assert entry["std_change_percent"] < -35

    def test_says_what_is_missing(self, panto, config, monkeypatch):
        monkeypatch.setattr(packages, "find_spec", lambda name: None)
        result = panto("train", config)
        assert isinstance(result.exception, InputError)
        assert "panto-env[agents]" in str(result.exception)

    def test_is_imported_without_torch(self):
        code = (
            "import sys, panto_agents.command; assert not {'torch', 'stable_baselines3'} & set(sys.modules)"
        )
        subprocess.run([sys.executable, "-c", code], check=True)


def test_a_run_that_ends_early_does_not_qualify():
    class Down:
        def reset(self, context):
            pass

        def act(self, observation):
            return -np.ones(1)

    line = {"actuator": {"force_limit": 400.0}}
    (pair,) = Comparison(line, (300.0,), range(1)).run(Down())
    assert pair.terminated
    assert not pair.qualified
    assert pair.ratio == np.inf


def test_lanes_are_seeded_one_by_one():
    training = settings("ppo", environment=LINE | {"speed_kmh": [250, 300]})
    lanes = train.make_lanes(training)
    lanes.seed(7)
    lanes.reset()
    env = gymnasium.make("PantographStiffness-v0", distance=120.0, speed_kmh=[250, 300])
    speeds = [env.reset(seed=7 + lane)[1]["speed_kmh"] for lane in range(2)]
    assert [info["speed_kmh"] for info in lanes.unwrapped.reset_infos] == speeds
    lanes.close()


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

    @pytest.mark.parametrize("kind", ["ppo", "sac"])
    def test_lanes_run_under_them(self, kind, tmp_path):
        training = settings(kind)
        run = train.Run(training, RunFolder(tmp_path), train.make_lanes(training))
        run.model._setup_learn(1)
        native = run.model.get_env().unwrapped.env
        assert native.np_random_seed == tuple(lane_seeds(training))

    def test_a_model_is_chosen_by_seeds_for_selection(self, finished):
        assert {row["seed"] for row in rows(finished)} == {"1000"}

    @pytest.mark.parametrize(
        ("seeds", "purpose", "message"),
        [
            (range(999, 1001), "test", "Seeds for test are 0 to 999, not 1000"),
            (range(5, 6), "training", "Seeds for training are 2,000 to 999,999, not 5"),
            (range(1999, 2001), "selection", "Seeds for selection are 1,000 to 1,999"),
        ],
    )
    def test_of_another_purpose_are_refused(self, seeds, purpose, message):
        with pytest.raises(InputError, match=message):
            check_seeds(seeds, purpose)

    def test_more_of_an_evaluation_than_there_are_is_refused(self, tmp_path):
        training = settings("ppo", evaluation={"interval_steps": 128, "seeds": 1001})
        with pytest.raises(InputError, match="Seeds for selection"):
            train.train(training, tmp_path / "run", progress=False)


SEEING = {"harmonics": 2, "history": 1, "normalise": 300, "reward": "agent", "actuator": "realistic"}


@pytest.fixture
def linear(tmp_path, monkeypatch):
    """An installed policy that is linear in what it sees."""
    source = (
        "import numpy as np\n"
        "WANTED = 'sine of span position', 'frame velocity'\n"
        "class Linear:\n"
        "    def reset(self, context):\n"
        "        self.context = context\n"
        "    def act(self, seen):\n"
        "        names = [entry.name for entry in self.context.layout.entries]\n"
        "        sine, velocity = (seen[names.index(each)] for each in WANTED)\n"
        "        return np.array([0.3 * sine - 0.1 * velocity])\n"
    )
    install(
        tmp_path / "site", {"panto_env.policies": {"linear": "linear_law:Linear"}}, {"linear_law": source}
    )
    monkeypatch.syspath_prepend(tmp_path / "site")
    return "linear"


class TestStart:
    @pytest.mark.parametrize("kind", ["ppo", "sac"])
    def test_cloning_comes_near_a_linear_policy(self, kind, linear, tmp_path):
        training = settings(
            kind,
            environment=LINE | SEEING,
            start_from=linear,
            cloning={"steps": 4000, "batch_size": 128, "learning_rate": 3e-3},
            hyperparameters=SMALL[kind] | {"net_arch": [32]},
        )
        folder = train.train(training, tmp_path / "run", progress=False)
        told = json.loads(folder.cloning.read_text())
        assert told["policy"] == linear
        assert told["rms"] > 0.1
        assert told["error"] < 0.1 * told["rms"]
        assert rows(folder)[0]["steps"] == "0"  # what it begins as is judged, and kept if it stays the best

    def test_an_agent_does_what_it_has_cloned(self, linear, tmp_path):
        cloning = {"steps": 10_000, "batch_size": 128}
        training = settings("ppo", environment=LINE | SEEING, start_from=linear, cloning=cloning)
        run = train.Run(training, RunFolder(tmp_path / "run"), train.make_lanes(training))
        run.folder.path.mkdir()
        run.folder.write_settings(training)
        run.begin_with_policy()
        actor = training.hyperparameters.actor(run.model)
        own, theirs = (
            simulate(**training.arguments | {"distance": 500.0}, policy=policy, seed=2)
            for policy in (actor, linear)
        )
        difference = own.frame_force - theirs.frame_force
        assert np.sqrt(np.mean(difference**2)) < 0.15 * np.sqrt(np.mean(theirs.frame_force**2))

    def test_what_the_critic_learns_are_discounted_sums(self):
        rewards = np.array([[1.0, 2.0, 4.0, 8.0, 16.0, 32.0]], dtype=np.float32).T
        terminated, ended = np.zeros((2, 6, 1), dtype=bool)
        terminated[2] = ended[2] = ended[4] = True
        shown = Demonstrations(*[rewards] * 3, rewards, terminated, ended, rewards)
        sums, known = returns(shown, 0.5)
        assert sums[:, 0].tolist() == [1 + 1 + 1, 2 + 2, 4, 8 + 8, 16, 32]
        assert known[:, 0].tolist() == [True, True, True, False, False, False]

    def test_a_policy_that_asks_for_another_observation_is_refused(self, finished):
        with pytest.raises(InputError, match="needs history = 0, but the environment has 2; set it to"):
            settings("ppo", residual_of=str(finished.model), environment=LINE | {"history": 2})
        with pytest.raises(InputError, match="did you mean 'fb"):
            settings("ppo", start_from="fb+fff")
        with pytest.raises(InputError, match="start_from and residual_of exclude each other"):
            settings("ppo", start_from="pd", residual_of="pd")
        with pytest.raises(InputError, match=r"unknown key 'epoch' in \[cloning\]"):
            settings("ppo", start_from="pd", cloning={"epoch": 3})


@pytest.fixture(scope="module")
def added(tmp_path_factory):
    """A finished training of an agent that adds to fb+ff; read only."""
    training = settings("ppo", residual_of="fb+ff", environment=LINE | SEEING)
    return train.train(training, tmp_path_factory.mktemp("runs") / "added", progress=False)


class TestResidual:
    def test_with_a_network_of_zeros_it_is_its_base_bit_for_bit(self, added):
        facts, actor = read_model(added.model)
        assert facts.residual_of == "fb+ff"
        still = [np.zeros_like(each) for each in (actor.weights[-1], actor.biases[-1])]
        zeros = replace(actor, weights=(*actor.weights[:-1], still[0]), biases=(*actor.biases[:-1], still[1]))
        given = settings("ppo", environment=LINE | SEEING).arguments | {"distance": 500.0}
        ours, theirs, trained = (
            simulate(**given, policy=policy, seed=3).contact_force
            for policy in (TrainedPolicy(added.model, facts, zeros), "fb+ff", str(added.model))
        )
        np.testing.assert_array_equal(ours, theirs)
        assert not np.array_equal(trained, theirs)

    def test_lanes_add_as_the_policy_does(self, added):
        """An episode of a training lane under the trained network is the policy's, bit for bit."""
        _, actor = read_model(added.model)
        training = settings("ppo", residual_of="fb+ff", environment=LINE | SEEING, lanes=2)
        lanes, policy = train.make_lanes(training), load(added.model)
        lanes.seed(2000)
        seen = lanes.reset()
        single = gymnasium.make(
            f"panto_env:{LINE['id']}", **{k: v for k, v in (LINE | SEEING).items() if k != "id"}
        )
        observation, _ = single.reset(seed=2001)
        policy.reset(single.unwrapped.context)
        for _ in range(50):
            np.testing.assert_array_equal(seen[1], observation)
            seen, *_ = lanes.step(np.array([actor.act(each) for each in seen]))
            observation, *_ = single.step(policy.act(observation))

    def test_takes_part_in_the_benchmark_and_asks_for_what_it_sees(self, added):
        from panto_baselines.benchmark.run import run
        from panto_baselines.benchmark.settings import BenchmarkSettings, Line

        line = Line(catenary="periodic-stiffness", pantograph="three-mass", speeds_kmh=(300.0,), spans=(3, 5))
        path = str(added.best)
        given = {"policies": (path, f"blind of {path}"), "lines": (line,), "seeds": (0,)}
        outcome = run(BenchmarkSettings(**given, actuator="realistic"), workers=1)
        assert outcome.cells[1].figures["effort"] > 0


def test_a_train_is_evaluated_by_the_controlled_pantograph_that_swings_most():
    train = {"pantographs": ["dsa380"] * 2, "distances": [80.0], "controlled": [1, 2], "accuracy": "fast"}
    (own,) = Comparison(train, (280.0,), (0,)).run("pd")
    active, passive = (simulate(**train, speed_kmh=280.0, policy=policy).train for policy in ("pd", None))
    assert (
        own.passive.std
        == max(run.summary().std for run in passive)
        > min(run.summary().std for run in passive)
    )
    assert own.policy.std == max(run.summary().std for run in active)
