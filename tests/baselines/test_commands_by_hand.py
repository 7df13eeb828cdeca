"""What commands hand on, with the work itself replaced; and the steps by which gains are fitted."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import pytest

from panto_baselines.benchmark import command
from panto_baselines.benchmark.settings import BenchmarkSettings, load_benchmark

from ..command import panto
from .commands import called

CONFIG = """
policies = ["p"]
seeds = 3
[trainings]
sac = ["one.safetensors", "two.safetensors"]
[[lines]]
catenary = "re250"
pantograph = "dsa250"
speeds_kmh = [200.0]
[[lines]]
catenary = "en50318-2002"
pantograph = "en50318-2002"
speeds_kmh = [250.0, 300.0]
"""


class EnoughError(Exception):
    """The work would begin."""


@pytest.fixture
def handed(monkeypatch, tmp_path):
    """The settings with which the command would run, from its words; CONFIG is its file."""
    path, run = tmp_path / "mine.toml", mock.Mock(side_effect=EnoughError)
    path.write_text(CONFIG)
    monkeypatch.setattr(command, "run", run)

    def of(*words, config=True):
        done = called(command.benchmark, *words, *(("--config", path) if config else ()))
        assert isinstance(done.exception, EnoughError), done.output
        settings, workers, _, ray = run.call_args.args
        return SimpleNamespace(settings=settings, workers=workers, ray=ray)

    return of


def lines(settings):
    return [(each.catenary, each.pantograph, tuple(each.speeds_kmh)) for each in settings.lines]


@pytest.mark.longer
def test_without_options_the_benchmark_is_that_of_its_file_or_the_usual_one(handed, tmp_path):
    found = handed()
    assert found.settings == load_benchmark(tmp_path / "mine.toml")
    assert found.settings.trainings == {"sac": ("one.safetensors", "two.safetensors")}
    assert (found.workers, found.ray) == (None, None)
    assert handed(config=False).settings == BenchmarkSettings()


@pytest.mark.longer
def test_policies_on_the_command_line_replace_the_file_s_and_its_trainings(handed):
    settings = handed("pd", "p:gain=0.5").settings
    assert (settings.policies, settings.trainings) == (("passive", "pd", "p:gain=0.5"), {})
    assert (settings.seeds, lines(settings)) == ((0, 1, 2), lines(handed().settings))


@pytest.mark.longer
def test_a_line_on_the_command_line_replaces_all_and_a_speed_holds_on_each(handed):
    before = handed().settings
    settings = handed("--speed", "210", "--speed", "220").settings
    assert lines(settings) == [(c, p, (210.0, 220.0)) for c, p, _ in lines(before)]
    settings = handed("--catenary", "re330", "--speed", "280").settings
    assert len(settings.lines) == 1
    assert settings.lines[0].catenary != before.lines[0].catenary
    assert settings.lines[0].speeds_kmh == (280.0,)
    assert settings.policies == ("passive", "p")


@pytest.mark.longer
def test_other_options_replace_one_setting_each(handed):
    found = handed("--seeds", "5", "--trusted", "--workers", "2", "--salt", "mine")
    assert (found.settings.seeds, found.settings.trusted, found.workers) == ((0, 1, 2, 3, 4), True, 2)
    assert found.settings.salt == "mine"
    drawn = [handed("--salt", "draw").settings.salt for _ in range(2)]
    assert drawn[0] != drawn[1]
    assert all(len(salt) == 32 and int(salt, 16) >= 0 for salt in drawn)
    assert handed("--control-interval", "0.02").settings.control_interval == 0.02


@dataclass
class Made:
    """What is made of a data set, with its folder as a property as in the original."""

    dataset_id: str = "pantograph/it-v0"
    episodes: int = 1200
    steps: int = 34567
    megabytes: float = 1.26
    designs: int = 2048
    refused: int = 3
    ended_early: int = 1004
    warned: int = 5

    @property
    def folder(self):
        return Path("data") / "it"


@pytest.mark.longer
def test_what_was_made_of_data_is_printed_or_given_as_json(monkeypatch, tmp_path):
    episodes, designs = mock.Mock(return_value=[Made()]), mock.Mock(return_value=Made())
    monkeypatch.setattr("panto_baselines.dataset.make.make_episodes", episodes)
    monkeypatch.setattr("panto_baselines.dataset.make.make_designs", designs)
    output = tmp_path / "data"
    words = ("--output", output, "--workers", 3)
    shown = panto("dataset", "episodes", "dataset-known-line", *words, "--episodes", 2)
    assert shown.returncode == 0, shown.stderr
    unwrapped = shown.stdout.replace("\n", "")
    assert all(word in unwrapped for word in ("pantograph/it-v0", "1,200", "34,567", "1.3", str(output)))
    told = json.loads(panto("dataset", "episodes", "dataset-known-line", *words, "--json").stdout)
    assert told == [asdict(Made()) | {"folder": str(Path("data") / "it")}]
    (fewer, _), (usual, _) = (each.args for each in episodes.call_args_list)
    assert [episodes.call_args.kwargs[name] for name in ("workers", "ray")] == [3, None]
    assert {each.episodes for each in fewer.sets} == {2}
    assert [each.model_copy(update={"episodes": 2}) for each in usual.sets] == list(fewer.sets)
    shown = panto("dataset", "designs", *words, "--count", 4)
    assert all(word in shown.stdout for word in ("2,048", "3", "1,004", "5", "1.3"))
    told = json.loads(panto("dataset", "designs", *words, "--json").stdout)
    assert told == asdict(Made()) | {"folder": str(Path("data") / "it")}
    few, usual = (each.args[0].count for each in designs.call_args_list)
    assert few == 4 != usual
