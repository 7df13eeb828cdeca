"""The loops that the speed rests on became vector instructions."""

import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import llvmlite.binding
import pytest

import panto_env

PACKAGE = Path(panto_env.__file__).parent
# Numba can't show the code of kernels that it read from disk, so a fresh process compiles them anew.
CODE = """
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.control.step import control_steps
Task(run_settings({}))
(assembly,) = control_steps.inspect_asm().values()
print(assembly)
"""
FEATURES = llvmlite.binding.get_host_cpu_features()
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        platform.machine() not in ("x86_64", "AMD64") or not (FEATURES.get("avx2") and FEATURES.get("fma")),
        reason="the instructions looked for are those of x86-64 processors with AVX2 and FMA",
    ),
]


def loops(cache):
    """Innermost loops of the control step, compiled anew: blocks that jump back to their own label."""
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent), "PANTO_CACHE_DIR": str(cache)}
    result = subprocess.run(
        [sys.executable, "-c", CODE],
        capture_output=True,
        text=True,
        env=environment,
        check=True,
    )
    blocks = re.split(r"^(\.LBB\w+):", result.stdout, flags=re.MULTILINE)
    return [
        body
        for label, body in zip(blocks[1::2], blocks[2::2], strict=True)
        if re.search(rf"^\s+j\w+\s+{re.escape(label)}$", body, re.MULTILINE)
    ]


def packed(body, mnemonic):
    """How many such instructions a loop has on vectors of 256 bits or more."""
    return len(re.findall(rf"^\s+{mnemonic}\s.*%[yz]mm", body, re.MULTILINE))


def test_sweep_of_the_flexible_wires_is_vectorised(tmp_path):
    """The stencil: five differences, and multiply-adds; with and without masses on the wire."""
    sweeps = [
        body
        for body in loops(tmp_path)
        if packed(body, "vsubps") >= 5 and packed(body, r"vfn?madd\w+ps") >= 2
    ]
    assert len(sweeps) >= 2
