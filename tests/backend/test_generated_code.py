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
    """Innermost loops of the control step, compiled anew: a jump back, and no other between it and its aim.

    A loop is of several blocks where the compiler leaves a choice in it: that depends on the processor.
    """
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent), "PANTO_CACHE_DIR": str(cache)}
    result = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, env=environment, check=True
    )
    lines = result.stdout.splitlines()
    start = {match[1]: i for i, line in enumerate(lines) if (match := re.match(r"(\.LBB\w+):", line))}
    jumps = (
        (start.get(match[1], i), i)
        for i, line in enumerate(lines)
        if (match := re.match(r"\s+j\w+\s+(\.LBB\w+)$", line))
    )
    back = [(first, last) for first, last in jumps if first < last]
    return [
        lines[first : last + 1]
        for first, last in back
        if not any(first <= a and b <= last and (a, b) != (first, last) for a, b in back)
    ]


def packed(body, mnemonic):
    """How many such instructions a loop has on vectors of 256 bits or more."""
    return sum(bool(re.match(rf"\s+{mnemonic}\s.*%[yz]mm", line)) for line in body)


def test_sweep_of_the_flexible_wires_is_vectorised(tmp_path):
    """The stencil: ten sums and differences and eight multiply-adds, in a loop of little else.

    Once for wires as they are, once for those from which stitch wires take tension.
    """
    sweeps = [
        body
        for body in loops(tmp_path)
        if packed(body, "v(sub|add)ps") >= 9 and packed(body, r"vfn?m(add|sub)\w+ps") >= 5 and len(body) < 90
    ]
    assert len(sweeps) >= 2
    assert not any(re.match(r"\s+v(sub|add|mul|fn?m\w+)ss\s", line) for body in sweeps for line in body)
