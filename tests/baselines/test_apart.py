"""Policies in a process of their own: they play the same passes, fail in one sentence, and leave nothing."""

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from panto_baselines.benchmark import apart
from panto_baselines.benchmark.apart import PolicyApart, find_apart
from panto_baselines.benchmark.settings import BenchmarkSettings, Line, Windows
from panto_baselines.benchmark.single_pass import run_pass
from panto_env import InputError
from panto_env.base.settings import parse
from panto_env.policies import find_policy

from ..cluster.test_orphans import alive, family, wait_for

ROOT = Path(__file__).parents[2]
POLICY = """
import json, os, sys, time
from pathlib import Path
import numpy as np

class Policy:
    observation, normalise, washout = "centred", (200.0, 300.0), 2

    def reset(self, context):
        assert context.layout.kind == "centred" and context.washout == 2

    def act(self, observation):
        {body}
"""
SEEN = "Path('seen.json').write_text(json.dumps([sys.executable, sys.argv, dict(os.environ)]))"


@pytest.fixture(autouse=True, scope="module")
def nothing_left():
    yield
    apart.close()


def play(policy, seed=1, **given):
    table = {"actuator": "realistic", "sensors": "realistic", "line_condition": "as-built"} | given
    settings = parse(BenchmarkSettings, table, "the benchmark")
    return run_pass(settings, Line(distance=310.0), Windows((3, 5)), policy, 300.0, seed)


def written(folder, body):
    """A policy of a file, whose act has this body."""
    path = folder / "mine.py"
    path.write_text(POLICY.format(body=body))
    return f"{path}:Policy"


@pytest.mark.longer
@pytest.mark.parametrize("policy", ["lqg", "blind of pd", "tape of pd"])
def test_an_installed_policy_plays_the_same_pass_apart_and_trusted(policy):
    one, other = (play(policy, trusted=trusted) for trusted in (False, True))
    assert one.row == other.row
    np.testing.assert_array_equal(one.played.actions, other.played.actions)
    assert one.played.actions.any()


@pytest.mark.longer
@pytest.mark.parametrize(
    "policy", ["agents/models/known-line.safetensors", "examples/own_controller.py:Damper"]
)
def test_a_policy_of_a_file_plays_the_same_pass_as_its_object(policy):
    source = str(ROOT / policy)
    one, other = play(source, trusted=True), play(find_policy(source))
    assert (one.row.figures, one.row.action_rate) == (other.row.figures, other.row.action_rate)
    np.testing.assert_array_equal(one.played.actions, other.played.actions)


@pytest.mark.longer
def test_it_sees_what_it_wishes_and_neither_secrets_nor_seeds_and_prints_elsewhere(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.setenv("A_TOKEN", "secret")
    monkeypatch.chdir(tmp_path)
    seed = 4_503_599_627_370_497
    done = play(written(tmp_path, f"{SEEN}; print('hello'); return np.full(1, 0.2)"), seed)
    assert done.played.washout == 2
    assert (done.played.actions == 0.2).all()
    seen = (tmp_path / "seen.json").read_text()
    assert {"PATH", "OMP_NUM_THREADS"} <= json.loads(seen)[2].keys()
    assert "secret" not in seen
    assert str(seed) not in seen
    output, errors = capfd.readouterr()
    assert (output, set(errors.split())) == ("", {"hello"})


@pytest.mark.longer
def test_only_trusted_and_installed_policies_run_beside_the_plant(tmp_path):
    file = written(tmp_path, "return np.zeros(1)")
    assert isinstance(find_apart("pd", trusted=False), PolicyApart)
    assert isinstance(find_apart(file, trusted=True), PolicyApart)
    assert isinstance(find_apart(f"guarded:{file}", trusted=True), PolicyApart)
    assert not isinstance(find_apart("guarded:pd", trusted=True), PolicyApart)
    assert not isinstance(find_apart("pd", trusted=True), PolicyApart)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("raise ArithmeticError('no idea')", "mine.py:13: ArithmeticError: no idea."),
        ("return np.zeros(2)", "its action must be finite numbers of shape (1,), not array([0., 0.])."),
        ("return np.array([np.nan])", "its action must be finite numbers of shape (1,), not array([nan])."),
        ("os.kill(os.getpid(), 9)", "its process was killed by SIGKILL."),
        ("sys.exit(3)", "its process ended with status 3."),
        ("time.sleep(60)", "it took more than 0.5 s."),
        ("return np.array([float(input())])", "EOFError"),
    ],
)
def test_a_policy_that_fails_is_named_and_leaves_no_process(body, words, tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "ACT_LIMIT", 0.5)
    others = set(family(os.getpid()))  # of other tests, such as the tracker of a pool's resources
    policy = written(tmp_path, body)
    with pytest.raises(InputError) as caught:
        play(policy)
    assert str(caught.value).startswith(f"The policy '{policy}' failed in act")
    assert words in str(caught.value)
    wait_for(lambda: not any(map(alive, set(family(os.getpid())) - others)), 5)


@pytest.mark.slow
def test_a_policy_that_cannot_be_loaded_is_named(tmp_path):
    policy = written(tmp_path, "pass")
    file = Path(policy.partition(":")[0])
    with pytest.raises(InputError, match="Unknown policy 'pdd'"):
        find_apart("pdd", trusted=False)
    for text, words in (
        ("import sys; sys.exit(2)", r"mine.py cannot be run, at .*: SystemExit: 2"),
        ("import os; os._exit(2)", "failed in being loaded: its process ended with status 2"),
        (file.read_text().replace("washout = ", "memory = "), "failed in being loaded: .*memory"),
        (file.read_text().replace('"centred"', '"full"'), "'full', which holds what no train can measure"),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=words):
            play(policy)


@pytest.mark.slow
def test_its_python_may_be_another(monkeypatch, tmp_path):
    other = tmp_path / "bin" / "python3"
    other.parent.mkdir()
    other.symlink_to(sys.executable)
    (tmp_path / "pyvenv.cfg").write_text((Path(sys.prefix) / "pyvenv.cfg").read_text())
    (tmp_path / "lib").symlink_to(Path(sys.prefix) / "lib")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(apart.INTERPRETER, str(other))
    policy = written(tmp_path, f"{SEEN}; return np.zeros(1)")
    play(policy)
    assert json.loads(Path("seen.json").read_text())[0] == str(other)
    apart.close()
    monkeypatch.setenv(apart.INTERPRETER, str(tmp_path / "none"))
    with pytest.raises(InputError, match="none, can't be started: No such file or directory; correct PANTO"):
        play(policy)
