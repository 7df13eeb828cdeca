"""The identified pantograph as a TOML file of the catalogue's form."""

from __future__ import annotations

import json
from pathlib import Path

from ..base.errors import InputError
from ..base.files import check_output, write_whole
from .fit import Fit

SUFFIXES = (".toml",)
"""Of the file that a pantograph is written to."""


def write_pantograph(
    fit: Fit, path: str | Path, *, record: str, static_force: float, force_source: str
) -> None:
    """Write what ``panto simulate --pantograph`` takes, whole or not at all.

    record: name of the record, for the sources. static_force: lifting force (N), and where it is from.
    Raises InputError for a file that is not .toml, and for parameters that no pantograph can have.
    """
    check_output(path, SUFFIXES)
    p = fit.parameters
    impossible = [name for name, value in p.items() if not (value > 0 if name[0] == "m" else value >= 0)]
    if impossible:
        shown = ", ".join(f"{name} = {p[name]:.4g}" for name in impossible)
        raise InputError(
            f"The {fit.method} found {shown}: no pantograph has that, so none is written; take a record that "
            "determines it, another --method, or give its value with --measured."
        )
    if not static_force >= 0:
        raise InputError(f"The static force must be 0 N or above, not {static_force:g}.")

    def source(*names: str) -> str:
        parts = []
        for name in names:
            if name in fit.names:
                parts.append(f"{name} identified from {record} (RSD {fit.rsd[fit.names.index(name)]:.3g} %)")
            else:
                parts.append(f"{name} measured")
        return "; ".join(parts)

    description = f"Identified from {record} by {fit.method}; two masses, no aerodynamic uplift."
    lines = [
        'kind = "pantograph"',
        f"description = {_text(description)}",
        _entry("masses", [p["m2"], p["m3"]], source("m2", "m3")),
        _entry("stiffnesses", [p["k2"], p["k3"]], source("k2", "k3")),
        _entry("dampings", [p["c2"], p["c3"]], source("c2", "c3")),
        _entry("static_force", static_force, force_source),
        _entry("aerodynamic_coefficient", 0.0, "own choice: a rig in a laboratory has no wind"),
        _entry("contact_stiffness", p["k1T"], source("k1T")),
        _entry("contact_damping", p["c1T"], source("c1T")),
    ]
    with write_whole(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _entry(key: str, value: float | list[float], source: str) -> str:
    return f"{key} = {{ value = {json.dumps(value)}, source = {_text(source)} }}"


def _text(text: str) -> str:
    """A TOML string: JSON's escapes are TOML's."""
    return json.dumps(text, ensure_ascii=False)
