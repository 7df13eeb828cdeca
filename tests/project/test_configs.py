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


@pytest.mark.longer
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


CASES = {
    "benchmark/permissible",
    "benchmark/long",
    "benchmark/faults",
    "benchmark/margins",
    "benchmark/journey",
}
"""Tracks that ask of the policies that win others what no sound pass shows."""


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES))
def test_tracks_of_cases_have_pd_and_fb_ff_with_a_washout(name):
    assert {"pd:washout=1", "fb+ff:gain=0.3,washout=1"} <= set(
        load_benchmark(FOLDER / f"{name}.toml").policies
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [name for name in names("benchmark") if name.startswith("benchmark/") and name not in CASES] + ["demo"],
)
def test_every_track_has_pd_and_fb_ff_with_a_washout_and_as_papers_have_them(name):
    settings = load_benchmark(FOLDER / f"{name}.toml")
    laws = {"pd"} if settings.sensors.blind else {"pd", "fb+ff"}  # fb+ff needs the place within the span
    assert {form for law in laws for form in (law, f"{law}:washout=1")} <= set(settings.policies)


@pytest.mark.parametrize("page", ["extend", "leaderboard", "policies", "benchmark"])
def test_pages_for_authors_of_policies_name_the_washout(page):
    assert "`washout" in (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
