"""Trainings that are killed at any moment and resumed: nothing is lost, and nothing is there twice."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from panto_agents import train
from panto_agents.model_file import read_model
from panto_agents.settings import Training
from panto_agents.trainings import RunFolder, plan, train_all
from panto_env import InputError
from panto_env.base.files import alone_in

from ..agents.test_agents import rows, weights
from ..agents.test_agents import settings as small
from ..deadly import deadly
from ..plugin import on_path

CONFIG = """
algorithm = "ppo"
total_steps = 768
lanes = 2
checkpoint_steps = 128
{more}
[environment]
id = "PantographStiffness-v0"
distance = 80
[evaluation]
interval_steps = 128
[hyperparameters]
n_steps = 64
batch_size = 64
n_epochs = 1
net_arch = [8]
"""


def settings(**changes) -> Training:
    cloning = {"steps": 256, "batch_size": 64, "epochs": 1}
    return small("ppo", **{"total_steps": 512, "cloning": cloning} | changes)


def steps_evaluated(folder: Path) -> list[int]:
    return [int(row["steps"]) for row in rows(RunFolder(folder))]


def panto(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from panto_env.cli import main; main()", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True)


def same_weights(one: Path, other: Path) -> bool:
    return all(map(np.array_equal, weights(one), weights(other)))


@pytest.mark.slow
def test_a_training_killed_between_two_checkpoints_loses_only_what_came_after_the_first(
    tmp_path, monkeypatch
):
    folder = tmp_path / "run"
    deadly(tmp_path, wanted=folder / "checkpoints" / "step-000000256.safetensors")
    on_path(tmp_path, monkeypatch)
    (tmp_path / "tiny.toml").write_text(CONFIG.format(more='residual_of = "deadly"'))
    command = ("train", "tiny.toml", "--output", folder)
    killed = panto(*command, cwd=tmp_path)
    assert killed.returncode == -signal.SIGKILL
    assert (tmp_path / "deadly.dead").exists()
    assert not (folder / "model.safetensors").exists()
    newest = RunFolder(folder).newest_checkpoint()
    assert newest is not None
    assert newest.name == "step-000000256.safetensors"
    assert panto(*command, cwd=tmp_path).returncode == 2  # it is not trained over
    resumed = panto(*command, "--resume", cwd=tmp_path)
    assert resumed.returncode == 0, resumed.stderr
    assert read_model(folder / "model.safetensors")[0].steps == 768
    assert steps_evaluated(folder) == [128 * k for k in range(7)]


@pytest.mark.slow
@pytest.mark.parametrize("start", [{"start_from": "p"}, {"residual_of": "p"}, {}])
def test_a_training_killed_before_its_first_checkpoint_ends_as_if_it_had_not_been(start, tmp_path):
    training = settings(**start)
    whole = train.train(training, tmp_path / "whole", progress=False)
    killed = train.train(training, tmp_path / "killed", progress=False)
    for path in killed.checkpoints.iterdir():
        path.unlink()
    killed.model.unlink()
    resumed = train.train(training, killed.path, resume=True, progress=False)
    assert same_weights(resumed.model, whole.model)
    assert resumed.evaluations.read_text() == whole.evaluations.read_text()
    assert steps_evaluated(resumed.path) == [128 * k for k in range(not start, 5)]


def test_a_training_killed_while_its_folder_was_made_begins_anew(tmp_path):
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    (folder.path / ".settings-abc.json").write_text("{")
    train.train(settings(total_steps=128), folder.path, progress=False)
    assert read_model(folder.model)[0].steps == 128


def test_a_run_that_another_process_still_trains_is_left_alone(tmp_path):
    folder = train.train(settings(total_steps=128), tmp_path / "run", progress=False)
    before = folder.model.read_bytes(), folder.settings.read_text()
    with alone_in(folder.path, "trains into"), pytest.raises(InputError, match="Another process trains into"):
        train.train(settings(), folder.path, resume=True, progress=False)
    assert (folder.model.read_bytes(), folder.settings.read_text()) == before
    train.train(settings(total_steps=256), folder.path, resume=True, progress=False)
    assert steps_evaluated(folder.path) == [128, 256]


class TestTrainings:
    @pytest.mark.slow
    def test_what_one_killed_training_leaves_goes_on_and_the_others_begin(self, tmp_path):
        one, other = (settings(seed=seed, total_steps=128) for seed in (1, 2))
        planned = {tmp_path / "one": one, tmp_path / "other": other}
        train.train(one, tmp_path / "one", progress=False)
        before = (tmp_path / "one" / "model.safetensors").read_bytes()
        with pytest.raises(InputError, match="exists already"):
            train_all(planned, workers=1)
        assert not (tmp_path / "other").exists()
        outcomes = train_all(planned, resume=True, workers=1)
        assert (tmp_path / "one" / "model.safetensors").read_bytes() == before
        assert [outcome["seed"] for outcome in outcomes] == [1, 2]
        alone = train.train(other, tmp_path / "alone", progress=False)
        assert same_weights(alone.model, tmp_path / "other" / "model.safetensors")
        assert outcomes[1]["ratio"] == read_model(alone.best)[0].ratio

    def test_configurations_times_seeds(self, tmp_path):
        for name in ("one", "other"):
            (tmp_path / f"{name}.toml").write_text(CONFIG.format(more="seed = 5"))
        configs = [tmp_path / "one.toml", tmp_path / "other.toml"]
        planned = plan(configs, [0, 1], 128, Path("runs"))
        names = [f"runs/{name}-ppo-seed{seed}" for name in ("one", "other") for seed in (0, 1)]
        assert [str(path) for path in planned] == names
        assert {training.total_steps for training in planned.values()} == {128}
        assert [training.seed for training in plan(configs, None, None, Path("runs")).values()] == [5, 5]
        with pytest.raises(InputError, match="Two of the trainings would go into runs/one-ppo-seed3"):
            plan(configs, [3, 3], None, Path("runs"))
