"""Packages of extras: one sentence where one is missing; without PyArrow everything but Parquet works."""

import csv
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import panto_env
from panto_baselines.policies.mpc import quadratic_solver
from panto_env.base.errors import InputError
from panto_env.base.files import check_output
from panto_env.base.table import TABLES
from panto_env.cluster import spread
from panto_env.diagnosis.training import fit
from panto_env.envs import vector_env
from panto_env.render.canvas import Canvas

from ..command import panto

ROOT = Path(panto_env.__file__).parents[1]


def told(*words):
    """What a command that is refused says."""
    done = panto(*words)
    assert (done.returncode, done.stdout) == (2, "")
    raise InputError(done.stderr.strip())


DESIGN = ROOT / "panto_env/studies/design/re250.toml"
MISSING = {
    "agents": ("tensorboard", lambda: told("train", "ppo-quick", "--output", "run")),
    "app": ("bokeh", lambda: told("app", "--no-browser")),
    "control": ("osqp", lambda: quadratic_solver("mpc")),
    "cuda": ("torch", lambda: vector_env(device="cuda")),
    "data": ("minari", lambda: told("dataset", "episodes", "dataset-known-line")),
    "design": ("cmaes", lambda: told("design", DESIGN, "--output", "run")),
    "diagnosis": ("scikit-learn", lambda: fit(np.zeros((2, 1)), np.zeros(2, dtype=int))),
    "onboard": ("onnx", lambda: told("export", "agent-small", "agent.onnx")),
    "parquet": ("pyarrow", lambda: check_output("run.parquet", TABLES)),
    "pettingzoo": ("pettingzoo", lambda: panto_env.parallel_env()),
    "ray": ("ray", lambda: spread([sys.getrecursionlimit], ray="local")),
    "render": ("opencv", lambda: Canvas(8, 8)),
}
"""By extra: a package of it, and what needs it."""
MODULES = {"scikit-learn": "sklearn", "opencv": "cv2"}


@pytest.mark.parametrize("extra", MISSING)
def test_each_extra_is_named_in_the_same_words(extra, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    package, use = MISSING[extra]
    monkeypatch.setitem(sys.modules, MODULES.get(package, package), None)
    with pytest.raises(InputError) as refused:
        use()
    sentence = (
        rf".* needs (.*, )?{package}, which is not installed: pip install 'panto-env\[{extra}\]'(; .*)?\."
    )
    assert re.fullmatch(sentence, str(refused.value)), refused.value
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == []


def test_every_extra_of_users_is_tried_and_its_packages_are_in_it():
    """All calls in the sources name an extra that has what they ask for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert set(MISSING) == set(extras) - {"dev", "docs"}
    calls = [
        (match[1], re.findall(r'"(\w+)"', match[2]))
        for folder in ("panto_env", "baselines", "agents")
        for path in (ROOT / folder).rglob("*.py")
        for match in re.finditer(
            r'\brequire\((?:f?"[^"]*"|[\w()]+), "(\w+)"((?:, "\w+")+)', path.read_text(encoding="utf-8")
        )
    ]
    assert {extra for extra, _ in calls} == set(MISSING)
    names = {"cv2": "opencv-python-headless", "sklearn": "scikit-learn", "h5py": "minari[hdf5]"}
    names |= {"imageio_ffmpeg": "moviepy"}
    for extra, modules in calls:
        for module in modules:
            wanted = names.get(module, module.replace("_", "-"))
            assert any(each.startswith(wanted) for each in extras[extra]), (extra, module)
    rows = re.findall(r"^\| `(\w+)` \|", (ROOT / "docs/install.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == sorted(MISSING)
    assert not any(each.startswith("pyarrow") for each in project["dependencies"])


COMMANDS = (
    "simulate {} --output run.csv --figures figures.xlsx --json",
    "simulate {} --output new.parquet",
    "sweep speed_kmh=200 --output new.parquet",
    "report run.parquet --output page.html",
    "record run.parquet --line en50318-2002",
)
SHORT = "--catenary periodic-stiffness --pantograph three-mass --speed 200 --distance 600"
WITHOUT = """
import json, sys
sys.modules["pyarrow"] = None
from tests.command import panto
done = [panto(*line.split(), cwd=sys.argv[1]) for line in json.loads(sys.argv[2])]
print(json.dumps([(each.returncode, each.stdout, each.stderr) for each in done]))
"""


@pytest.mark.slow
def test_without_pyarrow_all_but_parquet_works_which_is_told_before_any_work(tmp_path):
    (tmp_path / "run.parquet").write_bytes(b"PAR1")
    lines = json.dumps([line.format(SHORT) for line in COMMANDS])
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, tmp_path, lines], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    (status, figures, _), *refused = json.loads(done.stdout)
    assert status == 0
    assert json.loads(figures)
    needs = "needs pyarrow, which is not installed: pip install 'panto-env[parquet]'; "
    written = f"panto: new.parquet {needs}or end it in .csv or .xlsx.\n"
    assert refused == [
        [2, "", written],
        [2, "", written],
        [2, "", f"panto: run.parquet {needs}a run cannot be read from another kind of file.\n"],
        [2, "", f"panto: run.parquet {needs}or give the record as .csv.\n"],
    ]
    assert {path.name for path in tmp_path.iterdir()} == {"run.csv", "figures.xlsx", "run.parquet"}
    with (tmp_path / "run.csv").open(encoding="utf-8") as file:
        assert max(float(row["position (m)"]) for row in csv.DictReader(file)) > 590
