"""A copy of the checkout in which mutants are made and tests are run, away from the checkout itself."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .mutant import Mutant

ROOT = Path(__file__).parents[2]
TIME_LIMIT = 900
"""Seconds after which tests count as failed: a mutant may run forever."""
PACKAGES = {"panto_baselines": "baselines", "panto_agents": "agents", "panto_configs": "configs"}
"""Names of packages whose folders have other ones (see pyproject.toml)."""
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


@dataclass(frozen=True)
class Outcome:
    """What a run of tests came to."""

    failed: str  # the first test that failed, or ""
    seconds: float
    output: str


class Workbench:
    """One copy; it is used by one run of tests at a time."""

    def __init__(self, folder: Path) -> None:
        """Copy the files that Git tracks, or would track, into an empty folder."""
        self.root = folder / "checkout"
        self._kernels, self._mutant_kernels = folder / "kernels", folder / "mutant-kernels"
        listing = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for name in filter(None, listing.split("\0")):
            if (ROOT / name).is_file():
                (self.root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.root / name)
        for package, name in PACKAGES.items():
            (self.root / package).symlink_to(name)

    def check(self, tests: Sequence[str], plain: bool) -> Outcome:
        """Run tests on the source as it is; plain: without compiling kernels."""
        return self._pytest(tests, self._kernels, plain)

    def judge(self, mutant: Mutant, tests: Sequence[str]) -> Outcome:
        """Run tests on a mutant until one fails, and leave the copy as it was."""
        text = mutant.apply(self.root)
        try:
            if not (mutant.kernels or mutant.plain):
                self._take_over_kernels()
            return self._pytest(tests, self._mutant_kernels, mutant.plain)
        finally:
            mutant.undo(self.root, text)
            shutil.rmtree(self._mutant_kernels, ignore_errors=True)

    def _take_over_kernels(self) -> None:
        """Take the compiled kernels of the source as it is, though their folder is named after all files."""
        for compiled in self._kernels.iterdir():
            source = "from panto_env.backend.cache import cache_folder; print(cache_folder())"
            folder = self._python(["-c", source], self._mutant_kernels, 60).stdout.strip()
            shutil.copytree(compiled, folder, dirs_exist_ok=True)

    def _pytest(self, tests: Sequence[str], kernels: Path, plain: bool) -> Outcome:
        start = time.monotonic()
        arguments = ["-m", "pytest", "-x", "-q", "-rfE", "-p", "no:cacheprovider", "--tb=short", *tests]
        try:
            done = self._python(arguments, kernels, TIME_LIMIT, plain)
        except subprocess.TimeoutExpired:
            return Outcome(f"no end within {TIME_LIMIT} s", TIME_LIMIT, "")
        output = done.stdout + done.stderr
        failed = FAILED.search(output)
        if (done.returncode == 0) == (failed is not None) or done.returncode > 2:
            raise RuntimeError(f"pytest ended with {done.returncode}:\n{output[-4000:]}")
        return Outcome(failed[1] if failed else "", time.monotonic() - start, output)

    def _python(
        self, arguments: Sequence[str], kernels: Path, limit: float, plain: bool = False
    ) -> subprocess.CompletedProcess[str]:
        # Bytecode would be stale where a file changes twice within a second and keeps its size.
        environment = os.environ | {
            "PYTHONPATH": str(self.root),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PANTO_CACHE_DIR": str(kernels),
            "NUMBA_DISABLE_JIT": str(int(plain)),
        }
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.root,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit,
        )
