"""What each part of an agent is worth: runs of variants, kept, and their comparison."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from typer.testing import CliRunner

from panto_agents.ablation import REFERENCE, _difference, load_ablation, variants
from panto_agents.trainings import RunFolder
from panto_configs import names
from panto_env import InputError
from panto_env.cli import make_app

from .test_agents import TOML

BENCHMARK = """
lines = [{ catenary = "periodic-stiffness", pantograph = "three-mass", speeds_kmh = [300], spans = [3, 5] }]
"""


@pytest.fixture
def config(tmp_path) -> Path:
    (tmp_path / "training.toml").write_text(TOML)
    (tmp_path / "judge.toml").write_text(BENCHMARK)
    path = tmp_path / "parts.toml"
    path.write_text(f"""
training = "{tmp_path}/training.toml"
total_steps = 128
seeds = [3, 4]
judged_by = "{tmp_path}/judge.toml"
judged_on = 1
[variants."one harmonic".environment]
harmonics = "default"
""")
    return path


@pytest.mark.slow
def test_ours_is_valid():
    assert "ablation" in names("ablation")
    trainings = load_ablation("ablation").trainings()
    seeds = {seed for _, seed in trainings}
    assert len(seeds) >= 5
    whole = trainings[REFERENCE, 0]
    assert whole.environment["normalise"] == [200, 350]
    assert "normalise" not in trainings["readings as they are", 0].environment
    assert whole.washout is not None
    assert trainings["no washout", 0].washout is None
    for (name, seed), training in trainings.items():
        assert training.seed == seed
        assert (training == whole) == ((name, seed) == (REFERENCE, 0))


@pytest.mark.slow
def test_runs_are_kept_and_compared(config, tmp_path, monkeypatch):
    arguments = ["ablation", str(config), "--output", str(tmp_path / "runs"), "--workers", "1", "--json"]
    result = CliRunner().invoke(make_app(), arguments)
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)["variants"]
    assert [each["name"] for each in told] == [REFERENCE, "one harmonic"]
    assert told[0]["lost"] is None
    assert len(told[1]["changes"]) == 2
    assert told[1]["changes"][0] != told[1]["changes"][1] != told[0]["changes"][1]
    folder = RunFolder(tmp_path / "runs" / "one-harmonic" / "seed4")
    assert folder.read_settings().environment == {"id": "PantographStiffness-v0", "distance": 80.0}
    before = folder.model.stat().st_mtime_ns
    RunFolder(folder.path.parent / "seed3").model.unlink()  # as if it had been broken off
    again = CliRunner().invoke(make_app(), arguments)
    assert json.loads(again.stdout)["variants"] == told
    table = CliRunner().invoke(make_app(), arguments[:-1]).stdout
    assert "loses" in table
    assert "harmonic" in table
    assert folder.model.stat().st_mtime_ns == before


def test_figures_of_variants():
    def cell(policy, change, disqualified=""):
        return SimpleNamespace(policy=policy, change=change, disqualified=disqualified)

    cells = [cell(f"a{seed}", change) for seed in range(3) for change in (-20.0 - seed, -30.0 - seed)]
    cells += [cell(f"b{seed}", -20.0, "moves" if seed == 0 else "") for seed in range(3)]
    names = {REFERENCE: "a", "less": "b"}
    models = {(name, seed): Path(f"{path}{seed}") for name, path in names.items() for seed in range(3)}
    whole, less = variants(models, SimpleNamespace(cells=cells))
    assert whole.changes == (-25.0, -26.0, -27.0)
    assert whole.change == -26.0
    assert less.worse == 1.0
    assert less.qualified == pytest.approx(2 / 3)
    low, high = less.lost
    assert 5.0 <= low < 6.0 < high <= 7.0


def test_the_interval_of_a_difference_is_that_of_its_normal_law():
    random = np.random.default_rng(1)
    one, other = random.normal(1.0, 1.0, 400), random.normal(0.0, 2.0, 400)
    low, high = _difference(one, other)
    error = np.sqrt(one.var() / 400 + other.var() / 400)
    assert (high - low) / 2 == pytest.approx(1.96 * error, rel=0.05)
    assert (high + low) / 2 == pytest.approx(one.mean() - other.mean(), abs=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ('harmonics = "default"', None),
        ("harmonic = 2", "The variant 'one harmonic': .*unknown key 'harmonic'"),
        ("harmonics = -1", "The variant 'one harmonic'"),
        ("harmonics = { of = 2 }", "The variant 'one harmonic'"),
    ],
)
def test_what_is_wrong_is_said_of_the_variant(config, change, message):
    config.write_text(config.read_text().replace('harmonics = "default"', change))
    if message is None:
        trainings = load_ablation(config).trainings()
        assert list(trainings) == [(name, seed) for name in (REFERENCE, "one harmonic") for seed in (3, 4)]
        assert [each.seed for each in trainings.values()] == [3, 4, 3, 4]
        assert "harmonics" in trainings[REFERENCE, 3].environment
        assert "harmonics" not in trainings["one harmonic", 3].environment
        return
    with pytest.raises(InputError, match=message):
        load_ablation(config)


def test_an_unknown_one_and_one_seed_are_refused(config):
    with pytest.raises(InputError, match="The ablation file nothing does not exist"):
        load_ablation("nothing")
    config.write_text(config.read_text().replace("seeds = [3, 4]", "seeds = [5]"))
    with pytest.raises(InputError, match=r"key 'seeds' must hold at least 2 values \(given: \[5\]\)"):
        load_ablation(config)
