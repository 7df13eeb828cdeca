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
from importlib import resources
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from panto_env.base.checksums import __version__
from panto_env.base.errors import InputError
from panto_env.base.files import write_whole

from .export import Exported, Variable

UNITS = {
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "s": {"s": 1},
}
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
    sources = _sources(exported, version)
    files = {f"sources/{name}": text.encode() for name, text in sources.items()}
    files["modelDescription.xml"] = _as_bytes(_description(exported, version, sources))
    if version == "3.0":
        files["sources/buildDescription.xml"] = _as_bytes(_build(exported, sources))
    page = f"<!doctype html><title>{exported.name}</title><pre>{html.escape(exported.card)}</pre>"
    files["documentation/index.html"] = page.encode()
    if binary:
        folder, suffix = _place(version)
        files[f"binaries/{folder}/{exported.name}{suffix}"] = _compiled(sources)
    with write_whole(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), content, zipfile.ZIP_DEFLATED)


def _sources(exported: Exported, version: str) -> dict[str, str]:
    """Files of the folder ``sources`` by name."""
    fmi = f"fmi{version[0]}"
    wrapper = resources.files(__package__) / "wrapper"
    texts = {name: (wrapper / name).read_text() for name in (f"{fmi}.c", f"{fmi}.h", "unit.h")}
    name = exported.name
    texts |= {f"{name}.c": exported.source, f"{name}.h": exported.header}
    content = "".join(texts.values()) + repr((exported.inputs, exported.outputs, exported.interval))
    start = ", ".join(["0.0"] * len(exported.inputs))
    texts["model.h"] = f"""\
/* Names and numbers of the controller that unit.h runs. */
#include "{name}.h"

#define MODEL_STATE {name}_state
#define MODEL_READINGS {name}_readings
#define MODEL_INIT {name}_init
#define MODEL_STEP {name}_step
#define INPUTS {len(exported.inputs)}
#define OUTPUTS {len(exported.outputs)}
#define INTERVAL {exported.interval!r} /* s */
#define TOKEN "{{{uuid.uuid5(uuid.NAMESPACE_OID, content)}}}"
#define START {{{start}}}
"""
    return texts


def _token(sources: dict[str, str]) -> str:
    """The name of these very sources, which a tool must give to the library."""
    return sources["model.h"].partition('TOKEN "')[2].partition('"')[0]


def _description(exported: Exported, version: str, sources: dict[str, str]) -> ElementTree.Element:
    """The file modelDescription.xml."""
    second = version == "2.0"
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion=version,
        modelName=exported.name,
        description="Controller of a pantograph: readings of its sensors in, forces of its actuators out",
        version=__version__,
        generationTool=f"panto-env {__version__}",
        variableNamingConvention="flat",
    )
    root.set("guid" if second else "instantiationToken", _token(sources))
    state = "FMUstate" if second else "FMUState"
    kind = _within(
        root,
        "CoSimulation",
        modelIdentifier=exported.name,
        canHandleVariableCommunicationStepSize="false",
        **{f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"},
    )
    if second:
        kind.set("canNotUseMemoryManagementFunctions", "true")
        files = _within(kind, "SourceFiles")
        for name in _to_compile(sources):
            _within(files, "File", name=name)
    else:
        kind.set("fixedInternalStepSize", repr(exported.interval))
    units = _within(root, "UnitDefinitions")
    for unit in sorted({"s"} | {each.unit for each in (*exported.inputs, *exported.outputs)}):
        powers = {base: str(power) for base, power in UNITS.get(unit, {}).items()}
        _within(_within(units, "Unit", name=unit), "BaseUnit", **powers)
    _within(_within(root, "LogCategories"), "Category", name="logStatusError")
    _within(root, "DefaultExperiment", startTime="0.0", stepSize=repr(exported.interval))
    _variables(root, exported, second)
    return root


def _variables(root: ElementTree.Element, exported: Exported, second: bool) -> None:
    """Variables and the structure; FMI 3.0 counts the time as one of them."""
    variables = _within(root, "ModelVariables")

    def add(reference: int, each: Variable, causality: str, **start: str) -> None:
        given = {"name": each.name, "valueReference": str(reference), "description": each.description}
        given |= {"causality": causality, "variability": "continuous"}
        if second:
            _within(_within(variables, "ScalarVariable", **given), "Real", unit=each.unit, **start)
        else:
            _within(variables, "Float64", **given, unit=each.unit, **start)

    if not second:
        add(0, Variable("time", "s", "Time"), "independent")
    for reference, each in enumerate(exported.inputs, start=1):
        add(reference, each, "input", start="0.0")
    first = 1 + len(exported.inputs)
    references = range(first, first + len(exported.outputs))
    for reference, each in zip(references, exported.outputs, strict=True):
        add(reference, each, "output")
    structure = _within(root, "ModelStructure")
    # Outputs move only in a step, and are 0 N before the first one: at no point do they follow an input.
    for title in ("Output", "InitialUnknown"):
        group = _within(structure, f"{title}s") if second else structure
        for reference in references:
            if second:
                _within(group, "Unknown", index=str(reference), dependencies="")
            else:
                _within(group, title, valueReference=str(reference), dependencies="")


def _build(exported: Exported, sources: dict[str, str]) -> ElementTree.Element:
    """The file buildDescription.xml of FMI 3.0: what a tool compiles."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    build = _within(root, "BuildConfiguration", modelIdentifier=exported.name)
    files = _within(build, "SourceFileSet", language="C99")
    for name in _to_compile(sources):
        _within(files, "SourceFile", name=name)
    return root


def _to_compile(sources: dict[str, str]) -> list[str]:
    return [name for name in sources if name.endswith(".c")]


def _within(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _as_bytes(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    content: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return content


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


def _compiled(sources: dict[str, str]) -> bytes:
    """The shared library. Raises InputError where there is no C compiler, or where it fails."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise InputError(
            "A unit with a library needs a C compiler, cc or gcc, and there is none; install one, or write "
            "its sources alone (binary=False)."
        )
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text)
        command = [compiler, *FLAGS, "-o", "library", *_to_compile(sources), "-lm"]
        run_tool(folder, command, f"The C compiler {compiler} could not make the unit's library")
        return (Path(folder) / "library").read_bytes()


def run_tool(folder: str | Path, command: Sequence[str], failed: str) -> str:
    """What a compiler's tool prints in a folder. Raises InputError, with these words, where it fails."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), "it gives no reason")
        raise InputError(f"{failed}: {first}.")
    return done.stdout
