"""Parts of trainings, evaluations and models, and what is printed of them, each value worked out by hand."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3")


import io
import math
from contextlib import nullcontext
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from panto_agents import command, train
from panto_agents.ablation import Variant, table
from panto_agents.algorithm import MOST_KEPT, PPO, SAC
from panto_agents.cloning import Demonstrations, demonstrate, returns
from panto_agents.evaluation import Pair, in_words, pair, verdict
from panto_agents.model_file import actor_of
from panto_agents.policy import SETTINGS, _first_difference
from panto_agents.settings import arguments, speeds
from panto_agents.trainings import RunFolder
from panto_env import InputError, simulate
from panto_env.envs import IDS
from panto_env.metrics.figures import Figures
from panto_env.terminal import PlainConsole

from .test_agents import TOML

FIGURES = Figures(*(float(k) for k in range(1, 1 + len(fields(Figures)))))
PAIR = Pair(250.0, 0, "10-19", replace(FIGURES, mean=1.01, std=1.0), FIGURES, (), (), 120.0, "", "")


def test_a_learning_rate_goes_from_its_first_value_to_its_last_by_the_last_step():
    schedule = PPO(learning_rate=(1e-3, 2e-4)).learning_rate_schedule()
    for left, rate in ((1.0, 1e-3), (0.75, 8e-4), (0.5, 6e-4), (0.25, 4e-4), (0.0, 2e-4)):
        assert schedule(left) == pytest.approx(rate)
    assert SAC(learning_rate=5e-4).learning_rate_schedule() == 5e-4


@pytest.mark.parametrize(
    ("kind", "given", "training", "message"),
    [
        (PPO, (128, 256), {"lanes": 2}, None),
        (PPO, (2, 2), {"lanes": 1}, None),
        (PPO, (1, 1), {"lanes": 1}, "must be a multiple of batch_size = 1, and more than 1"),
        (PPO, (128, 512), {"lanes": 2}, "lanes x n_steps = 256 must be a multiple of batch_size = 512"),
        (PPO, (1, 1), {"lanes": MOST_KEPT}, None),
        (PPO, (1, 1), {"lanes": MOST_KEPT + 1}, "must be at most 50,000,000"),
        (SAC, (99,), {"total_steps": 100}, None),
        (SAC, (100,), {"total_steps": 100}, "learning_starts = 100 must be less than total_steps = 100"),
    ],
)
def test_hyperparameters_fit_the_training(kind, given, training, message):
    names = ("n_steps", "batch_size") if kind is PPO else ("learning_starts",)
    expected = nullcontext() if message is None else pytest.raises(InputError, match=message)
    with expected:
        kind(**dict(zip(names, given, strict=True))).check(SimpleNamespace(**training))


def test_evaluations_up_to_the_step_that_a_run_resumes_at_stay(tmp_path):
    folder = RunFolder(tmp_path)
    folder.drop_evaluations_after(-1)  # there is none yet
    assert not folder.evaluations.exists()
    for steps in (0, 100, 200):
        folder.add_evaluation(steps, [PAIR, replace(PAIR, seed=1)])
    folder.drop_evaluations_after(100)
    assert [row["steps"] for row in folder._rows()] == ["0", "0", "100", "100"]
    row = folder._rows()[1]
    assert (row["seed"], row["speed_kmh"], row["qualified"]) == ("1", "250.0", str(PAIR.qualified))
    assert (row["policy_std"], row["passive_std"]) == ("1.0", "2.0")
    folder.drop_evaluations_after(-1)
    assert folder._rows() == []


def test_a_verdict_is_the_mean_ratio_and_that_every_pass_qualified():
    far = replace(PAIR, policy=replace(FIGURES, mean=2.0, std=3.0))
    assert verdict([PAIR]) == (0.5, True)
    assert verdict([PAIR, far]) == (1.0, False)
    early = replace(PAIR, policy=Figures.none(), ending="It ended.")
    nothing = replace(early, passive=Figures.none(), passive_ending="It ended.")
    assert early.ratio == math.inf
    assert math.isnan(replace(nothing, ending="").ratio)
    assert in_words([PAIR]) == "σ -50.0 % of passive"
    assert in_words([PAIR, far]) == "σ +0.0 % of passive, F_m out of range"
    assert in_words([PAIR, early]) == "a run ended early"
    assert in_words([early, nothing]).startswith("the passive pantograph's run ended early")


def test_a_pair_of_passes_has_the_figures_of_those_that_did_not_end_early():
    settings = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 280.0}
    active, passive = simulate(**settings, policy="pd", seed=3), simulate(**settings, seed=3)
    made = pair(active, passive)
    assert (made.speed_kmh, made.seed, made.spans) == (280.0, 3, "10-19")
    assert (made.policy.std, made.passive.std) == (active.summary().std, passive.summary().std)
    assert len(made.policy_compliance) == len(made.passive_compliance) > 3
    ended = replace(active, terminated=True, ending="It ended.")
    made = pair(ended, passive)
    assert (made.spans, made.policy_compliance, made.ending) == ("10-19", (), "It ended.")
    assert math.isnan(made.policy.std)
    assert pair(ended, replace(passive, terminated=True)).spans == ""


FACTS = SimpleNamespace(needs=SimpleNamespace(channels=(0,)), inputs=2, activation="tanh", squashed=False)


SHAPES = {"weight_0": (3, 2), "bias_0": (3,), "weight_1": (1, 5), "bias_1": (1,), "cell_weight_input": (6, 3)}
SHAPES |= {"cell_weight_state": (6, 2), "cell_bias_input": (6,), "cell_bias_state": (6,)}
RECURRENT = {f"actor/{name}": np.ones(shape) for name, shape in SHAPES.items()}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"actor/cell_bias_state": None}, "only a part of a cell"),
        ({"actor/cell_other": np.ones(1)}, "only a part of a cell"),
        ({"actor/cell_weight_input": np.ones((6, 2))}, "the cell of its network does not fit"),
        ({"actor/cell_weight_state": np.ones(6)}, "the cell of its network does not fit"),
        ({"actor/cell_bias_input": np.full(6, np.inf)}, "the cell of its network holds values that are not"),
        ({"actor/weight_1": np.ones((1, 3))}, "layer 2 of its network does not fit"),
    ],
)
def test_a_cell_that_does_not_fit_is_refused(change, message):
    assert actor_of(RECURRENT, FACTS).units == 2
    arrays = {name: array for name, array in (RECURRENT | change).items() if array is not None}
    with pytest.raises(ValueError, match=message):
        actor_of(arrays, FACTS)


def examples(rewards, terminated, ended):
    empty = np.zeros((len(rewards), 1, 1), np.float32)
    as_bool = [np.array(each, bool)[:, None] for each in (terminated, ended)]
    return Demonstrations(empty, empty, empty, np.array(rewards, np.float32)[:, None], *as_bool, empty)


def test_sums_of_rewards_end_with_their_episode_and_are_known_where_nothing_is_missing():
    ends = examples([1.0, 2.0, 3.0, 4.0], [0, 1, 0, 0], [0, 1, 0, 0])
    sums, known = returns(ends, 0.5)
    assert sums.ravel().tolist() == [2.0, 2.0, 5.0, 4.0]
    assert known.ravel().tolist() == [True, True, False, False]
    sums, known = returns(examples([1.0, 2.0, 3.0, 4.0], [0, 0, 0, 1], [0, 1, 0, 1]), 0.5)
    assert sums.ravel().tolist() == [2.0, 2.0, 5.0, 4.0]
    assert known.ravel().tolist() == [False, False, True, True]
    sums, known = returns(examples([1.0] * 8, [0] * 8, [0] * 8), 0.5)  # 0.5^7 is below 1 %
    assert known.ravel().tolist() == [True, True, *[False] * 6]
    assert sums[0, 0] == pytest.approx(2.0 - 2.0**-7)


class Lanes:
    """Two lanes; lane 1 ends early after the second step, lane 0 after the third, at the line's end."""

    num_envs = 2

    def __init__(self):
        self.steps, self.taken = 0, []

    def reset(self, seed):
        self.seeds = seed
        return np.zeros((2, 1), np.float32), {}

    def step(self, actions):
        self.steps += 1
        self.taken.append(actions)
        terminated, truncated = np.array([False, self.steps == 2]), np.array([self.steps == 3, False])
        infos = {"final_obs": np.array([np.array([100.0 + lane]) for lane in range(2)])}
        after = np.full((2, 1), float(self.steps), np.float32)
        return after, np.full(2, -1.0 * self.steps), terminated, truncated, infos


def test_a_demonstration_keeps_what_was_seen_intended_done_and_followed():
    lanes, begun = Lanes(), []
    policy = SimpleNamespace(
        act=lambda seen: 0.9 + 0.0 * seen, begin=lambda which: begun.append(which.tolist())
    )
    made = demonstrate(lanes, policy, range(7, 9), 4, 0.5)
    assert lanes.seeds == [7, 8]
    assert begun == [[0, 1], [1], [0]]
    first, *_ = made
    assert first[..., 0].tolist() == [[0, 0], [1, 1], [2, 2], [3, 3]]
    assert made.rewards.tolist() == [[-1, -1], [-2, -2], [-3, -3], [-4, -4]]
    assert made.terminated.tolist() == [[False, False], [False, True], [False, False], [False, False]]
    assert made.ended.tolist() == [[False, False], [False, True], [True, False], [False, False]]
    assert made.following[..., 0].tolist() == [[1, 1], [2, 101], [100, 3], [4, 4]]
    assert made[1] == pytest.approx(0.9)
    np.testing.assert_array_equal(made[2], np.array(lanes.taken))
    expected = np.random.default_rng(7).standard_normal((4, 2, 1))
    np.testing.assert_allclose(made[2], np.clip(0.9 + 0.5 * expected, -1, 1), rtol=1e-6)


def test_a_task_with_another_observation_is_told_of_it():
    needs = {"channels": (0,), "force_limit": 100.0, "control_interval": 0.01, "entries": (("a", 0.0, 1.0),)}
    needs |= dict.fromkeys(SETTINGS, "same")
    told = _first_difference(SimpleNamespace(**needs), SimpleNamespace(**needs | {"entries": ()}))
    assert "trained with other observations (1: a / 1) than this task has (0: )" in told


def test_an_environment_s_speeds_are_the_ends_and_the_middle_of_its_range():
    assert speeds(arguments({"id": "Pantograph-v0"})) == (200.0, 275.0, 350.0)
    assert speeds(arguments({"id": "Pantograph-v0", "speed_kmh": (201.0, 302.0)})) == (201.0, 251.5, 302.0)
    assert speeds(arguments({"id": "Pantograph-v0", "speed_kmh": 250.0})) == (250.0,)
    given = arguments({"id": "Pantograph-v0", "speed_kmh": 250.0, "accuracy": "fast"})
    assert given == IDS["Pantograph-v0"] | {"speed_kmh": 250.0, "accuracy": "fast"}
    for name in ("Pantograf-v0", None, 3, ["Pantograph-v0"]):
        with pytest.raises(InputError, match="unknown id"):
            arguments({"id": name})


HALVED = replace(FIGURES, mean=1.01, std=1.0, max_uplift=0.0525, contact_loss=0.0)
HALF = replace(PAIR, policy=HALVED)
MOVED = replace(HALF, seed=1, policy=replace(HALVED, mean=2.0, std=1.5))
EARLY = replace(HALF, speed_kmh=300.0, policy=Figures.none(), spans="", ending="It ended.")
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
    command._print_pairs([HALF, MOVED, EARLY, EARLY_BOTH])
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


def test_a_training_shows_its_speed_and_what_the_environment_takes_of_it(monkeypatch):
    clock, told = [100.0], []
    monkeypatch.setattr(train, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    bar = train.ProgressBar(4000, lambda: [HALF])
    env = SimpleNamespace(unwrapped=SimpleNamespace(seconds=3.2))
    rewards = [{"r": value} for value in (-3.0, -4.0)]
    bar.model = SimpleNamespace(get_env=lambda: env, ep_info_buffer=rewards)
    shown = SimpleNamespace(print=told.append)
    bar.progress = SimpleNamespace(update=lambda task, **given: told.append(given), console=shown)
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
        (None, False, "a run ended early, F_m out of range: disqualified"),
    ],
)
def test_a_training_says_where_its_models_are_and_how_good(
    ratio, qualified, words, said, monkeypatch, tmp_path
):
    (tmp_path / "it.toml").write_text(TOML)
    names = ("path", "tensorboard", "model", "best")
    paths = SimpleNamespace(**{name: Path(name) for name in names})
    facts = {"steps": 64, "ratio": ratio, "qualified": qualified}
    monkeypatch.setattr("panto_agents.train.train", lambda *_, **__: paths)
    monkeypatch.setattr("panto_agents.model_file.read_model", lambda path: (SimpleNamespace(**facts), None))
    command.train(tmp_path / "it.toml", output=tmp_path / "out")
    assert said.getvalue().splitlines() == [
        f"final model (step 64): model: {words}",
        f"best at an evaluation (step 64): best: {words}",
        "panto evaluate best",
    ]


def test_runs_of_an_ablation_are_in_a_folder_of_its_name(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    seen = []
    monkeypatch.setattr("panto_agents.ablation.load_ablation", lambda config: None)
    monkeypatch.setattr("panto_agents.ablation.run", lambda *given: seen.append(given) or 1 / 0)
    for output in (None, Path("mine")):
        with pytest.raises(ZeroDivisionError):
            command.ablation(Path("configs/parts.toml"), output=output)
    assert [given[1] for given in seen] == [Path("runs/parts"), Path("mine")]
    assert (tmp_path / "runs" / "parts").is_dir()
