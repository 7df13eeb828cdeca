"""What an evaluation, an ablation and a training print, of results that are made up, worked out by hand."""

import io
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("stable_baselines3")

from panto_agents import callbacks, command
from panto_agents.ablation_table import Variant, table
from panto_agents.evaluation import Pair
from panto_env.metrics.figures import Figures
from panto_env.terminal import PlainConsole

FIGURES = Figures(*(float(k) for k in range(1, 1 + len(fields(Figures)))))
HALVED = replace(FIGURES, mean=1.01, std=1.0, max_uplift=0.0525, contact_loss=0.0)
PAIR = Pair(250.0, 0, "10-19", HALVED, FIGURES, (), (), 120.0, "", "")
MOVED = replace(PAIR, seed=1, policy=replace(HALVED, mean=2.0, std=1.5))
EARLY = replace(PAIR, speed_kmh=300.0, policy=Figures.none(), spans="", ending="It ended.")
EARLY_BOTH = replace(EARLY, seed=1, passive=Figures.none(), passive_ending="It ended.")


@pytest.fixture
def said(monkeypatch):
    said = io.StringIO()
    monkeypatch.setattr(command, "console", PlainConsole(file=said, width=120))
    return said


def cells(text):
    """The cells of a printed table, row by row."""
    return [[cell.strip() for cell in line.split("│")[1:-1]] for line in text.splitlines() if "│" in line]


def test_an_evaluation_has_the_means_of_its_seeds_and_says_what_does_not_count(said):
    command._print_pairs([PAIR, MOVED, EARLY, EARLY_BOTH])
    assert "spans 10-19" in said.getvalue()
    rows = cells(said.getvalue())
    assert [row[0] for row in rows if row[0]] == ["250", "300"]
    first, second = rows[: rows.index(rows[-1]) // 2], rows[len(rows) // 2 :]
    by_figure = {row[1]: row[2:] for row in first}
    assert by_figure["mean force F_m (N)"] == ["1.5", "1.0", "+50.5 %"]
    assert by_figure["standard deviation σ (N)"] == ["1.2", "2.0", "-37.5 %"]
    assert by_figure["contact loss CL (%)"] == ["0.0", "8.0", "-100.0 %"]
    assert {tuple(row[2:]) for row in second[:-1]} == {("–", "–", "")}
    assert rows[0][0] == "250"
    assert "of 2 passes, 1 with F_m out of range" in {row[1] for row in rows}
    assert "of 2 passes, 2 ended early, 1 without a policy did" in {row[1] for row in rows}


def test_an_ablation_s_table_has_intervals_and_dashes():
    whole = Variant("as it is", (-25.0, -27.0), -26.04, (-27.5, -24.2), None, None, 1.0)
    less = Variant("less", (-20.0,), -20.06, None, (5.04, 7.5), 0.98, 2 / 3)
    made = table([whole, less], "a title")
    assert made.rows == [
        ("as it is", "2", "-26.0", "-27.5 to -24.2", "–", "–", "100 %"),
        ("less", "1", "-20.1", "–", "5.0 to 7.5", "98 %", "67 %"),
    ]
    assert made.title == "a title"


def test_a_training_shows_its_speed_and_what_the_environment_takes_of_it(monkeypatch):
    clock, told = [100.0], []
    monkeypatch.setattr(callbacks, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    bar = callbacks.ProgressBar(4000, lambda: [PAIR])
    env = SimpleNamespace(unwrapped=SimpleNamespace(seconds=1.0))
    rewards = [{"r": value} for value in (-3.0, -4.0)]
    bar.model = SimpleNamespace(get_env=lambda: env, ep_info_buffer=rewards)
    shown = SimpleNamespace(print=told.append)
    bar._progress = SimpleNamespace(update=lambda task, **given: told.append(given), console=shown)
    bar.num_timesteps = 500
    bar._on_training_start()
    clock[0], bar.num_timesteps = 104.0, 1500
    bar._show()
    words, given = told
    assert words.startswith("step 1500: ")
    assert given["completed"] == 1500
    assert given["note"].startswith("250 steps/s, 25 % in the environment, reward -3.5, ")
    bar._show()
    assert len(told) == 3, "an evaluation is said once"


def test_folders_of_an_ablation_are_of_its_variant_and_seed():
    from panto_agents.ablation import _folder

    assert _folder(Path("runs"), "one harmonic", 3) == Path("runs/one-harmonic/seed3")
