"""The processor that is measured, and what its compiler makes of vectors."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable

import llvmlite.binding
import numpy as np

from ...backend import kernel
from ...backend.vectors import row_access
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


# Adds and multiplies of one step, counted in panto_env/plant/catenary/flexible/wires.py and links.py.
FLOPS_PER_NODE = 15  # displacement 1, lagging displacement 2, differences 2, stencil 8, increment 2
FLOPS_PER_DROPPER = 46  # two differences 2 x 11, extension and tension 8, eight nodes moved 8 x 2
# Numbers that the leapfrog moves to or from the nearest cache for each node: u and d read three nodes ahead,
# u written there, and d read and written at the node.
NUMBERS_PER_NODE = 5
CHAIN = 32
WIDE = 16  # numbers of the vectors of the small loops: as many in single precision as the widest register has
_load, _store = row_access(WIDE)


@kernel
def multiply_add(sums, rounds):
    """Multiply-adds, CHAIN to a number that is read and written once, eight rows of WIDE at a time."""
    factor = _load(sums, 0)
    for _ in range(rounds):
        for i in range(0, sums.shape[0], 8):
            a, b, c, d = _load(sums, i), _load(sums, i + 1), _load(sums, i + 2), _load(sums, i + 3)
            e, f, g, h = _load(sums, i + 4), _load(sums, i + 5), _load(sums, i + 6), _load(sums, i + 7)
            for _ in range(CHAIN):
                a, b = a * factor + factor, b * factor + factor
                c, d = c * factor + factor, d * factor + factor
                e, f = e * factor + factor, f * factor + factor
                g, h = g * factor + factor, h * factor + factor
            _store(sums, i, a)
            _store(sums, i + 1, b)
            _store(sums, i + 2, c)
            _store(sums, i + 3, d)
            _store(sums, i + 4, e)
            _store(sums, i + 5, f)
            _store(sums, i + 6, g)
            _store(sums, i + 7, h)


@kernel
def triad(a, b, c, rounds):
    """C = b + s a, over rows that stay in the nearest cache: three numbers per entry."""
    s = _load(a, 0)
    for _ in range(rounds):
        for i in range(a.shape[0]):
            _store(c, i, _load(b, i) + s * _load(a, i))
        s = s + _load(c, 0)


def _fastest(run: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def measure(
    nodes: int, droppers: int, time_step: float, times_real_time: float, single: bool
) -> dict[str, float]:
    """Limits of one core in the wires' precision, and the kernel that runs ``times_real_time`` beside them.

    nodes: of both wires together. time_step: s.
    """
    real = np.float32 if single else np.float64
    sums, rounds = np.full((32, WIDE), 0.5, dtype=real), 20_000
    multiply_add(sums, 1)
    peak = 2 * CHAIN * sums.size * rounds / _fastest(lambda: multiply_add(sums, rounds), 5)
    a, b, c = (np.full((128, WIDE), 0.5, dtype=real) for _ in range(3))
    triad(a, b, c, 1)
    cache = 3 * a.nbytes * rounds / _fastest(lambda: triad(a, b, c, rounds), 5)
    flops = FLOPS_PER_NODE * nodes + FLOPS_PER_DROPPER * droppers
    moved = NUMBERS_PER_NODE * nodes * a.itemsize
    steps = times_real_time / time_step  # per second
    return {
        "multiply_add": peak / 1e9,  # measured peak of multiply and add in registers (GFLOP/s)
        "cache": cache / 1e9,  # measured traffic of a triad in the nearest cache (GB/s)
        "arithmetic": flops * steps / 1e9,  # of the kernel (GFLOP/s)
        "traffic": moved * steps / 1e9,  # of its leapfrog along the wires (GB/s)
        "bound": time_step / max(flops / peak, moved / cache),  # times real time at the nearer of both limits
    }
