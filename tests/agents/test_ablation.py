"""What each part of an agent is worth: runs of variants, kept, and their comparison."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from typer.testing import CliRunner

from panto_agents.ablation import REFERENCE, _difference, load_ablation, variants
from panto_agents.trainings import RunFolder
from panto_configs import find, names
from panto_env import InputError
from panto_env.cli import make_app

TRAINING = """
algorithm = "ppo"
total_steps = 512
lanes = 2
checkpoint_steps = 128
environment = { id = "PantographStiffness-v0", distance = 80.0, harmonics = 3 }
evaluation = { interval_steps = 128 }
hyperparameters = { n_steps = 64, batch_size = 64, n_epochs = 1, net_arch = [8] }
"""
BENCHMARK = """
lines = [{ catenary = "periodic-stiffness", pantograph = "three-mass", speeds_kmh = [300], spans = [3, 5] }]
"""


@pytest.fixture
def config(tmp_path) -> Path:
    (tmp_path / "training.toml").write_text(TRAINING)
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
    class Cell:
        def __init__(self, policy, change, disqualified=""):
            self.policy, self.change, self.disqualified = policy, change, disqualified

    class Outcome:
        cells = (
            *(Cell(f"a{seed}", change) for seed in range(3) for change in (-20.0 - seed, -30.0 - seed)),
            *(Cell(f"b{seed}", -20.0, "moves" if seed == 0 else "") for seed in range(3)),
        )

    models = {(REFERENCE, seed): Path(f"a{seed}") for seed in range(3)}
    models |= {("less", seed): Path(f"b{seed}") for seed in range(3)}
    whole, less = variants(models, Outcome)
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
        load_ablation(config)
        return
    with pytest.raises(InputError, match=message):
        load_ablation(config)


def test_an_unknown_one_is_refused():
    with pytest.raises(InputError, match="The ablation file nothing does not exist"):
        find("nothing", "ablation")


def test_one_seed_is_too_few(config):
    """The list is not empty, as the sentence had said."""
    config.write_text(re.sub(r"^seeds = .*$", "seeds = [5]", config.read_text(), flags=re.MULTILINE))
    with pytest.raises(InputError, match=r"key 'seeds' must hold at least 2 values \(given: \[5\]\)"):
        load_ablation(config)
