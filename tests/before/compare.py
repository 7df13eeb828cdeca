"""Show that two versions of the project give the same results, bit for bit, on this machine.

``python -m tests.before.compare --before COMMIT [--only PATTERN]`` compares a commit with the working tree,
or with another commit (``--after``); exit status 1 if any case differs. Both are installed the same way, each
into a folder of its own, which PYTHONPATH then names, so that its packages and entry points are found before
those of the virtual environment; its kernels are kept beside it. Both record the same cases at the same time.
"""

from __future__ import annotations

import argparse
import fnmatch
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parents[1]

# An editable install finds whatever its checkout has: a module that this version lacks would come from there.
SITE_CUSTOMIZE = """\
import sys

sys.meta_path[:] = [each for each in sys.meta_path if "__editable__" not in getattr(each, "__module__", "")]
"""


@dataclass(frozen=True)
class Version:
    """One installed version."""

    title: str  # for people
    folder: Path
    fixed: bool  # whether it is a commit, which never changes

    @property
    def site(self) -> Path:
        """Folder that holds its packages."""
        return self.folder / "site"

    def environment(self) -> dict[str, str]:
        """Variables of a process that is to run this version."""
        return os.environ | {"PYTHONPATH": str(self.site), "PANTO_CACHE_DIR": str(self.folder / "kernels")}

    def command(self, script: str, *arguments: str | Path) -> list[str]:
        """Command that runs a script of this folder; to be started in ``empty``, under ``environment``."""
        return [sys.executable, str(HERE / script), *map(str, arguments)]

    @property
    def empty(self) -> Path:
        """Folder without a file to run it in: the checkout's own packages must not be found there."""
        folder = self.folder / "empty"
        folder.mkdir(exist_ok=True)
        return folder


@contextmanager
def installed(before: str, after: str | None, keep: Path | None) -> Iterator[tuple[Version, Version]]:
    """Both versions: a commit before; a commit or, if None, the working tree after.

    keep: folder in which they stay for the next time; a temporary one unless given.
    """
    # As an exception, so that all is cleared away.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("Ended by a signal."))
    with tempfile.TemporaryDirectory(prefix="before-") as temporary:
        root = Path(temporary) if keep is None else keep.resolve()
        yield _install(before, root / "before"), _install(after, root / "after")


def _install(commit: str | None, root: Path) -> Version:
    if commit is None:
        version = Version("working tree", root / "working-tree", fixed=False)
        shutil.rmtree(version.folder, ignore_errors=True)
    else:
        full = _git("rev-parse", "--verify", f"{commit}^{{commit}}").decode().strip()
        version = Version(full[:12], root / full, fixed=True)
    if (version.site / "sitecustomize.py").exists():
        return version
    shutil.rmtree(version.site, ignore_errors=True)  # of an installation that was broken off
    version.site.mkdir(parents=True)
    print(f"installing {version.title}", file=sys.stderr)
    # From a copy: setuptools leaves its build folder in the source, and would pack what it finds there.
    with tempfile.TemporaryDirectory(prefix="source-") as source:
        _export(commit, Path(source))
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
        options = ["--no-deps", "--no-build-isolation", "--target", str(version.site)]
        subprocess.run([*pip, *options, source], check=True)
    (version.site / "sitecustomize.py").write_text(SITE_CUSTOMIZE, encoding="utf-8")
    return version


def _export(commit: str | None, folder: Path) -> None:
    """Write a commit's files, or those of the working tree that git does not ignore, into a folder."""
    if commit is not None:
        archive = _git("archive", "--format=tar", commit)
        subprocess.run(["tar", "-x", "-C", str(folder)], input=archive, check=True)
        return
    listed = _git("ls-files", "-z", "--cached", "--others", "--exclude-standard").decode()
    for name in filter(None, listed.split("\0")):
        file = CHECKOUT / name
        if file.is_file():  # git lists a file that was removed until that is committed
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(file, folder / name)


def _git(*arguments: str) -> bytes:
    return subprocess.run(["git", *arguments], cwd=CHECKOUT, check=True, stdout=subprocess.PIPE).stdout


LISTED = 3  # parts that differ, named in the table


@dataclass(frozen=True)
class Comparison:
    """One case of both versions."""

    case: str
    parts: int  # of the older version
    differing: tuple[str, ...]  # parts whose bits differ, or that are gone
    gained: tuple[str, ...]  # parts that the older version did not have: no difference
    largest: float | None  # relative difference of a figure; None where there is none to compare
    at: str  # name of that figure
    failure: str | None = None

    @property
    def same(self) -> bool:
        """Whether all that the older version gave is there, with the same bits."""
        return not self.differing and self.failure is None


def compare(case: str, before: dict[str, Any] | None, after: dict[str, Any] | None) -> Comparison:
    """Compare what a case gave; None where a version has no such case."""
    if before is None or after is None:
        missing = "before" if before is None else "after"
        return Comparison(case, 0, (), (), None, "", f"not recorded {missing}")
    both = (("before", before), ("after", after))
    failures = [f"{when}: {told['failure']}" for when, told in both if told["failure"]]
    old, new = before["parts"], after["parts"]
    differing = tuple(name for name in old if new.get(name) != old[name])
    gained = tuple(name for name in new if name not in old)
    largest, at = None, ""
    for name, figure in before["figures"].items():
        if name not in after["figures"]:
            continue
        other = after["figures"][name]
        size = max(abs(figure), abs(other))
        relative = abs(other - figure) / size if size else 0.0
        if largest is None or relative > largest:
            largest, at = relative, name
    return Comparison(case, len(old), differing, gained, largest, at, "; ".join(failures) or None)


def record(versions: tuple[Version, Version], only: str, quick: bool) -> list[dict[str, Any]]:
    """Recordings of both versions, made side by side; that of a commit is made once in a kept folder."""
    sources = b"".join(path.read_bytes() for path in sorted(HERE.glob("*.py")))
    key = hashlib.sha256(sources + f"{only} {quick}".encode()).hexdigest()[:12]
    files, running = [], []
    for version in versions:
        file = version.folder / f"recording-{key}.json"
        files.append(file)
        if version.fixed and file.exists():
            print(f"{version.title}: recorded earlier", file=sys.stderr)
            continue
        command = version.command("record.py", file, "--only", only, "--title", version.title)
        command += ["--quick"] if quick else []
        running.append(subprocess.Popen(command, env=version.environment(), cwd=version.empty))
    try:
        ended = [process.wait() for process in running]
    finally:
        for process in running:
            process.kill()
    if any(ended):
        sys.exit("A recording did not come to its end.")
    return [json.loads(file.read_text(encoding="utf-8")) for file in files]


def _table(found: list[Comparison]) -> Table:
    table = Table("case", "parts", "same bits?", "largest difference of the figures", "parts that differ")
    for each in found:
        shown = "no figures" if each.largest is None else f"{each.largest:.1e}"
        if each.largest:
            shown += f" ({each.at})"
        named = each.failure or ", ".join(each.differing[:LISTED])
        if len(each.differing) > LISTED:
            named += f", ... ({len(each.differing)} in all)"
        verdict = "yes" if each.same else "[bold red]no"
        table.add_row(escape(each.case), str(each.parts), verdict, escape(shown), escape(named))
    return table


def main() -> None:
    """Record, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", required=True, help="commit of the older version")
    parser.add_argument("--after", help="commit of the newer version; the working tree unless given")
    parser.add_argument("--only", default="*", help="compare the cases whose names this pattern matches")
    parser.add_argument("--quick", action="store_true", help="leave out the slow cases")
    parser.add_argument("--all", action="store_true", help="list all cases, not only those that differ")
    parser.add_argument("--keep", type=Path, help="folder to keep installations, kernels and recordings in")
    given = parser.parse_args()
    with installed(given.before, given.after, given.keep) as versions:
        before, after = record(versions, given.only, given.quick)
    names = [name for name in before | after if fnmatch.fnmatch(name, given.only)]
    found = [compare(name, before.get(name), after.get(name)) for name in names]
    if not found:
        sys.exit(f"No case matches {given.only}.")
    differing = [each for each in found if not each.same]
    console = Console(width=None if sys.stdout.isatty() else 180)
    shown = found if given.all else differing
    if shown:
        console.print(_table(shown))
    gained = sorted({part for each in found for part in each.gained})
    if gained:
        console.print(f"New parts, not compared: {', '.join(gained)}", markup=False)
    if differing:
        console.print("Figures are mean magnitudes of parts: 0 where only some last bits differ.")
    parts = sum(each.parts for each in found)
    titles = f"{versions[0].title} and {versions[1].title}"
    console.print(
        f"{len(found) - len(differing)} of {len(found)} cases ({parts} parts) have the same bits in {titles}."
    )
    sys.exit(bool(differing))


if __name__ == "__main__":
    main()
