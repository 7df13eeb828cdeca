"""What the examples learn from data alone, small here, and the table of several trainings' evaluations."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("minari")
pytest.importorskip("tensorboard")

from torch.utils.tensorboard import SummaryWriter

from panto_baselines.dataset.designs import load_designs
from panto_baselines.dataset.make import make_designs, make_episodes
from panto_baselines.dataset.settings import chosen, load_episodes

from .learning_curve import FIRST, RATIO, printed, table

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def _minari_s_folder_is_put_back(monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", "")


@pytest.mark.slow
def test_offline_data_are_read_back_and_replayed(capsys):
    returns, same = load("offline_data").main()
    assert same
    assert len(returns) == 2
    assert max(returns) < 0
    printed = capsys.readouterr().out.splitlines()
    assert [line in load("offline_data").__doc__ for line in printed] == [True, True]


@pytest.mark.slow
def test_a_controller_is_cloned_from_a_few_episodes_at_one_speed(tmp_path):
    pytest.importorskip("torch")
    example = load("learn_from_data")
    settings = chosen(load_episodes("dataset-known-line"), ("fitted-fb-ff-noisy",))
    few = settings.sets[0].model_copy(update={"episodes": 8})
    at_300 = settings.places[0].model_copy(update={"speed_kmh": (300.0, 300.0)})
    make_episodes(
        settings.model_copy(update={"sets": (few,), "places": (at_300,)}), tmp_path / "data", workers=1
    )
    error = example.clone(tmp_path / "data", tmp_path / "clone.npz", epochs=20)
    assert error < 0.25
    ((own, teacher, reason),) = example.judge(tmp_path / "clone.npz", (300.0,), seeds=2, workers=1).values()
    assert reason == ""
    assert teacher < -15
    assert own / teacher > 0.9


@pytest.mark.study
def test_from_the_whole_data_a_clone_does_what_its_teacher_does_and_sigma_is_known_to_some_percent(tmp_path):
    """Half an hour on two cores: the numbers of docs/datasets.md."""
    pytest.importorskip("torch")
    pytest.importorskip("sklearn")
    example = load("learn_from_data")
    make_episodes(chosen(load_episodes("dataset-known-line"), ("fitted-fb-ff-noisy",)), tmp_path)
    example.clone(tmp_path, tmp_path / "clone.npz")
    for own, teacher, reason in example.judge(tmp_path / "clone.npz").values():
        assert reason == ""
        assert own / teacher > 0.9
    made = make_designs(load_designs("dataset-designs"), tmp_path)
    scores = example.surrogate(made.folder / "designs.parquet")
    (r2, error), (yardstick, _) = scores["trees"], scores["linear"]
    assert r2 > 0.93 > 0.9 > yardstick
    assert error < 6


def log(folder, ratios, began):
    with SummaryWriter(folder) as writer:
        writer.add_scalar(FIRST, 1.0, 0, walltime=began)
        for number, ratio in enumerate(ratios, start=1):
            writer.add_scalar(RATIO, ratio, number * 10_000_000, walltime=began + number * 1800)
    return folder


def test_median_and_range_of_three_trainings_and_their_time(tmp_path):
    logs = [
        log(tmp_path / f"{k}", ratios, 1e9 + k)
        for k, ratios in enumerate([(0.5, 0.45), (0.52, 0.40), (0.6, 0.41)])
    ]
    assert printed(table(logs)).splitlines()[2:] == [
        "| 10 | -48.0 | -50.0 | -40.0 | 0.50 |",
        "| 20 | -59.0 | -60.0 | -55.0 | 1.00 |",
    ]


def test_trainings_with_different_numbers_of_evaluations_are_refused(tmp_path):
    logs = [log(tmp_path / "a", [0.5], 1e9), log(tmp_path / "b", [0.5, 0.4], 1e9)]
    with pytest.raises(ValueError, match="longer than argument 1"):
        table(logs)
