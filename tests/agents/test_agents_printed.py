"""What an evaluation, an ablation and a training print, of results that are made up, worked out by hand."""

import io
import math
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("stable_baselines3")

from panto_agents import command, train
from panto_agents import command as ablation_command
from panto_agents import train as callbacks
from panto_agents.ablation import Variant, table
from panto_agents.evaluation import Pair
from panto_env.metrics.figures import Figures
from panto_env.terminal import PlainConsole

from .test_ablation import TRAINING

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
    env = SimpleNamespace(unwrapped=SimpleNamespace(seconds=3.2))
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
    assert given["note"].startswith("250 steps/s, 80 % in the environment, reward -3.5, ")
    bar._show()
    assert len(told) == 3, "an evaluation is said once"


@pytest.mark.parametrize(
    ("ratio", "qualified", "words"),
    [
        (0.8, True, "σ -20.0 % of passive"),
        (1.05, False, "σ +5.0 % of passive, F_m out of range: disqualified"),
        (None, False, "a run ended early, F_m out of range: disqualified"),
    ],
)
def test_a_training_says_where_its_models_are_and_how_good(
    ratio, qualified, words, said, monkeypatch, tmp_path
):
    (tmp_path / "it.toml").write_text(TRAINING)
    names = ("path", "tensorboard", "model", "best")
    paths = SimpleNamespace(**{name: Path(name) for name in names})
    facts = dict.fromkeys(command.REPORTED_FACTS) | {"steps": 64}
    facts |= {"ratio": ratio, "qualified": qualified}
    monkeypatch.setattr("panto_agents.train.train", lambda *_, **__: paths)
    monkeypatch.setattr("panto_agents.model_file.read_model", lambda path: (SimpleNamespace(**facts), None))
    command.train(tmp_path / "it.toml", output=tmp_path / "out")
    assert said.getvalue().splitlines() == [
        f"final model (step 64): model: {words}",
        f"best at an evaluation (step 64): best: {words}",
        "panto evaluate best",
    ]


@pytest.mark.parametrize(("ratio", "expected"), [(0.9, 0.9), (None, math.inf)])
def test_a_training_that_goes_on_has_the_verdict_of_its_checkpoint(ratio, expected, monkeypatch, tmp_path):
    monkeypatch.setattr(train, "restore", lambda *_: SimpleNamespace(ratio=ratio, qualified=True))
    seeds, dropped = [], []
    folder = SimpleNamespace(
        newest_checkpoint=lambda: "it",
        best=tmp_path / "none",
        drop_evaluations_after=dropped.append,
    )
    model = SimpleNamespace(num_timesteps=300, set_random_seed=seeds.append)
    fake = SimpleNamespace(folder=folder, model=model, training=SimpleNamespace(seed=7), _seed_lanes=list)
    train.Run.restore(fake)
    assert fake._verdict == (expected, True)
    assert (seeds, dropped) == ([307], [300])


def test_a_policy_is_shown_for_as_many_steps_as_cloning_takes_in_all_lanes_together(monkeypatch):
    shown = []
    monkeypatch.setattr(train, "demonstrate", lambda *given: shown.append(given) or "examples")
    monkeypatch.setattr(train, "PolicyLanes", lambda name, native: name)
    monkeypatch.setattr(train, "lane_seeds", lambda training: range(3))
    cloning = SimpleNamespace(steps=100, noise=0.1)
    learner = SimpleNamespace(begin_with=lambda *_: 0.25)
    training = SimpleNamespace(start_from="pd", cloning=cloning, lanes=8, hyperparameters=learner)
    env = SimpleNamespace(unwrapped=SimpleNamespace(env="native"))
    noted = []
    folder = SimpleNamespace(note_cloning=lambda *given: noted.append(given))
    model = SimpleNamespace(num_timesteps=0, get_env=lambda: env)
    train.Run.begin_with_policy(
        SimpleNamespace(training=training, model=model, folder=folder, _seed_lanes=list)
    )
    assert shown == [("native", "pd", range(3), 13, 0.1)]
    assert noted == [("pd", 0.25)]


def test_runs_of_an_ablation_are_in_a_folder_of_its_name(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    seen = []
    monkeypatch.setattr("panto_agents.ablation.load_ablation", lambda config: None)
    monkeypatch.setattr("panto_agents.ablation.run", lambda *given: seen.append(given) or 1 / 0)
    for output in (None, Path("mine")):
        with pytest.raises(ZeroDivisionError):
            ablation_command.ablation(Path("configs/parts.toml"), output=output)
    assert [given[1] for given in seen] == [Path("runs/parts"), Path("mine")]
    assert (tmp_path / "runs" / "parts").is_dir()


def test_folders_of_an_ablation_are_of_its_variant_and_seed():
    from panto_agents.ablation import _folder

    assert _folder(Path("runs"), "one harmonic", 3) == Path("runs/one-harmonic/seed3")
