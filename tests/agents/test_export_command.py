"""`panto export` by the suffix of its file: units and networks."""

from __future__ import annotations

import shutil

import pytest
from typer.testing import CliRunner

from panto_env import InputError
from panto_env.cli import make_app

fmpy = pytest.importorskip("fmpy")
onnx = pytest.importorskip("onnx")


def export(*arguments):
    """What the command prints. Raises as it does."""
    done = CliRunner().invoke(make_app(), ["export", *map(str, arguments)])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_a_unit_of_a_policy_for_a_line(tmp_path):
    path = tmp_path / "damper.fmu"
    told = export("guarded:pd", path, "--catenary", "re330", "--pantograph", "dsa380")
    assert "contact_force" in told
    description = fmpy.read_model_description(path)
    assert (description.fmiVersion, description.modelName) == ("3.0", "damper")
    names = [each.name for each in description.modelVariables if each.causality == "input"]
    assert names[:5] == [
        "head_displacement",
        "frame_displacement",
        "head_velocity",
        "frame_velocity",
        "contact_force",
    ]
    result = fmpy.simulate_fmu(str(path), stop_time=1.0, start_values={"contact_force": 120.0})
    assert abs(result["frame_force"]).max() <= 100.0


def test_a_network_of_a_policy(tmp_path):
    export("agent-high-speed", tmp_path / "network.onnx")
    assert onnx.load(tmp_path / "network.onnx").graph.input[0].name == "observation"


def test_a_network_takes_no_line(tmp_path):
    with pytest.raises(InputError, match="holds nothing of line"):
        export("agent-high-speed", tmp_path / "network.onnx", "--catenary", "re330")


def test_what_is_no_network_is_refused(tmp_path):
    with pytest.raises(InputError, match="export it as C instead"):
        export("pd", tmp_path / "network.onnx")
    assert not list(tmp_path.iterdir())
