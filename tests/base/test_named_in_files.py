"""A policy that a file names runs no code from a path: the file may be anyone's."""

import json

import pytest

from panto_agents.model_file import read_model
from panto_agents.policy import load
from panto_agents.settings import load_training
from panto_agents.stored import FOLDER
from panto_agents.trainings import RunFolder
from panto_baselines.benchmark.run import run as benchmark
from panto_baselines.benchmark.settings import BenchmarkSettings, load_benchmark
from panto_baselines.benchmark.submission import replay
from panto_baselines.dataset.settings import load_episodes
from panto_env import InputError, policies, simulate
from panto_env.analysis.simulation import check_made_anew, load_with_settings
from panto_env.base.checksums import read_arrays, read_checked, write_arrays, write_checked
from panto_env.base.settings import parse
from panto_env.policies import find_policy

from ..command import panto
from ..plugin import install

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 300.0}
EVIL = """
from pathlib import Path
Path(__file__).with_name("ran").touch()

class Policy:
    def reset(self, context):
        self.actions = context.actions
    def act(self, observation):
        return [0.0] * self.actions
"""
TRAINING = """
algorithm = "ppo"
total_steps = 1000
checkpoint_steps = 100
environment = { id = "PantographStiffness-v0" }
evaluation = { interval_steps = 100 }
"""
LINE = '[[lines]]\ncatenary = "periodic-stiffness"\npantograph = "three-mass"\nspeeds_kmh = [300]\n'
DATASET = """
title = "tiny"
places = [{ catenary = "en50318-2002", pantograph = "en50318-2002", speed_kmh = [290, 300] }]
sets = [{ name = "one", policies = ["POLICY"], episodes = 1 }]
"""
TOML = {
    "a benchmark's policy": (load_benchmark, 'policies = ["POLICY"]\n' + LINE),
    "one of its controls": (load_benchmark, 'policies = ["tape of POLICY"]\n' + LINE),
    "one of its trainings": (load_benchmark, 'trainings = { mine = ["p:gain=0.1", "POLICY"] }\n' + LINE),
    "one of a line": (load_benchmark, LINE + 'policies = ["blind of POLICY"]\n'),
    "a data set's policy": (load_episodes, DATASET),
    "the start of a training": (load_training, 'start_from = "POLICY"\n' + TRAINING),
    "the base of a training": (load_training, 'residual_of = "POLICY"\n' + TRAINING),
}
REFUSED = r"names the policy '.*evil\.py:Policy', but a file may name only installed policies and model files"


@pytest.fixture
def evil(tmp_path):
    """A policy whose file leaves a mark when it runs."""
    path = tmp_path / "evil.py"
    path.write_text(EVIL)
    yield f"{path}:Policy"
    assert not (tmp_path / "ran").exists()


@pytest.fixture
def model(evil, tmp_path):
    """A whole model file that adds its action to that policy's."""
    table, arrays = read_arrays(FOLDER / "head.safetensors")
    path = tmp_path / "model.safetensors"
    write_arrays(path, table | {"residual_of": evil}, arrays)
    assert read_model(path)[0].residual_of == evil  # it is damaged in no way
    return path


def test_a_path_that_a_person_names_runs(tmp_path):
    (tmp_path / "evil.py").write_text(EVIL)
    find_policy(f"{tmp_path}/evil.py:Policy")
    assert (tmp_path / "ran").exists()


def test_the_base_of_a_model_file_and_of_its_base(model, tmp_path):
    table, arrays = read_arrays(model)
    write_arrays(tmp_path / "outer.safetensors", table | {"residual_of": str(model)}, arrays)
    for load_it, path in ((load, model), (find_policy, str(model)), (load, tmp_path / "outer.safetensors")):
        with pytest.raises(InputError, match=rf"model\.safetensors {REFUSED}"):
            load_it(path)


@pytest.mark.slow
def test_no_command_runs_the_base_of_a_model_file(model, tmp_path):
    for given in (
        ("evaluate", model),
        ("benchmark", model, "--seeds", 1, "--speed", 300, "--workers", 1),
        ("film", model, "--output", tmp_path / "film.mp4"),
        ("simulate", "--policy", model),
    ):
        assert "but a file may name only installed policies" in panto(*given).stderr


def test_the_policy_of_a_saved_run(evil, tmp_path):
    pytest.importorskip("cv2", reason="the extra 'render' is not installed")
    saved = tmp_path / "run.parquet"
    simulate(**STIFFNESS, policy=evil).save(saved)
    (tmp_path / "ran").unlink()
    assert f"{saved} names the policy" in panto("film", saved, "--output", tmp_path / "film.mp4").stderr
    run, settings = load_with_settings(saved)
    with pytest.raises(InputError, match=f"cannot be repeated: it {REFUSED}"):
        check_made_anew(run, settings, saved)


@pytest.mark.parametrize("what", TOML)
def test_the_policies_of_a_toml_file(evil, what, tmp_path):
    load_it, text = TOML[what]
    path = tmp_path / "settings.toml"
    path.write_text(text.replace("POLICY", evil))
    with pytest.raises(InputError, match=REFUSED) as caught:
        load_it(path)
    assert str(path) in str(caught.value)
    path.write_text(text.replace("POLICY", "pd:gain=0.3"))
    load_it(path)


def test_the_settings_of_a_training_s_folder(evil, tmp_path):
    path = tmp_path / "usual.toml"
    path.write_text(TRAINING)
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    folder.write_settings(load_training(path))
    write_checked(folder.settings, read_checked(folder.settings) | {"start_from": evil})
    with pytest.raises(InputError, match=REFUSED):
        folder.read_settings()


@pytest.mark.slow
def test_a_result_that_is_played_again_runs_no_policy(evil, tmp_path):
    line = STIFFNESS | {"speeds_kmh": [300], "spans": (2, 4)}
    given = {"policies": ["pd"], "lines": [line], "seeds": 1}
    outcome = benchmark(parse(BenchmarkSettings, given, "the benchmark"), workers=1)
    outcome.save(tmp_path / "result.json")
    table = json.loads(json.dumps(read_checked(tmp_path / "result.json")).replace('"pd"', json.dumps(evil)))
    write_checked(tmp_path / "result.json", table)
    assert {each.row["policy"] for each in replay(tmp_path / "result.json", workers=1).rows} == {
        "passive",
        evil,
    }


@pytest.mark.parametrize(
    "policy", ["EVIL:gain=model.safetensors", "EVIL:x=1", "EVIL", "model.pickled", "evil.py", "a/b.py:X"]
)
def test_no_name_slips_through(evil, policy, tmp_path, monkeypatch):
    """A colon, a suffix behind it, or a loader that somebody installed, which may well unpickle."""
    points = {"panto_env.policy_loaders": {"pickled": "pickled_loader:load"}}
    install(tmp_path / "site", points, {"pickled_loader": "load = None"})
    monkeypatch.syspath_prepend(tmp_path / "site")
    with pytest.raises(InputError, match="but a file may name only installed policies"):
        policies.check_named(policy.replace("EVIL", evil), "it")
    for harmless in ("pd:gain=0.5", "agent-head", "best.safetensors", "nobody"):
        policies.check_named(harmless, "it")
