"""Policies in a process of their own: they play the same passes, fail in one sentence, and leave nothing."""

from __future__ import annotations

import json
import os
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from panto_baselines.benchmark import apart
from panto_baselines.benchmark.apart import PolicyApart, find_apart
from panto_baselines.benchmark.settings import BenchmarkSettings, Line
from panto_baselines.benchmark.single_pass import run_pass
from panto_env import InputError
from panto_env.analysis.pool import in_processes
from panto_env.analysis.simulation import ready_pass
from panto_env.base.machine import cores
from panto_env.base.settings import parse
from panto_env.policies import find_policy

from ..cluster.test_orphans import alive, family, wait_for

ROOT = Path(__file__).parents[2]
SPANS = (3, 5)
POLICY = """
import json, os, sys, time
from pathlib import Path
import numpy as np

passes = 0

class Policy:
    def reset(self, context):
        global passes
        passes += 1

    def act(self, observation):
        {body}
"""
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a policy apart is forked")


@pytest.fixture(autouse=True)
def nothing_left():
    """Every test ends all policies apart."""
    yield
    apart.close()


def settings(**given):
    table = {"actuator": "realistic", "sensors": "realistic", "line_condition": "as-built"} | given
    return parse(BenchmarkSettings, table, "the benchmark")


def play(policy, seed=1, speed=300.0, line=None, **given):
    line = line or Line(distance=310.0)
    return run_pass(settings(**given), line, SPANS, policy, speed, seed)


def written(folder, body):
    """A policy of a file, whose act has this body."""
    path = folder / "mine.py"
    path.write_text(POLICY.format(body=body))
    return f"{path}:Policy"


@pytest.mark.parametrize(
    "policy",
    [
        *(
            "passive",
            "pd",
            "fb+ff:gain=0.3",
            "lqg",
            "periodic",
            "adaptive-fb+ff",
            "blind of pd",
            "tape of pd",
        ),
        pytest.param("mpc", marks=pytest.mark.slow),
    ],
)
def test_an_installed_policy_plays_the_same_pass_apart_and_trusted(policy):
    one, other = (play(policy, trusted=trusted) for trusted in (False, True))
    assert one.row == other.row
    np.testing.assert_array_equal(one.played.actions, other.played.actions)
    assert one.played.actions.any() == (policy != "passive")


@pytest.mark.parametrize(
    "policy", ["agents/models/known-line.safetensors", "examples/own_controller.py:Damper"]
)
def test_a_policy_of_a_file_plays_the_same_pass_as_its_object(policy):
    source = str(ROOT / policy)
    one, other = play(source, trusted=True), play(find_policy(source))
    assert one.row.figures == other.row.figures
    assert one.row.action_rate == other.row.action_rate
    np.testing.assert_array_equal(one.played.actions, other.played.actions)


def test_only_trusted_and_installed_policies_run_beside_the_plant(tmp_path):
    file = written(tmp_path, "return np.zeros(1)")
    assert isinstance(find_apart("pd", trusted=False), PolicyApart)
    assert isinstance(find_apart(file, trusted=True), PolicyApart)
    assert not isinstance(find_apart("pd", trusted=True), PolicyApart)


def test_a_policy_says_what_it_wishes_from_apart(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import numpy as np\nclass Mine:\n"
        "    observation, normalise, washout = 'centred', (200.0, 300.0), 2\n"
        "    def reset(self, context): self.context = context\n"
        "    def act(self, observation):\n"
        "        assert self.context.layout.kind == 'centred' and self.context.washout == 2\n"
        "        return np.full(1, 0.2)\n"
    )
    played = play(f"{file}:Mine").played
    assert played.washout == 2
    assert (played.actions == 0.2).all()


def test_no_pass_knows_of_another(tmp_path):
    policy = written(tmp_path, "return np.array([passes / 1000])")
    firsts = [play(policy, seed).played.actions[0, 0] for seed in (0, 1, 2)]
    other_speed = play(policy, 0, speed=250.0).played.actions[0, 0]
    assert len({*firsts, other_speed}) == 1


def test_nothing_that_a_policy_is_started_with_holds_a_seed(tmp_path, monkeypatch):
    body = (
        "Path('seen.json').write_text(json.dumps([os.getcwd(), sys.argv, dict(os.environ), os.listdir()]));"
        " return np.zeros(1)"
    )
    seed = 4_503_599_627_370_497
    monkeypatch.chdir(tmp_path)
    play(written(tmp_path, body), seed)
    seen = (tmp_path / "seen.json").read_text()
    assert json.loads(seen)[0] == str(tmp_path)
    assert str(seed) not in seen


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("raise ArithmeticError('no idea')", "mine.py:14: ArithmeticError: no idea."),
        ("return np.zeros(2)", "its action must be finite numbers of shape (1,), not array([0., 0.])."),
        ("return np.array([np.nan])", "its action must be finite numbers of shape (1,), not array([nan])."),
        ("return 'full'", "its action must be finite numbers of shape (1,), not 'full'."),
        ("os.kill(os.getpid(), 9)", "its process was killed by SIGKILL."),
        ("os.kill(os.getppid(), 9); time.sleep(60)", "its process was killed by SIGKILL."),
        ("os._exit(3)", "its process ended with status 3."),
        ("sys.exit(3)", "its process ended with status 3."),
        ("while True: pass", "it took more than 0.5 s."),
        ("time.sleep(60)", "it took more than 0.5 s."),
        ("return np.array([float(input())])", "EOFError"),
        ("[os.write(fd, b'+12') for fd in range(3, 9) if not os.isatty(fd)]", "failed in act"),
    ],
)
def test_a_policy_that_fails_is_named_and_leaves_no_process(body, words, tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "ACT_LIMIT", 0.5)
    apart.close()
    others = set(family(os.getpid()))  # of other tests, such as the tracker of a pool's resources
    policy = written(tmp_path, body)
    with pytest.raises(InputError) as caught:
        play(policy)
    assert str(caught.value).startswith(f"The policy '{policy}' failed in act")
    assert words in str(caught.value)
    assert not [each for each in set(family(os.getpid())) - others if alive(each)]
    assert play("pd").row.figures.std > 0  # and the next one runs


def test_a_policy_that_cannot_be_loaded_is_named(tmp_path):
    (tmp_path / "mine.py").write_text("import sys\nsys.exit(2)\n")
    with pytest.raises(InputError, match=r"mine.py cannot be run, at .*: SystemExit: 2"):
        find_apart(f"{tmp_path / 'mine.py'}:Policy", trusted=True)
    with pytest.raises(InputError, match="Unknown policy 'pdd'"):
        find_apart("pdd", trusted=False)
    (tmp_path / "mine.py").write_text("import os\nos._exit(2)\n")
    with pytest.raises(InputError, match="failed in being loaded: its process ended with status 2"):
        find_apart(f"{tmp_path / 'mine.py'}:Policy", trusted=True)


def test_what_a_policy_prints_does_not_reach_standard_output(tmp_path, capfd):
    play(written(tmp_path, "print('hello'); os.system('echo shell'); return np.zeros(1)"))
    output, errors = capfd.readouterr()
    assert output == ""
    assert {"hello", "shell"} <= set(errors.split())


def test_its_python_may_be_another(monkeypatch, tmp_path):
    policy = written(tmp_path, "Path('python').write_text(sys.executable); return np.zeros(1)")
    other = tmp_path / "bin" / "python3"
    other.parent.mkdir()
    other.symlink_to(sys.executable)
    (tmp_path / "pyvenv.cfg").write_text((Path(sys.prefix) / "pyvenv.cfg").read_text())
    (tmp_path / "lib").symlink_to(Path(sys.prefix) / "lib")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PANTO_POLICY_PYTHON", str(other))
    play(policy)
    assert Path("python").read_text() == str(other)
    apart.close()
    monkeypatch.setenv("PANTO_POLICY_PYTHON", str(tmp_path / "none"))
    with pytest.raises(InputError, match="none, can't be started: No such file or directory; correct PANTO"):
        play(policy)


def test_another_user_s_processes_end_as_their_pipes_are_closed(monkeypatch):
    """They can't be killed; those that go on do not hold the benchmark up."""

    def forbidden(group, number):
        raise PermissionError

    before = family(os.getpid())
    find_apart("pd", trusted=False)
    children = set(family(os.getpid())) - set(before)
    assert children
    with monkeypatch.context() as patched:
        patched.setattr(os, "killpg", forbidden)
        patched.setattr(apart, "END_LIMIT", 60.0)
        begun = time.monotonic()
        apart.close()
    assert time.monotonic() - begun < 20
    wait_for(lambda: not any(map(alive, children)), 5)


def test_another_user_s_process_that_goes_on_is_left(tmp_path, monkeypatch):
    policy = PolicyApart(written(tmp_path, "time.sleep(60)"))
    group = apart._process(0)._process.pid
    task, _ = ready_pass("passive", {"distance": 310.0}, 1)
    policy.reset(task.context(0))
    monkeypatch.setattr(apart, "ACT_LIMIT", 0.5)
    kill = os.killpg
    monkeypatch.setattr(os, "killpg", lambda *given: (_ for _ in ()).throw(PermissionError))
    monkeypatch.setattr(apart, "END_LIMIT", 0.5)
    with pytest.raises(InputError, match=r"took more than 0\.5 s"):
        policy.act(task.results.observation[0])
    kill(group, 9)


def test_a_policy_s_process_gets_no_secrets_from_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("A_TOKEN", "secret")
    monkeypatch.chdir(tmp_path)
    apart.close()
    play(written(tmp_path, "Path('seen.json').write_text(json.dumps(dict(os.environ))); return np.zeros(1)"))
    seen = json.loads(Path("seen.json").read_text())
    assert {"PATH", "OMP_NUM_THREADS"} <= seen.keys()
    assert "A_TOKEN" not in seen


ANSWER = """
import os, stat
answer = {answer}
for fd in range(3, 20):
    try:
        if stat.S_ISFIFO(os.fstat(fd).st_mode):
            os.write(fd, answer)
    except OSError:
        pass
"""


def sent(kind, content):
    return kind + len(content).to_bytes(4, "big") + content


@pytest.mark.parametrize(
    "answer",
    [
        sent(b"+", b'{"_number": 7, "reset": 3}'),
        sent(b"+", b'{"memory": "all"}'),
        sent(b"+", b"[" * 30_000),
        sent(b"+", b"\xff\xfe"),
        sent(b"+", b"7"),
        sent(b"!", b"The policy 'passive' failed in act: it is bad."),
        b"+\xff\xff\xff\xff",
        sent(b"+", b"{}") * 2,
    ],
)
def test_an_answer_that_is_none_blames_the_policy_that_sent_it(answer, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(ANSWER.format(answer=answer) + POLICY.format(body="return np.zeros(1)"))
    with pytest.raises(InputError) as caught:
        find_apart(f"{path}:Policy", trusted=False)
    assert str(caught.value).startswith(f"The policy '{path}:Policy' failed in being loaded: ")
    assert find_apart("passive", trusted=False).washout == 0.0


def test_wishes_of_any_length_arrive_and_are_judged(tmp_path):
    """256 entries of the memory are more than a pipe passes on in one piece."""
    path = tmp_path / "mine.py"
    path.write_text(
        "import numpy as np\n"
        "class Mine:\n"
        "    memory = tuple(k / 255.123456789 for k in range(1, 256))\n"
        "    def reset(self, context): self.memory_entries = len(context.layout.entries)\n"
        "    def act(self, observation): return np.zeros(1)\n"
    )
    assert len(find_apart(f"{path}:Mine", trusted=False).memory) == 255
    path.write_text(path.read_text().replace("range(1, 256)", "range(512)"))
    apart.close()
    with pytest.raises(
        InputError, match=r"The policy '.*mine.py:Mine' failed .*: .*memory must be increasing"
    ):
        find_apart(f"{path}:Mine", trusted=False)


def test_its_processes_end_with_it():
    apart.close()
    others = set(family(os.getpid()))
    find_apart("pd", trusted=False)
    children = set(family(os.getpid())) - others
    assert len(children) == 2  # that which loads nothing, and that of the policy
    apart.close()
    wait_for(lambda: not any(map(alive, children)), 5)


def answering_times(policy: str) -> tuple[float, float]:
    """Time (s) that an answer takes in this process, and apart: minimum over passes of the median."""
    found = []
    for driver in (find_policy(policy), PolicyApart(policy)):
        medians = []
        for _ in range(5):
            task, _ = ready_pass("passive", {"distance": 900.0}, 1)
            driver.reset(task.context(0))
            times = []
            while not task.results.truncated[0]:
                observation = task.results.observation[0].copy()
                begun = time.perf_counter()
                action = driver.act(observation)
                times.append(time.perf_counter() - begun)
                task.step(action[None])
            medians.append(float(np.median(times)))
        found.append(min(medians))
    return found[0], found[1]


@pytest.mark.slow
def test_an_answer_from_apart_takes_less_than_30_microseconds_more_on_every_core():
    for beside, away in in_processes([partial(answering_times, "pd") for _ in range(cores())]):
        assert 0 < away - beside < 30e-6
