"""Two versions of the project, installed the same way side by side: a commit and the working tree.

Each goes into a folder of its own, which PYTHONPATH then names, so that its packages and entry points are
found before those of the virtual environment; its kernels are kept beside it.
"""

from __future__ import annotations

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
    signal.signal(signal.SIGTERM, _end)
    with tempfile.TemporaryDirectory(prefix="before-") as temporary:
        root = Path(temporary) if keep is None else keep.resolve()
        yield _install(before, root / "before"), _install(after, root / "after")


def _end(*_: object) -> None:
    sys.exit("Ended by a signal.")  # as an exception, so that all is cleared away


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
