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


class Copy:
    """A copy of the project, and what was done to it."""

    def __init__(self, folder):
        self.folder = folder
        unwanted = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "panto_env", folder / "panto_env", ignore=unwanted)
        shutil.copytree(ROOT / "baselines", folder / "panto_baselines", ignore=unwanted)
        # What an installation makes of pyproject.toml; a policy's entry point is a line in it.
        points = folder / "panto_env-0.dist-info" / "entry_points.txt"
        points.parent.mkdir()
        points.write_text("[panto_env.policies]\npassive = panto_baselines.policies.feedback:Passive\n")
        (points.parent / "METADATA").write_text("Metadata-Version: 2.1\nName: panto-env\nVersion: 0\n")

    def new_file(self, name, place):
        shutil.copy(GIVEN / name, self.folder / place / name)

    def new_line(self, place, after, line):
        path = self.folder / place
        text = path.read_text()
        assert text.count(after) == 1
        path.write_text(text.replace(after, f"{after}{line}\n"))

    def run(self, plain):
        (self.folder / "rail.toml").write_text(RAIL)
        environment = os.environ | {
            "PYTHONPATH": str(self.folder),
            "PANTO_CACHE_DIR": str(self.folder / "cache"),
            "NUMBA_DISABLE_JIT": str(int(plain)),
            "COLUMNS": "200",
        }
        command = [sys.executable, str(GIVEN / "run.py")]
        result = subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )
        assert result.returncode == 0, result.stderr
        *shown, last = result.stdout.splitlines()
        return "\n".join(shown), json.loads(last)


@pytest.mark.parametrize("plain", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_each_extension_is_at_most_one_new_file_and_one_line(tmp_path, plain):
    copy = Copy(tmp_path)
    copy.new_file("conductor_rail.py", "panto_env/plant/catenary")
    copy.new_line(
        "panto_env/plant/catenary/__init__.py", 'KINDS = [\n    "flexible",\n', '    "conductor_rail",'
    )
    copy.new_file("integrating.py", "panto_env/plant/actuators")
    actuators = "panto_env/plant/actuators/__init__.py"
    copy.new_line(actuators, 'KINDS = [\n    "lagged",\n', '    "integrating",')
    entries = copy.folder / "panto_env/control/entries.py"
    entries.write_text(entries.read_text() + (GIVEN / "entry.txt").read_text())
    copy.new_file("steady.py", "panto_baselines/policies")
    copy.new_line(
        "panto_env-0.dist-info/entry_points.txt",
        "passive = panto_baselines.policies.feedback:Passive\n",
        "steady = panto_baselines.policies.steady:Steady",
    )
    copy.new_line(
        "panto_env/control/settings.py",
        "    bilateral: bool = Field(False, description="
        '"let the contact pull, as paper 3\'s equations do")\n',
        '    comment: str = Field("", description="a remark on the run")',
    )
    shown, found = copy.run(plain)
    assert "--comment" in shown
    assert "A remark on the run." in shown
    assert found["frame_force"] == pytest.approx(100.0 * 0.01 / 0.1)
    assert found["stiffness"] == pytest.approx(2e4, rel=1e-6)
    assert found["nominal force"] == pytest.approx(120.0)
    assert found["last entry"] == "nominal force"
    assert found["policy force"] == pytest.approx(25.0)
    assert found["in signature"]
    assert found["in docstring"]
