"""Trainings and benchmarks that come with the project, by name, from a wheel too."""

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
    gains = [path for path in here if path.parts[0] in ("policies", "oracle", "oracle-any-line")]
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
