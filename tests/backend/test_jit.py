"""Kernels are compiled once, and never run stale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import panto_env
from panto_env.backend import JIT, kernel
from panto_env.plant.pantograph.step import contact_force

PACKAGE = Path(panto_env.__file__).parent
CODE = """
import time, numpy as np
from panto_env import simulate
from panto_env.control import step
run = simulate("periodic-stiffness", "three-mass", 200, distance=20.0)
hits = sum(step.control_steps.stats.cache_hits.values())
print(hits, repr(float(run.contact_force.sum())))
"""


def run(root, cache):
    """Cache hits and a sum of contact forces, by the package under ``root`` in a fresh process."""
    environment = os.environ | {"PYTHONPATH": str(root), "PANTO_CACHE_DIR": str(cache)}
    result = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, env=environment, cwd=root, check=True
    )
    hits, total = result.stdout.split()
    return int(hits), float(total)


@pytest.mark.slow
def test_an_edit_of_a_kernel_s_source_is_seen_and_any_other_compiles_nothing(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "panto_env", ignore=shutil.ignore_patterns("__pycache__"))
    cache = tmp_path / "cache"
    first = run(tmp_path, cache)
    again = run(tmp_path, cache)
    assert first[0] == 0
    assert again == (1, first[1])
    # No kernel is made of the command line.
    command = tmp_path / "panto_env" / "cli" / "__init__.py"
    command.write_text(command.read_text() + "# a comment\n")
    assert run(tmp_path, cache) == again
    # The contact law lies in another file than the kernel that is kept on disk.
    law = tmp_path / "panto_env" / "plant" / "pantograph" / "step.py"
    source = law.read_text()
    assert "return max(force, lowest)" in source
    law.write_text(source.replace("max(force, lowest)", "max(2.0 * force, lowest)"))
    hits, total = run(tmp_path, cache)
    assert hits == 0
    assert abs(total - first[1]) > 1.0
    law.write_text(source)
    assert run(tmp_path, cache) == (1, first[1])


@pytest.mark.skipif(not JIT, reason="plain Python calls any function")
def test_a_part_of_kernels_is_not_called_by_itself():
    """It has no machine code: what Numba keeps in its place must never answer."""
    with pytest.raises(TypeError, match="contact_force is a part of kernels"):
        contact_force(1e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert law(1e-5, 2e-5) == pytest.approx(2.0)
    with pytest.raises(TypeError, match="contact_force is a part of kernels"):
        contact_force(1e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def law(compliance, gap):
    return contact_force(compliance, gap, 0.0, 0.0, 0.0, 0.0, 0.0)
