"""The identified pantograph as a TOML file of the catalogue's form."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from ..base.errors import InputError
from ..base.files import check_output, write_whole
from ..base.settings import ranges_of
from ..plant.pantograph.schema import PantographData
from .fit import Fit
from .model import UNITS
from .performance import Match

EXPLAINS = 50.0
"""Fitting performance (%) of a displacement from which a model explains it."""
(_FORCE,) = set(ranges_of(PantographData.model_fields["static_force"].rebuild_annotation()))
MOST_FORCE = _FORCE.high
"""Maximum lifting force (N) of a pantograph."""
SUFFIXES = (".toml",)
"""Of the file that a pantograph is written to."""


def check_possible(fit: Fit) -> None:
    """Raise InputError for parameters that no pantograph can have."""
    p = fit.parameters
    if fit.impossible:
        shown = ", ".join(f"{name} = {p[name]:.4g} {UNITS[name]}" for name in fit.impossible)
        raise InputError(
            f"The {fit.method} found {shown}: no pantograph has that, so none is written; take a record that "
            "determines it, another --method, or give its value with --measured."
        )


def write_pantograph(
    fit: Fit,
    path: str | Path,
    *,
    matches: Sequence[Match],
    record: str,
    static_force: float,
    force_source: str,
) -> None:
    """Write what ``panto simulate --pantograph`` takes, whole or not at all.

    matches: of the model beside the record. record: its name, for the sources. static_force: lifting force
    (N), and where it is from.
    Raises InputError for a file that is not .toml, for parameters that no pantograph can have, and for a
    model that does not explain the motion that it was identified from.
    """
    check_output(path, SUFFIXES)
    check_possible(fit)
    for match in matches:
        if match.driven_by == "plate" and match.channel != "force" and not match.performance >= EXPLAINS:
            raise InputError(
                f"The model by {fit.method} does not explain the motion of {match.channel} (fitting "
                f"performance {match.performance:.3g} %, {EXPLAINS:g} % is required), so none is written; "
                "check units and signs, or take a record with more motion, another --method, or known values "
                "by --measured."
            )
    if not 0 <= static_force <= MOST_FORCE:
        raise InputError(
            f"The static force must be a number from 0 to {MOST_FORCE:g} N, not {static_force:g}; give it "
            "with --static-force."
        )

    p = fit.parameters

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
