"""Every command line of the table ends with 0, or with 2 and one sentence: never otherwise.

`python -m tests.fuzz.command_lines --count 400` tries as many of them, those by hand and others evenly
chosen, each in a process of its own, and says how they ended; without --count all.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import re
import shutil
import sys
import tempfile
import threading
from collections import Counter
from contextlib import suppress
from functools import partial
from pathlib import Path

from panto_env import simulate
from panto_env.cli import main as panto

from .files import write_files, write_made_files
from .lines import BY_HAND, USUAL, command_lines
from .processes import End, run_all

LIMIT = 120.0
"""Seconds that a command line may take: processes that import PyTorch take one minute on two busy cores."""
WARNING = "panto: warning: "
BAD = "BAD: "


def judged(end: End) -> str:
    """What kind of end it is; those that begin with BAD must not be."""
    lines = [line for line in end.errors.splitlines() if not line.startswith(WARNING)]
    if end.status is None:
        return f"{BAD}not ended in time"
    if end.status < 0:
        return f"{BAD}killed by signal {-end.status}"
    if "Traceback" in end.errors:
        return f"{BAD}traceback"
    if end.status == 0:
        return "done"
    if end.status == 1 and ("It has no figures." in end.output or '"terminated": true' in end.output):
        return "ended early, as it says"
    if end.status != 2:
        return f"{BAD}status {end.status}"
    if len(lines) != 1 or not re.fullmatch(r"panto: .*[.?!]", lines[0]):
        return f"{BAD}not one sentence"
    return "refused in one sentence"


def chosen(count: int | None) -> list[tuple[str, ...]]:
    """So many command lines: those by hand first, or some of them, the others evenly from all."""
    lines = command_lines()
    first = BY_HAND if count is None or count >= 2 * len(BY_HAND) else _evenly(BY_HAND, count // 2)
    rest = lines[len(BY_HAND) :]
    return [*first, *(rest if count is None else _evenly(rest, count - len(first)))]


def _evenly(lines: list[tuple[str, ...]] | tuple[tuple[str, ...], ...], count: int) -> list[tuple[str, ...]]:
    return [lines[k * len(lines) // count] for k in range(min(count, len(lines)))]


def run_line(line: tuple[str, ...], files: Path, folder: Path) -> None:
    """Run it here, in a new folder that has all files and is the user's home."""
    own = Path(tempfile.mkdtemp(dir=folder, prefix="home-"))
    shutil.copytree(files, own, dirs_exist_ok=True)
    os.chdir(own)
    os.environ |= {"HOME": str(own), "MINARI_DATASETS_PATH": str(own / "data"), "COLUMNS": "120"}
    sys.argv = ["panto", *line]
    try:
        panto()
    finally:
        shutil.rmtree(own, ignore_errors=True)


def prepare(files: Path) -> None:
    """Write the files, load kernels and libraries, so that no case has to: it has them from this process."""
    write_files(files)
    write_made_files(files)
    simulate("periodic-stiffness", "three-mass", policy="p", distance=100.0)
    simulate(distance=60.0)
    for module in ("matplotlib.pyplot", "torch", "stable_baselines3"):
        with suppress(ImportError):
            importlib.import_module(module)
    assert threading.active_count() == 1  # a process with threads is not to be forked


def main() -> None:
    """Try them, tell each end that is bad, then how many there were of each kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, help="how many; all by default")
    parser.add_argument("--usual", action="store_true", help="those without a bad option, which must succeed")
    parser.add_argument("--folder", type=Path, help="where to work, instead of the temporary folder")
    parser.add_argument("--only", default="", help="those alone that have this text")
    parser.add_argument("--all", action="store_true", help="tell every end")
    given = parser.parse_args()
    usual = [(*command, *words) for command, words in USUAL.items()]
    lines = [line for line in (usual if given.usual else chosen(given.count)) if given.only in " ".join(line)]
    ends: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(dir=given.folder) as name:
        folder = Path(name)
        files = folder / "files"
        files.mkdir()
        prepare(files)
        for number, end in run_all([partial(run_line, line, files, folder) for line in lines], folder, LIMIT):
            kind = judged(end)
            if given.usual and kind != "done":
                kind = f"{BAD}{kind}"
            ends[kind] += 1
            if given.all or kind.startswith(BAD):
                words = [word if len(word) < 100 else f"{word[:100]}..." for word in lines[number]]
                told = {"kind": kind, "line": words, "seconds": round(end.seconds, 1)}
                print(json.dumps(told | {"errors": end.errors[-1500:]}), flush=True)
    print(json.dumps(dict(ends)))
    sys.exit(any(kind.startswith(BAD) for kind in ends))


if __name__ == "__main__":
    main()
