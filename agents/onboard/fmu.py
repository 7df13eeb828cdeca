"""A controller as a co-simulation unit of FMI 2.0 or 3.0, for tools that hold a model of the vehicle.

A unit is an archive: a description in XML, the controller's C with the wrapper in the folder ``wrapper``, and
a shared library made of both.
"""

from __future__ import annotations

import html
import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from panto_env.base.checksums import __version__
from panto_env.base.errors import InputError
from panto_env.base.files import write_whole

from .export import WRAPPER, Exported, rendered

UNITS = {"m": {"m": 1}, "m/s": {"m": 1, "s": -1}, "N": {"kg": 1, "m": 1, "s": -2}, "s": {"s": 1}}
"""Exponents of SI units; a unit that is not here, such as spans, is a count or a share."""
FOLDERS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("linux", "aarch64"): (None, "aarch64-linux"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("darwin", "arm64"): (None, "aarch64-darwin"),
}
"""Folder of a shared library in units of FMI 2.0 and 3.0, by system and processor."""
LIBRARY = {"linux": ".so", "darwin": ".dylib"}
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
EPOCH = (1980, 1, 1, 0, 0, 0)
"""Time of each file in the archive, so that the same controller gives the same bytes."""


def write_fmu(
    exported: Exported, path: str | Path, version: Literal["2.0", "3.0"] = "3.0", binary: bool = True
) -> None:
    """Write a controller as a unit, whole or not at all.

    A tool sets the inputs, lets the unit do a step of one interval (or of several, with the inputs held), and
    gets the outputs: the forces for that very step. binary: include a shared library for this machine; a
    unit of sources alone runs where the tool compiles them. Raises InputError for another version, where
    there is no C compiler, or where it or the file's folder fails.
    """
    if version not in ("2.0", "3.0"):
        raise InputError(f"Units are written for FMI 2.0 and 3.0, not {version}.")
    fmi, name = f"fmi{version[0]}", exported.name
    sources = {each: (WRAPPER / each).read_text() for each in (f"{fmi}.c", f"{fmi}.h", "unit.h")}
    sources |= {f"{name}.c": exported.source, f"{name}.h": exported.header}
    content = "".join(sources.values()) + repr((exported.inputs, exported.outputs, exported.interval))
    given: dict[str, Any] = {"unit": exported, "version": __version__}
    # The name of these very sources, which a tool must give to the library.
    given["token"] = f"{{{uuid.uuid5(uuid.NAMESPACE_OID, content)}}}"
    given["compiled"] = [each for each in sources if each.endswith(".c")]
    units = sorted({"s"} | {each.unit for each in (*exported.inputs, *exported.outputs)})
    given["units"] = {unit: UNITS.get(unit, {}) for unit in units}
    sources["model.h"] = rendered("model.h", given)
    files = {f"sources/{each}": text.encode() for each, text in sources.items()}
    files["modelDescription.xml"] = rendered(f"{fmi}.xml", given).encode()
    if version == "3.0":
        files["sources/buildDescription.xml"] = rendered("build.xml", given).encode()
    page = f"<!doctype html><title>{name}</title><pre>{html.escape(exported.card)}</pre>"
    files["documentation/index.html"] = page.encode()
    if binary:
        folder, suffix = _place(version)
        files[f"binaries/{folder}/{name}{suffix}"] = _compiled(sources, given["compiled"])
    with write_whole(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for each, held in files.items():
            archive.writestr(zipfile.ZipInfo(each, EPOCH), held, zipfile.ZIP_DEFLATED)


def _place(version: str) -> tuple[str, str]:
    """Folder and suffix of a shared library. Raises InputError for a machine that units have none for."""
    machine = platform.machine()
    second, third = FOLDERS.get((sys.platform, machine), (None, None))
    folder = second if version == "2.0" else third
    if folder is None:
        raise InputError(
            f"A unit of FMI {version} has no library for {sys.platform} on {machine}; write its sources "
            "alone (binary=False), which a tool compiles."
        )
    return folder, LIBRARY[sys.platform]


def _compiled(sources: dict[str, str], files: list[str]) -> bytes:
    """The shared library of these files. Raises InputError where no C compiler is, or where it fails."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise InputError(
            "A unit with a library needs a C compiler, cc or gcc, and there is none; install one, or write "
            "its sources alone (binary=False)."
        )
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text)
        command = [compiler, *FLAGS, "-o", "library", *files, "-lm"]
        run_tool(folder, command, f"The C compiler {compiler} could not make the unit's library")
        return (Path(folder) / "library").read_bytes()


def run_tool(folder: str | Path, command: Sequence[str], failed: str) -> str:
    """What a compiler's tool prints in a folder. Raises InputError, with these words, where it fails."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), "it gives no reason")
        raise InputError(f"{failed}: {first}.")
    return done.stdout
