"""Oracles that are kept in a file, and the share of what they gain that a policy gains."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from panto_env.base.files import finite, write_whole
from panto_env.base.version import __version__
from panto_env.control.settings import run_settings

from .search import Oracle

RESULTS = Path(__file__).parent / "results.json"
"""Those that come with the project; ``command`` in it says how they were made."""
MATTER = (
    "catenary",
    "pantograph",
    "speed_kmh",
    "actuator",
    "line_condition",
    "speed_drift",
    "mean_force",
    "run_in",
    "pantograph_scatter",
    "control_interval",
    "bilateral",
    "time_step",
    "spacing",
    "window",
    "precision",
)
"""Settings that an oracle depends on, with all values of line and pantograph; nothing that is sensed."""


def fingerprint(given: Mapping[str, Any]) -> str:
    """Hash of all that an oracle depends on but spans and seed, of settings of a run by name.

    Values at their defaults are left out, so that a setting that is new and off changes nothing. Raises
    InputError for a value that is not valid.
    """
    settings = run_settings(given)
    # Without defaults: a setting that is new in a later version, and off, changes no oracle; a kind does.
    plain = settings.model_dump(
        mode="json", include=set(MATTER), serialize_as_any=True, exclude_defaults=True
    )
    for name in ("catenary", "pantograph"):
        for words in ("description", "sources"):
            plain[name].pop(words, None)
    plain["kinds"] = [type(one).__name__ for one in (settings.catenary, settings.actuator)]
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def as_data(oracles: Sequence[Oracle], command: str) -> dict[str, Any]:
    """Oracles as plain data, one cell for each line, pantograph, actuator and speed; command: its text."""
    cells = []
    for print_, group in groupby(oracles, key=lambda oracle: fingerprint(oracle.problem.given)):
        found = list(group)
        settings = found[0].problem.settings
        cells.append(
            {
                "catenary": settings.catenary.name,
                "pantograph": settings.pantograph.name,
                "speed_kmh": settings.speed_kmh[0],
                "actuator": settings.actuator.model_dump(mode="json"),
                "line_condition": [each.model_dump(mode="json") for each in settings.line_condition],
                "control_interval": settings.control_interval,
                "spans": found[0].problem.spans,
                "ratio": float(np.mean([each.figures.std / each.problem.figures.std for each in found])),
                "fingerprint": print_,
                "passes": [_pass(each) for each in found],
            }
        )
    data: dict[str, Any] = finite({"version": __version__, "command": command, "cells": cells})
    return data


def _pass(oracle: Oracle) -> dict[str, Any]:
    problem = oracle.problem
    return {
        "seed": problem.seed,
        "passive": problem.figures.as_dict(),
        "oracle": oracle.figures.as_dict(),
        "searches": [
            {"start": each.start, "std": each.std, "iterations": len(each.iterations) - 1}
            for each in oracle.searches
        ],
        "at_limits": oracle.best.iterations[-1].at_limits,
        "first_step": problem.begin,
        "commands": oracle.commands,
    }


def save(oracles: Sequence[Oracle], path: str | Path, command: str) -> None:
    """Write oracles as JSON, whole or not at all."""
    text = json.dumps(as_data(oracles, command), separators=(",", ":"))
    with write_whole(path) as temporary:
        temporary.write_text(
            text.replace('{"seed"', '\n{"seed"').replace('{"catenary"', '\n{"catenary"') + "\n"
        )


@cache
def load(path: Path = RESULTS) -> dict[str, Any]:
    """What a file of ``save`` holds."""
    data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return data


def stored_ratio(
    given: Mapping[str, Any], path: Path = RESULTS, spans: tuple[int, int] | None = None
) -> float | None:
    """σ of the stored oracle over the passive run's, mean over its seeds, for settings of a run by name.

    None where there is none of exactly this line, pantograph, speed, actuator, condition of the line, control
    interval and computation, nor, where spans are named, of these; what is sensed does not matter.
    """
    wanted = fingerprint(given)
    for cell in load(path)["cells"]:
        if cell["fingerprint"] == wanted and spans in (None, tuple(cell["spans"])):
            return float(cell["ratio"])
    return None


def share_of_oracle(
    given: Mapping[str, Any], std: float, passive_std: float, path: Path = RESULTS
) -> float | None:
    """Share of what the stored oracle takes off σ that a policy does, from σ with it and without (N).

    1 is the oracle, 0 the passive run, less than 0 worse than that. None as of ``stored_ratio``.
    """
    ratio = stored_ratio(given, path)
    return None if ratio is None else (1.0 - std / passive_std) / (1.0 - ratio)
