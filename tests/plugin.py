"""An installed package of somebody else's, with entry points of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest


def install(folder: Path, points: Mapping[str, Mapping[str, str]], modules: Mapping[str, str]) -> None:
    """Write a distribution into a folder: entry points by group and name, and modules by name."""
    info = folder / "plugin-1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: plugin\nVersion: 1\n")
    text = "\n".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in named.items())
        for group, named in points.items()
    )
    (info / "entry_points.txt").write_text(text)
    for name, source in modules.items():
        (folder / f"{name}.py").write_text(source)


def on_path(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process, and those that it starts, find what is installed in a folder."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=":")
