"""The processor that is measured, and what its compiler makes of vectors."""

from __future__ import annotations

import platform

import llvmlite.binding

from ...base.machine import cores

WIDEST = (("avx512f", 512), ("avx", 256), ("neon", 128), ("sse2", 128))
"""Features of a processor, and the bits of their vectors, the widest first."""


def describe() -> dict[str, str | int]:
    """Processor, its family by the compiler's name, bits of its widest vectors, cores; version of Python."""
    features = llvmlite.binding.get_host_cpu_features()
    return {
        "processor": _name(),
        "family": llvmlite.binding.get_host_cpu_name(),
        "vector_bits": next((bits for name, bits in WIDEST if features.get(name)), 64),
        "cores": cores(),
        "python": platform.python_version(),
    }


def _name() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(line.partition(":")[2].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
