"""What can't be computed or understood is refused in one sentence, before time is lost."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

import panto_env
from panto_env import InputError, simulate
from panto_env.analysis.sweep import sweep
from panto_env.catalog import load_pantograph
from panto_env.plant.pantograph import build
from panto_env.policies import find_policy

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
"""


def panto(*arguments, folder):
    command = [sys.executable, "-c", "from panto_env.cli import main; main()", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder)


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path / "own.py"


@pytest.fixture
def diverging(monkeypatch):
    """Settings of a run that diverges: a stiff contact that may pull, with nothing that keeps it stable."""
    monkeypatch.setattr(build, "STABILITY_MARGIN", np.inf)
    stiff = load_pantograph("en50318-2002").model_copy(update={"contact_stiffness": 1e6})
    return {"pantograph": stiff, "bilateral": True}


def test_a_run_that_diverges_gives_no_figures(diverging):
    with pytest.raises(InputError, match="diverged, so it has no result; take a time_step below"):
        simulate(**diverging)


def test_an_episode_that_diverges_ends_with_an_error(diverging):
    env = gymnasium.make("panto_env:Pantograph-v0", **diverging)
    env.reset(seed=0)
    still, ended = np.zeros(1, dtype=np.float32), False
    with pytest.raises(InputError, match="diverged"):  # noqa: PT012 - at which step is not known
        while not ended:
            _, _, *ends, _ = env.step(still)
            ended = any(ends)


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
        (":Other", "has no class 'Other': it has Own"),
        (":Own:loss=1", "cannot be made: .*unexpected keyword argument 'loss'"),
    ],
)
def test_what_is_wrong_with_a_policy_s_file_is_said(own, name, message):
    with pytest.raises(InputError, match=message):
        find_policy(f"{own}{name}")


def test_a_policy_s_file_may_be_missing_broken_or_hold_no_policy(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        find_policy(f"{tmp_path}/none.py:Own")
    (tmp_path / "broken.py").write_text("1 / 0")
    with pytest.raises(InputError, match=r"broken.py cannot be run: ZeroDivisionError"):
        find_policy(f"{tmp_path}/broken.py:Own")
    (tmp_path / "hollow.py").write_text("class Own:\n    pass\n")
    with pytest.raises(InputError, match="must have the methods reset and act"):
        find_policy(f"{tmp_path}/hollow.py:Own")


def test_a_policy_that_fails_is_named_with_the_line(own):
    with pytest.raises(InputError, match=r"failed in act, at .*own.py:9: ValueError: the gain is negative"):
        simulate("periodic-stiffness", "three-mass", policy=f"{own}:Own:gain=-1", distance=50.0)


def test_a_sweep_of_millions_is_refused_before_it_begins(tmp_path):
    values = list(np.linspace(200.0, 300.0, 400))
    with pytest.raises(InputError, match="This sweep has 160,000 passes; 100,000 at most"):
        sweep({"speed_kmh": values, "pantograph.masses.0": values})
    done = panto("sweep", "speed_kmh=100:300:10000000", folder=tmp_path)
    assert done.returncode == 2
    assert "10,000,000 values" in done.stderr


def test_a_run_is_saved_as_parquet_or_not_computed_at_all(tmp_path):
    done = panto("simulate", "--output", "run.csv", folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "must end in .parquet" in done.stderr
    assert not list(tmp_path.iterdir())


def test_the_command_says_its_version(tmp_path):
    done = panto("--version", folder=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"panto-env {panto_env.__version__}\n")
