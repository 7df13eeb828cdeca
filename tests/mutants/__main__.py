"""Share of generated mutants that the tests notice, room by room: `make mutants SAMPLE=200 SEED=1`.

In a copy of the checkout the tests of a room run once under coverage, which tells the tests that reach a
statement. A mutant of it is killed if one of these fails or hangs. One that no test reaches survives.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from coverage import CoverageData

from .draw import Mutant, draw

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "panto_env": "panto_env",
    **{f"panto_{name}": name for name in ("agents", "baselines", "configs")},
}
OF_EVERY_ROOM = "tests/project/test_defaults.py"
KERNEL = re.compile(r"^@(kernel|inlined|implements)\b", re.MULTILINE)
LEFT_OUT = shutil.ignore_patterns(".git", ".venv*", "__pycache__", "runs", "build", "_build", ".*_cache")


class Workbench:
    """A copy of the checkout, and how tests run in it."""

    def __init__(self, folder: Path, python: str, room: dict[str, Any]) -> None:
        self.root, self.python = folder / "checkout", python
        self.room = {"translated": ()} | room | {"tests": [*room["tests"], OF_EVERY_ROOM]}
        shutil.copytree(ROOT, self.root, ignore=LEFT_OUT)
        (folder / "names").mkdir()
        for name, source in PACKAGES.items():
            (folder / "names" / name).symlink_to(self.root / source)
        self.kernels = folder / "kernels"
        self.environment = os.environ | {
            "PYTHONPATH": str(folder / "names"),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PANTO_CACHE_DIR": str(self.kernels),
        }
        if room.get("plain"):
            self.environment["NUMBA_DISABLE_JIT"] = "1"
        self.marks = "not slow and not study" + " and plain" * room.get("plain", False)
        self.data = CoverageData(str(folder / "coverage"))

    def _python(self, *words: str, seconds: float | None = None) -> subprocess.CompletedProcess[str]:
        outputs = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        call = [self.python, *words]
        return subprocess.run(call, cwd=self.root, env=self.environment, timeout=seconds, **outputs)

    def cover(self) -> None:
        """Run the room's tests once, and keep which of them reaches which line."""
        options = self.root.parent / "coveragerc"
        options.write_text(
            f"[run]\ndynamic_context = test_function\ndata_file = {self.data.data_filename()}\n"
        )
        measured = [
            "-m",
            "coverage",
            "run",
            f"--rcfile={options}",
            f"--source={','.join(self.room['sources'])}",
        ]
        # Where files cannot grow, coverage cannot write its own.
        left_out = f"--ignore={self.root / 'tests/base/test_files_full_disk.py'}"
        done = self._python(*measured, "-m", "pytest", "-q", "-m", self.marks, left_out, *self.room["tests"])
        failed = re.findall(r"^(?:FAILED|ERROR) (\S+::\S+)", done.stdout, re.MULTILINE)
        if done.returncode and not failed:
            raise SystemExit(f"The tests do not run:\n{done.stdout[-2000:]}")
        for name in failed:
            print(f"fails without any mutant, so it is left out: {name}", flush=True)
        self.left_out = [f"--deselect={name}" for name in failed]
        self.kept = self.kernels / self._kernel_hash()
        self.data.read()

    def keep_kernels(self) -> None:
        """Let compiled kernels serve the sources as they are now: only files without kernels are mutated."""
        now = self.kernels / self._kernel_hash()
        if self.kept.exists() and not now.exists():
            self.kept.rename(now)
        self.kept = now

    def _kernel_hash(self) -> str:
        """Name of the folder of these sources' kernels; tests that check indices have one of their own."""
        name = "from panto_env.backend.cache import kernel_hash; print(kernel_hash())"
        return self._python("-c", name).stdout.split("\n")[0]

    def tests_of(self, mutant: Mutant) -> list[str]:
        """The tests that reach a mutant; all of the room where a fixture does, or where it becomes C."""
        by_line = self.data.contexts_by_lineno(str(mutant.path))
        found = {context for line in mutant.lines for context in by_line.get(line, ())}
        tests = [_node(context) for context in sorted(found - {""})]
        translated = any(mutant.path.is_relative_to(self.root / each) for each in self.room["translated"])
        return tests + self.room["tests"] * ("" in found or (translated and not found))

    def kills(self, mutant: Mutant) -> bool:
        """Whether one of the tests that reach a mutant fails, or hangs."""
        if not (tests := self.tests_of(mutant)):
            return False
        mutant.path.write_text(mutant.after, encoding="utf-8")
        if not self.room.get("plain"):
            self.keep_kernels()
        try:
            done = self._python(
                "-m", "pytest", "-q", "-x", "-m", self.marks, *self.left_out, *tests, seconds=600
            )
            if "ERROR: not found" in done.stdout:
                raise SystemExit(done.stdout)
            return done.returncode != 0
        except subprocess.TimeoutExpired:
            return True
        finally:
            mutant.path.write_text(mutant.before, encoding="utf-8")


def _node(context: str) -> str:
    """The name that pytest has for a test of coverage's: tests.room.test_file.TestClass.test_name."""
    parts = context.split(".")
    file = next(k for k, part in enumerate(parts) if part.startswith("test_")) + 1
    return "::".join(["/".join(parts[:file]) + ".py", *parts[file:]])


def judge(name: str, room: dict[str, Any], count: int, seed: int, python: str) -> tuple[int, int]:
    """Print the survivors of a room's mutants; how many were killed, and how many there were."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        bench, killed = Workbench(Path(folder), python, room), 0
        paths = sorted(path for source in room["sources"] for path in (bench.root / source).rglob("*.py"))
        # Coverage sees nothing of compiled kernels; all else is tested with kernels compiled.
        plain = room.get("plain", False)
        paths = [path for path in paths if bool(KERNEL.search(path.read_text(encoding="utf-8"))) == plain]
        mutants = draw(paths, count, seed)
        bench.cover()
        for mutant in mutants:
            killed += (dead := bench.kills(mutant))
            print("killed" if dead else f"survives: {mutant.diff(bench.root)}", flush=True)
    print(f"{name}: {killed} of {len(mutants)} killed, {killed / max(1, len(mutants)):.0%}", flush=True)
    return killed, len(mutants)


def main() -> None:
    """Judge all rooms, or those that are named."""
    rooms = tomllib.loads((Path(__file__).parent / "rooms.toml").read_text())
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", nargs="*", choices=[[], *rooms], metavar="ROOM", help=", ".join(rooms))
    parser.add_argument("--sample", type=int, default=200, help="mutants in all rooms together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--python", required=True, help="Python of the environment that the tests run in")
    given = parser.parse_args()
    names = given.rooms or list(rooms)
    counts = [
        judge(name, rooms[name], given.sample // len(names), given.seed, given.python) for name in names
    ]
    killed, drawn = (sum(column) for column in zip(*counts, strict=True))
    print(f"all: {killed} of {drawn} killed, {killed / drawn:.0%}")


if __name__ == "__main__":
    main()
