"""What can't be computed or understood is refused in one sentence, before time is lost."""

import os

import gymnasium
import numpy as np
import pytest

import panto_env
from panto_baselines.benchmark import run as benchmark
from panto_baselines.benchmark.settings import BenchmarkSettings
from panto_env import InputError, simulate
from panto_env.analysis.sweep import sweep
from panto_env.base.errors import AccuracyWarning
from panto_env.base.settings import parse
from panto_env.catalog import load_pantograph
from panto_env.cli import make_app
from panto_env.control import Task
from panto_env.control.length import SHARE
from panto_env.control.settings import run_settings
from panto_env.envs import BARE
from panto_env.plant.catenary.flexible.model import FlexibleCatenary
from panto_env.plant.pantograph import schema as build
from panto_env.policies import find_policy
from panto_env.studies import Outcome
from panto_env.studies import write as write_study

from ..command import panto

OWN = """
class Own:
    def __init__(self, gain=0.5):
        self.gain = gain
    def reset(self, context):
        self.actions = context.actions
    def act(self, observation):
        if self.gain < 0:
            raise ValueError("the gain is negative")
        return [self.gain] * self.actions

class Broken(Own):
    def __init__(self):
        raise ZeroDivisionError("no gain")

class Lost(Own):
    def reset(self, context):
        context.layout.index("contact farce")
"""


TRAINING = """
algorithm = "ppo"
total_steps = 1000
checkpoint_steps = 100
lanes = 2
environment = { id = "Pantograph-v0" }
evaluation = { interval_steps = 100 }
"""


def command(*arguments):
    """The command `panto`; InputErrors are raised."""
    make_app()(args=list(arguments), standalone_mode=False)


DIVERGED = "diverged, so it has no result: .*±3 m; use a time_step below"


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path / "own.py"


@pytest.fixture
def diverging(monkeypatch):
    """Settings of a run that diverges: a stiff contact that may pull, with nothing that keeps it stable."""
    monkeypatch.setattr(build, "STABILITY_MARGIN", np.inf)
    monkeypatch.setattr(FlexibleCatenary, "contact_share", 0.0)
    stiff = load_pantograph("en50318-2002").model_copy(update={"contact_stiffness": 1e6})
    return {"pantograph": stiff, "bilateral": True, "accuracy": "fast"}


def test_a_run_that_diverges_gives_no_figures(diverging):
    with pytest.raises(InputError, match=DIVERGED):
        simulate(**diverging)


def test_an_episode_that_diverges_ends_and_has_no_figures(diverging):
    env = gymnasium.make("panto_env:Pantograph-v0", **BARE | diverging)
    env.reset(seed=0)
    still, ended = np.zeros(1, dtype=np.float32), False
    with pytest.warns(AccuracyWarning, match=DIVERGED):  # noqa: PT031 - at which step is not known
        while not ended:
            _, _, *ends, info = env.step(still)
            ended = any(ends)
    assert info["figures"] == {}


def test_an_entry_that_the_observation_has_not_is_named():
    env = gymnasium.make("panto_env:PantographStiffness-v0").unwrapped
    observation, _ = env.reset(seed=0)
    with pytest.raises(InputError, match="no entry 'contact farce': did you mean 'contact force'"):
        env.context.layout.read(observation, "contact farce")


def test_a_policy_of_ones_own_is_found_in_a_file(own):
    assert find_policy(f"{own}:Own").gain == 0.5
    run = simulate("periodic-stiffness", "three-mass", policy=f"{own}:Own:gain=0.25", distance=50.0)
    assert run.frame_force == pytest.approx(25.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "must name a class in the file, as .*own.py:Name"),
        (":Other", "has no class 'Other': it has Own, Broken, Lost"),
        (":Own:loss=1", "has no parameter 'loss': known are gain"),
        (":Own:gian=1", r"has no parameter 'gian': did you mean 'gain'\? known are gain"),
        (":Own:gain", "Own:gain': 'gain' must read name=value"),
        (":Own:gain=1,gain=2", "'gain' is given twice"),
        (":Broken:gain=1", "has no parameter 'gain': it has none"),
        (":Broken", "cannot be made, at .*own.py:14: ZeroDivisionError: no gain"),
    ],
)
def test_what_is_wrong_with_a_policy_s_file_is_said(own, name, message):
    with pytest.raises(InputError, match=message):
        find_policy(f"{own}{name}")


def test_a_policy_s_file_may_be_missing_broken_or_hold_no_policy(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        find_policy(f"{tmp_path}/none.py:Own")
    (tmp_path / "broken.py").write_text("1 / 0")
    with pytest.raises(
        InputError, match=r"broken.py cannot be run, at .*broken.py:1: ZeroDivisionError: div"
    ):
        find_policy(f"{tmp_path}/broken.py:Own")
    (tmp_path / "hollow.py").write_text("class Own:\n    pass\n")
    with pytest.raises(InputError, match="must have the methods reset and act"):
        find_policy(f"{tmp_path}/hollow.py:Own")


def test_a_policy_that_fails_is_named_with_the_line(own):
    with pytest.raises(
        InputError, match=r"gain=-1' failed in act, at .*own.py:9: ValueError: the gain is neg"
    ):
        simulate("periodic-stiffness", "three-mass", policy=f"{own}:Own:gain=-1", distance=50.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Own:gain=-1", r"Own:gain=-1' failed in act, at .*own.py:9: ValueError: the gain is negative"),
        ("Lost", r"Lost' failed in reset: The observation has no entry 'contact farce': did you mean"),
    ],
)
def test_it_is_named_alike_wherever_it_runs(own, name, message):
    line = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 300.0}
    given = {
        "policies": [f"{own}:{name}"],
        "lines": [line | {"speeds_kmh": [300], "spans": (2, 6)}],
        "seeds": 1,
    }
    with pytest.raises(InputError, match=message):
        benchmark.run(parse(BenchmarkSettings, given, "the benchmark"), workers=1)
    with pytest.raises(InputError, match=message):
        simulate(**line, policy=f"{own}:{name}")


def test_a_policy_s_file_is_run_once_and_anew_after_an_edit(tmp_path):
    path = tmp_path / "counted.py"
    path.write_text(f"open({str(tmp_path / 'runs')!r}, 'a').write('x')\n{OWN}")
    for _ in range(3):
        find_policy(f"{path}:Own")
    assert (tmp_path / "runs").read_text() == "x"
    path.write_text(path.read_text().replace("gain=0.5", "gain=0.75"))
    os.utime(path, ns=(1, 1))
    assert find_policy(f"{path}:Own").gain == 0.75


def test_values_of_a_policy_may_hold_commas():
    assert find_policy("fb+ff:gain={250: 0.5, 300: 1.5},theta=0").gains == {250: 0.5, 300: 1.5}


def test_a_sweep_of_millions_is_refused_before_it_begins(tmp_path):
    values = list(np.linspace(200.0, 300.0, 400))
    with pytest.raises(InputError, match="This sweep has 160,000 passes; the maximum is 100,000"):
        sweep({"speed_kmh": values, "pantograph.masses.1": values})
    done = panto("sweep", "speed_kmh=100:300:10000000", cwd=tmp_path)
    assert done.returncode == 2
    assert "10,000,000 values" in done.stderr


LONG = {"spans": 1000, "distance": 59e3, "speed_kmh": 20.0}
"""A train that takes three hours under a line of a thousand supports."""


def test_a_run_that_would_not_fit_into_memory_is_refused_with_the_estimate(monkeypatch):
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 16e9)
    with pytest.raises(InputError, match=r"14,868,000 time steps with 999 supports would take 239.6 GB, but"):
        simulate(**LONG, record_droppers=False)


def test_passes_at_once_that_would_not_fit_are_refused_before_the_first(monkeypatch):
    monkeypatch.setattr("panto_env.analysis.sweep.simulate", lambda **_: pytest.fail("a pass was run"))
    needed = Task(run_settings({"distance": 540.0}), record_droppers=True).cost.memory
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 1.5 * needed / SHARE)
    with pytest.raises(InputError, match=r"The record of 2 passes at once would take .*, or fewer workers"):
        sweep({"pantograph.masses.1": [7.0, 8.0]}, distance=540.0, workers=2)


def test_a_folder_that_is_asked_for_is_made(tmp_path):
    study = Outcome("A study", ())
    write_study(study, tmp_path / "new" / "folder")
    assert (tmp_path / "new" / "folder" / "numbers.json").is_file()
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match=r"The folder .*file/folder cannot be made: Not a directory"):
        write_study(study, tmp_path / "file" / "folder")


def test_the_command_says_its_version(tmp_path):
    done = panto("--version", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"panto-env {panto_env.__version__}\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["simulate", "--spans", "²-3"], "--spans must read first-last, e.g. 5-6, or all, not '²-3'"),
        (
            ["simulate", "--distance", "0.1"],
            "at least the 0.8333 m that a train covers in one control interval",
        ),
        (["simulate", "--distance", "60", "--control-interval", "5"], "at least the 416.7 m"),
        (["simulate", "--distance", "1e9"], "distance must be at most 59,520 m on line 'en50318-2002'"),
        (["simulate", "--line-spans", "2"], "A line's spans must be a whole number from 3 to 1000, not 2"),
        (["simulate", "--policy", "own.py:"], "must name a class in the file, as own.py:Name"),
        (["sweep", "speed_kmh=300:300:5"], "speed_kmh has the value 300 twice"),
        (
            ["sweep", "policy.gain=-1", "--policy", "own.py:Own"],
            r"At policy.gain = -1: .*own.py:Own:gain=-1.0'",
        ),
        (["benchmark", "--config", "c.toml"], "key 'lines.1.spans.2' is missing"),
        (
            ["benchmark", "--config", "d.toml"],
            r"key 'seeds' must be a whole number from 1 to 1,000, or a list",
        ),
        (["benchmark", "--config", "e.toml"], "This benchmark has 102,000 passes; the maximum is 100,000"),
        (["benchmark", "--config", "f.toml"], r"'seed' is not known: did you mean 'seeds'\.$"),
        (["benchmark", "--config", "g.toml"], r"key 'lines.1.speeds_kmh' must be a list, such as \[250\]\.$"),
        (
            ["benchmark", "--config", "none.toml"],
            "The benchmark file none.toml does not exist; give a TOML file",
        ),
        (["train", "h.toml"], r"h.toml: unknown algorithm \['ppo'\]: did you mean 'ppo'"),
        (["train", "i.toml"], r"i.toml: \[environment\]: unknown id 3: known are Pantograph-v0"),
        (["train", "j.toml"], "key 'lanes' must be less than or equal to 65536"),
        (["train", "k.toml"], r"lanes x n_steps = 200,000,000 must be at most 50,000,000"),
        (["evaluate", "p", "--seeds", "90000"], "This evaluation has 540,000 passes; the maximum is 100,000"),
        (["list", "p.toml"], "p.toml is not a valid entry: key 'masses' must hold at most 8 values"),
    ],
)
def test_it_is_said_in_one_sentence_what_is_wrong(arguments, message, own, monkeypatch):
    monkeypatch.chdir(own.parent)
    configs = {
        "c": "[[lines]]\nspans = [1]",
        "d": "seeds = -1",
        "e": f"seeds = 1000\npolicies = ['p']\n[[lines]]\nspeeds_kmh = {list(range(100, 151))}",
        "f": "seed = 3",
        "g": "[[lines]]\nspeeds_kmh = 250",
        "h": TRAINING.replace('"ppo"', '["ppo"]'),
        "i": TRAINING.replace('"Pantograph-v0"', "3"),
        "j": TRAINING.replace("lanes = 2", "lanes = 100_000_000"),
        "k": TRAINING + "[hyperparameters]\nn_steps = 100_000_000\n",
    }
    for name, text in configs.items():
        (own.parent / f"{name}.toml").write_text(text)
    dampers = "dampings = [1, 1, 1, 1, 1, 1, 1, 1, 1]\nstiffnesses = [1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    (own.parent / "p.toml").write_text(
        "kind = 'pantograph'\ndescription = ''\nmasses = [1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
        f"contact_stiffness = 5e4\nstatic_force = 70\naerodynamic_coefficient = 0\n{dampers}"
    )
    with pytest.raises(InputError, match=message) as caught:
        command(*arguments)
    assert "\n" not in str(caught.value)


def test_a_sweep_s_line_may_have_more_spans():
    given = {"distance": 700.0, "record_droppers": False}
    (row,) = sweep({"speed_kmh": [300.0]}, line_spans=14, distance=700.0)
    assert row["std"] == simulate(spans=14, **given).summary().std
    assert row["std"] != sweep({"speed_kmh": [300.0]}, line_spans=20, distance=600.0)[0]["std"]
