"""A result keeps its actions, from which its rows follow; submissions to the leaderboard."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from panto_baselines.benchmark import actions, command
from panto_baselines.benchmark import run as benchmark
from panto_baselines.benchmark.actions import Played
from panto_baselines.benchmark.settings import BenchmarkSettings, Line, Windows
from panto_baselines.benchmark.single_pass import drive, run_pass
from panto_baselines.benchmark.submission import read_submission, replay
from panto_env import InputError, simulate
from panto_env.base.checksums import read_checked, write_checked
from panto_env.base.settings import parse

from .commands import called

TRACK = """
actuator = "realistic"
sensors = "realistic"
line_condition = "as-built"
[[lines]]
distance = 310
spans = [3, 5]
speeds_kmh = [300]
policies = ["pd"]
"""
LINE = {"distance": 310.0, "speeds_kmh": [300], "spans": (3, 5)}


class Leaning:
    """Commands a force that grows, and wants a washout of it."""

    washout = 0.5

    def reset(self, context):
        self.step = 0

    def act(self, observation):
        self.step += 1
        return np.full(1, min(1.2, 0.01 * self.step))


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    table = {"policies": ["pd", "fb+ff:gain=0.3"], "lines": [LINE], "seeds": 1, "salt": "a pinch"}
    outcome = benchmark.run(parse(BenchmarkSettings, table, "the benchmark"), workers=1)
    path = tmp_path_factory.mktemp("result") / "out.json"
    outcome.save(path)
    return path


def changed(result, folder, change):
    """A copy of the result whose table, or actions, somebody has changed, checksums and all."""
    table, path = read_checked(result), folder / "out.json"
    passes = actions.read(actions.beside(result), table["actions_sha256"])
    change(table, passes)
    actions.save(passes, actions.beside(path))
    write_checked(path, table | {"actions_sha256": actions.digest(passes)})
    return path


@pytest.mark.slow
def test_every_figure_follows_from_the_actions(result):
    again = replay(result, workers=1)
    assert [each.difference for each in again.rows] == [0.0] * 3
    assert again.follows
    some = replay(result, ["pd"], workers=1)
    assert [each.row["policy"] for each in some.rows] == ["pd"]
    assert some.follows is None


@pytest.mark.slow
def test_a_better_figure_or_rank_than_the_actions_give_is_found(result, tmp_path):
    def better(table, passes):
        table["rows"][-1]["std"] *= 1 - 1e-12

    again = replay(changed(result, tmp_path, better), workers=1)
    assert [each.difference > 0 for each in again.rows] == [False] * 2 + [True]

    def first(table, passes):
        table["cells"][-1]["rank"] = 0

    assert replay(changed(result, tmp_path, first), workers=1).follows is False


@pytest.mark.slow
def test_an_action_that_was_changed_by_a_billionth_is_found(result, tmp_path):
    def nudged(table, passes):
        passes[-1].actions[40] += 1e-9

    path = changed(result, tmp_path, nudged)
    differences = [each.difference for each in replay(path, workers=1).rows]
    assert differences[:-1] == [0.0] * 2
    assert 0 < differences[-1] < 1e-4
    done = called(command.replay, path, "--workers", 1)
    assert done.exit_code == 1
    assert "1 of 3 rows do not follow" in " ".join(done.stdout.split())
    assert called(command.replay, path, "--workers", 1, "--tolerance", 1e-4).exit_code == 0


def test_requirements_of_a_submission_are_its_lines(tmp_path):
    card = dict.fromkeys(("name", "description", "licence", "learnt_from"), "x")
    card |= {"policy": "mine.py:Mine", "authors": ["x"]}
    (tmp_path / "card.toml").write_text("".join(f"{name} = {value!r}\n" for name, value in card.items()))
    (tmp_path / "mine.py").write_text("")
    (tmp_path / "requirements.txt").write_text("# of ours\nnumpy >= 1.26  # fast\n\nscipy[all]\n")
    assert read_submission(tmp_path)[2] == ("numpy >= 1.26", "scipy[all]")


def test_passes_with_one_actuator_and_with_two_are_kept_side_by_side(tmp_path):
    passes = [Played(np.full((steps, count), 0.1 * steps), 0.0) for steps, count in ((3, 1), (4, 2), (2, 1))]
    actions.save(passes, tmp_path / "a.safetensors")
    for read, own in zip(
        actions.read(tmp_path / "a.safetensors", actions.digest(passes)), passes, strict=True
    ):
        np.testing.assert_array_equal(read.actions, own.actions)


@pytest.mark.longer
def test_what_is_not_a_whole_result_is_refused(result, tmp_path):
    with pytest.raises(InputError, match="no policy 'p': it has passive, pd, fb"):
        replay(result, ["p"])
    alone = tmp_path / "out.json"
    alone.write_bytes(result.read_bytes())
    with pytest.raises(InputError, match=r"out.actions.safetensors, the actions .* no such file"):
        replay(alone)
    actions.beside(alone).write_bytes(actions.beside(result).read_bytes()[:-1])
    with pytest.raises(InputError, match="holds no actions, or is damaged"):
        replay(alone)
    actions.save([Played(np.zeros((3, 1)), 0.0)], actions.beside(alone))
    with pytest.raises(InputError, match="holds the actions of another result"):
        replay(alone)
    write_checked(alone, {"what": "else"})
    with pytest.raises(InputError, match="is no result of"):
        replay(alone)


@pytest.mark.slow
def test_a_policy_that_learns_from_earlier_passes_is_not_ranked(tmp_path):
    """Through a file that its process leaves behind."""
    notes, path = tmp_path / "notes", tmp_path / "mine.py"
    path.write_text(
        "from pathlib import Path\nimport numpy as np\n"
        "class Mine:\n"
        f"    notes = Path({str(notes)!r})\n"
        "    def reset(self, context):\n"
        "        known = self.notes.read_text() if self.notes.exists() else ''\n"
        "        self.notes.write_text(known + 'x')\n"
        "        self.action = np.full(1, 1e-3 * len(known))\n"
        "    def act(self, observation): return self.action\n"
        "class Honest(Mine):\n"
        "    def reset(self, context): self.action = np.full(1, 1e-3)\n"
    )
    learns, honest = f"{path}:Mine", f"{path}:Honest"
    table = {"policies": [learns, honest], "lines": [LINE], "seeds": 2}
    outcome = benchmark.run(parse(BenchmarkSettings, table, "the benchmark"), workers=1)
    found = {each.policy: each for each in outcome.standings}
    assert "it learns from other passes" in found[learns].disqualified
    assert (found[learns].rank, found[honest].disqualified) == (None, "")
    outcome.save(tmp_path / "out.json")
    assert replay(tmp_path / "out.json", workers=1).follows


def test_with_a_washout_the_rate_is_that_of_what_the_plant_was_commanded():
    """An ideal actuator does what it is commanded: its forces in the record are the commands."""
    settings = parse(BenchmarkSettings, {"line_condition": "new", "actuator": "ideal"}, "the benchmark")
    line, spans = Line(**LINE), (3, 5)
    done = run_pass(settings, line, Windows(spans), Leaning(), 300.0, 0)
    _, commands = drive(settings, line, Leaning(), 300.0, 0)
    run = simulate(policy=Leaning(), distance=310.0, line_condition="new", record_droppers=False)
    steps = round(settings.control_interval / run.time_step)
    # An actuator without lag has reached the command at the end of the step.
    np.testing.assert_allclose(commands[:, 0], run.frame_force[steps - 1 :: steps], atol=1e-9)
    assert commands.max() < 70 < 100 * done.played.actions.max()
    inside = run.inside(spans)[::steps]
    expected = np.sqrt(np.mean((np.diff(commands[inside, 0]) / settings.control_interval) ** 2))
    assert done.row.action_rate == pytest.approx(expected)
    assert done.row.saturation == 0.0 < np.mean(np.abs(done.played.actions[inside]) >= 0.999)
    again = run_pass(settings, line, Windows(spans), Leaning(), 300.0, 0, played=done.played)
    assert again.row.figures == done.row.figures


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(Path(__file__).parents[2] / "examples" / "submission", tmp_path / "mine"))


def checked(folder, *arguments):
    (folder.parent / "track.toml").write_text(TRACK)
    words = ("check", folder, "--config", folder.parent / "track.toml", "--workers", 1)
    return called(command.submission, *words, *arguments)


@pytest.mark.slow
def test_the_example_would_be_ranked(folder, result):
    done = checked(folder, "--against", str(result))
    assert done.exit_code == 0, done.output
    for words in ("Damped frame by A. Author (MIT)", "It requires: numpy>=2.0", "Learnt from: nothing"):
        assert words in done.stdout
    assert "It would be ranked, at place 2 of " in done.stdout


@pytest.mark.slow
def test_one_that_presses_would_not(folder):
    (folder / "policy.py").write_text(
        "import numpy as np\nclass DampedFrame:\n    def reset(self, context): pass\n"
        "    def act(self, observation): return np.full(1, 0.2)\n"
    )
    table = json.loads(checked(folder, "--salt", "today", "--json").stdout)
    assert table["card"]["name"] == "Damped frame"
    assert min(row["seed"] for row in table["result"]["rows"]) >= 2**52
    mine, tape = table["result"]["standings"][-2:]
    assert mine["policy"] == f"{folder}/policy.py:DampedFrame"
    assert tape["policy"] == f"tape of {mine['policy']}"
    assert "mean force" in mine["disqualified"]
    assert "It would not be ranked" in checked(folder).stdout


@pytest.mark.longer
@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("name", '""', "key 'name'"),
        ("policy", '"../policy.py:Mine"', "must be a file in the folder of the card"),
        ("policy", '"/etc/passwd"', "must be a file in the folder of the card"),
        ("policy", '"other.py:Mine"', "there is no file"),
        ("policy", '"policy.py:Mine"', "has no class 'Mine'"),
        ("colour", '"red"', "key 'colour'"),
    ],
)
def test_a_card_that_is_not_whole_is_refused(folder, key, value, words):
    card = folder / "card.toml"
    lines = [line for line in card.read_text().splitlines() if not line.startswith(f"{key} =")]
    card.write_text("\n".join([*lines, f"{key} = {value}"]))
    done = checked(folder)
    assert isinstance(done.exception, InputError)
    assert words in str(done.exception)
