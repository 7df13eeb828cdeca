"""The usual forms of kernels, compiled beforehand and side by side.

``python -m tests.known_kernels`` compiles what most tests need, so that these do not wait for one another.
``python -m tests.known_kernels --wheel FOLDER`` builds a wheel with what users need first, compiled for every
processor of its class (``make wheel``).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tarfile
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from filelock import FileLock

from panto_env.backend.kept_kernels import BROUGHT, CLASS
from panto_env.base.machine import cores

ROOT = Path(__file__).resolve().parents[1]
BEGIN = """
import warnings
import gymnasium
from panto_env import simulate
warnings.simplefilter("ignore")
def make(name, **settings):
    env = gymnasium.make(f"panto_env:{name}", **settings)
    env.reset(seed=0)
    env.step(env.action_space.sample())
two = {"pantographs": ["dsa380", "dsa380"], "distances": [100.0]}
"""
USUAL = (
    "make('Pantograph-v0')",
    "make('Pantograph-v0', **two)",
    "make('PantographStiffness-v0')",
    "make('PantographThreeSpan-v0')",
)
"""Statements whose kernels quick tests need."""
FIRST = (*USUAL, "simulate(precision='double')")
"""Statements whose kernels users need first."""


def compile_all(statements: tuple[str, ...], environment: dict[str, str]) -> None:
    """Run statements in processes of their own, as many at a time as there are cores."""

    def run(statement: str) -> None:
        subprocess.run([sys.executable, "-c", BEGIN + statement], check=True, env=os.environ | environment)

    with ThreadPoolExecutor(cores()) as processes:
        list(processes.map(run, statements))


BUILDING = FileLock(Path(tempfile.gettempdir()) / "panto-env-build.lock")
"""Held while sources are packed, which writes into the checkout: two at once are in each other's way."""


def build_wheel(folder: Path, statements: tuple[str, ...] = FIRST) -> None:
    """Build a wheel of the packed sources with the kernels of these statements."""
    own = [sys.executable, "-m", "build", "--no-isolation"]
    with tempfile.TemporaryDirectory() as made:
        with BUILDING:
            subprocess.run([*own, "--sdist", "--outdir", made, ROOT], check=True, stdout=subprocess.DEVNULL)
        (packed,) = Path(made).glob("*.tar.gz")
        with tarfile.open(packed) as sources:
            sources.extractall(made, filter="data")
        unpacked = packed.with_name(packed.name.removesuffix(".tar.gz"))
        cache = unpacked / BROUGHT.relative_to(ROOT)
        compile_all(
            statements, {"PANTO_CACHE_DIR": str(cache), "NUMBA_CPU_NAME": CLASS, "NUMBA_CPU_FEATURES": ""}
        )
        for each in (*cache.glob("*/*.lock"), *cache.glob("hashes/*")):
            each.unlink()
        subprocess.run([*own, "--wheel", "--outdir", folder, unpacked], check=True, stdout=subprocess.DEVNULL)


def main() -> None:
    """Compile what tests need, or build a wheel."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheel", type=Path, help="folder of a wheel to be built")
    folder = parser.parse_args().wheel
    if folder:
        build_wheel(folder)
    else:
        compile_all(USUAL, {})


if __name__ == "__main__":
    main()
