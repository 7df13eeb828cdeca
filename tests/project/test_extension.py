"""What it takes to add a catenary, an actuator, an observation entry, a policy and an argument.

Each is added to a copy of the project: at most one new file and one line. The copy then runs as plain Python,
and, slowly, compiled.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import panto_env

pytestmark = pytest.mark.plain

ROOT = Path(panto_env.__file__).parents[1]
GIVEN = Path(__file__).parents[1] / "extensions"
RAIL = """
kind = "conductor_rail"
description = "a stiff rail"
span_length = 10.0
spans = 10
stiffness = 2e4
"""


@pytest.mark.longer
@pytest.mark.parametrize("plain", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_each_extension_is_at_most_one_new_file_and_one_line(tmp_path, plain):
    unwanted = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "panto_env", tmp_path / "panto_env", ignore=unwanted)
    shutil.copytree(ROOT / "baselines", tmp_path / "panto_baselines", ignore=unwanted)
    # What an installation makes of pyproject.toml; a policy's entry point is a line in it.
    points = tmp_path / "panto_env-0.dist-info" / "entry_points.txt"
    points.parent.mkdir()
    passive = "passive = panto_baselines.policies.feedback:Passive\n"
    points.write_text(f"[panto_env.policies]\n{passive}")
    (points.parent / "METADATA").write_text("Metadata-Version: 2.1\nName: panto-env\nVersion: 0\n")
    for file, place in (
        ("conductor_rail.py", "panto_env/plant/catenary"),
        ("integrating.py", "panto_env/plant/actuators"),
        ("steady.py", "panto_baselines/policies"),
    ):
        shutil.copy(GIVEN / file, tmp_path / place / file)
    bilateral = (
        'bilateral: bool = Field(False, description="let the contact pull, as paper 3\'s equations do")\n'
    )
    comment = '    comment: str = Field("", description="a remark on the run")'
    for file, after, line in (
        ("panto_env/plant/catenary/__init__.py", 'KINDS = [\n    "flexible",\n', '    "conductor_rail",'),
        ("panto_env/plant/actuators/__init__.py", 'KINDS = [\n    "lagged",\n', '    "integrating",'),
        (points, passive, "steady = panto_baselines.policies.steady:Steady"),
        ("panto_env/control/settings.py", bilateral, comment),
    ):
        path = tmp_path / file
        text = path.read_text()
        assert text.count(after) == 1
        path.write_text(text.replace(after, f"{after}{line}\n"))
    entries = tmp_path / "panto_env/control/entries.py"
    entries.write_text(entries.read_text() + (GIVEN / "entry.txt").read_text())
    (tmp_path / "rail.toml").write_text(RAIL)
    environment = {"PYTHONPATH": str(tmp_path), "PANTO_CACHE_DIR": str(tmp_path / "cache"), "COLUMNS": "200"}
    environment = os.environ | environment | {"NUMBA_DISABLE_JIT": str(int(plain))}
    command = [sys.executable, str(GIVEN / "run.py")]
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    *shown, last = result.stdout.splitlines()
    found = json.loads(last)
    assert any("--comment" in line for line in shown)
    assert any("A remark on the run." in line for line in shown)
    assert found["frame_force"] == pytest.approx(100.0 * 0.01 / 0.1)
    assert found["stiffness"] == pytest.approx(2e4, rel=1e-6)
    assert found["nominal force"] == pytest.approx(120.0)
    assert found["last entry"] == "nominal force"
    assert found["policy force"] == pytest.approx(25.0)
    assert found["in signature"]
    assert found["in docstring"]
