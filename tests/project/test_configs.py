"""Trainings and benchmarks that come with the project, by name, from a wheel too."""

import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from panto_agents.settings import load_training
from panto_baselines.benchmark.settings import load_benchmark
from panto_configs import FOLDER, find, names
from panto_env import InputError

ROOT = Path(__file__).parents[2]


def test_every_file_has_a_name_and_one_kind():
    others = [*names("ablation"), *names("dataset"), *names("designs")]
    kinds = names("training"), [*names("benchmark"), *others]
    here = [path.relative_to(FOLDER).with_suffix("") for path in FOLDER.rglob("*.toml")]
    gains = [path for path in here if path.parts[0] in ("policies", "oracle")]
    assert sorted(kinds[0] + kinds[1]) == sorted(path.as_posix() for path in here if path not in gains)
    assert len(gains) >= 6
    assert {"ppo", "sac"} <= set(kinds[0])
    assert {"benchmark", "benchmark-realistic", "benchmark/known-line"} <= set(kinds[1])


def test_commands_take_names_and_paths(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_training("ppo") == load_training(ROOT / "configs" / "ppo.toml")
    assert load_benchmark("benchmark-realistic") == load_benchmark(FOLDER / "benchmark-realistic.toml")
    mine = tmp_path / "mine.toml"
    mine.write_text((FOLDER / "sac.toml").read_text())
    assert find("mine.toml", "training") == Path("mine.toml")


def test_unknown_names_are_refused_with_those_that_are_known():
    with pytest.raises(InputError, match=r"training file pp0 .* did you mean 'ppo'\? known are agent-"):
        load_training("pp0")
    with pytest.raises(InputError, match=r"benchmark file ppo does not exist; .* known are benchmark, "):
        load_benchmark("ppo")


def test_wheel_carries_every_module_and_every_toml_file(tmp_path):
    pytest.importorskip("setuptools", minversion="77")
    project, out = tmp_path / "project", tmp_path / "out"
    folders = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"]
    for folder in folders.values():
        shutil.copytree(ROOT / folder, project / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, project)
    code = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, out], cwd=project, check=True, capture_output=True)
    (wheel,) = out.glob("*.whl")
    unpacked = tmp_path / "unpacked"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(unpacked)
    for package, folder in folders.items():
        wanted = {path.relative_to(ROOT / folder) for path in (ROOT / folder).rglob("*.py")}
        wanted |= {path.relative_to(ROOT / folder) for path in (ROOT / folder).rglob("*.toml")}
        wanted |= {path.relative_to(ROOT / folder) for path in (ROOT / folder).glob("report/templates/*.*")}
        found = {path.relative_to(unpacked / package) for path in (unpacked / package).rglob("*.*")}
        assert wanted - found == set(), package
    code = (
        "import panto_configs; from panto_baselines.benchmark.settings import load_benchmark;"
        "print(panto_configs.__file__, load_benchmark('benchmark').seeds)"
    )
    environment = os.environ | {"PYTHONPATH": str(unpacked)}
    told = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=out, check=True, capture_output=True, text=True
    )
    assert told.stdout.startswith(str(unpacked))
