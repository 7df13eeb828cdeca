"""The table of several trainings' evaluations, from logs written here."""

from __future__ import annotations

import pytest
from torch.utils.tensorboard import SummaryWriter

from .learning_curve import FIRST, RATIO, printed, table


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
