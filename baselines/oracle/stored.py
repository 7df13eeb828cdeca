"""Settings of a search for oracles: passes as a table of cells, from keywords or a TOML file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from panto_configs import find
from panto_env.base.checksums import __version__, read_checked, with_checksum
from panto_env.base.errors import InputError
from panto_env.base.files import finite, read_toml, write_text
from panto_env.base.settings import Positive, Settings, parse
from panto_env.catalog.loader import is_entry
from panto_env.control.lines import draws_line, line_name
from panto_env.control.record import OF_TRAINS
from panto_env.control.settings import ControlInterval, PantographScatter, SpeedDrift, run_settings
from panto_env.plant.line_condition import LINE_CONDITIONS

from ..line import CONDITIONS, Actuator, Condition, Distinct, LineAndTrain, Span, of_run
from .search import METHOD, STARTS, Oracle

MOST_HOPS = 1000
"""Maximum number of hops; each takes about as long as the first search."""
Start = Literal[STARTS]  # type: ignore[valid-type]


class OracleCell(LineAndTrain):
    """A train with an actuator on a line, and the speeds to run at."""

    actuator: Actuator = of_run("actuator")
    speeds_kmh: Distinct[Positive] = Field((300.0,), min_length=1, description="km/h")


class OracleSettings(Settings):
    """Cells, and the settings common to all of them."""

    cells: tuple[OracleCell, ...] = Field(
        (OracleCell(),), min_length=1, description="lines, actuators and speeds"
    )
    seeds: tuple[Annotated[int, Field(ge=0)], ...] = Field((0,), min_length=1, description="seeds")
    spans: tuple[Span, Span] | None = Field(
        None, description="first and last span over which σ is minimised; by default those after the start"
    )
    line_spans: Span | None = Field(
        None, description="number of the line's spans, on which its irregularity depends"
    )
    starts: tuple[Start, ...] = Field(("zero",), min_length=1, description=f"of {', '.join(STARTS)}")
    hops: int = Field(
        0,
        ge=0,
        le=MOST_HOPS,
        description="further searches, each from the best result plus noise; more find steadier forces",
    )
    line_condition: Condition = Field(
        LINE_CONDITIONS["smooth"], description="on a new line every seed gives the same run"
    )
    pantograph_scatter: PantographScatter = of_run("pantograph_scatter")
    speed_drift: SpeedDrift = of_run("speed_drift")
    control_interval: ControlInterval = of_run("control_interval")

    def runs(self) -> Iterator[dict[str, Any]]:
        """Settings of a run, by name, for each cell at each speed."""
        common = {"spans": self.line_spans} | {name: getattr(self, name) for name in CONDITIONS}
        for cell in self.cells:
            for speed in cell.speeds_kmh:
                yield cell.settings | {"speed_kmh": speed, "actuator": cell.actuator} | common


def oracle_settings(
    source: str | Path | None, changes: Mapping[str, Any], cell: Mapping[str, Any]
) -> OracleSettings:
    """Settings from a TOML file, given by its path or a name of ``configs/``, or the defaults, with changes.

    cell: if not empty, the only cell. Raises InputError for settings that are not valid.
    """
    table = {} if source is None else read_toml(find(source, "oracle"))
    if cell:
        table["cells"] = [dict(cell)]
    return parse(OracleSettings, table | dict(changes), "the oracle" if source is None else str(source))


RESULTS = Path(__file__).parent / "results"
"""Folder of the project's own oracles; the key ``command`` of each file says how they were made."""
MATTER = (
    "catenary",
    "distance",  # an irregular line with another number of spans is another line
    "spans",
    "pantograph",
    "speed_kmh",
    "actuator",
    "line_condition",
    "speed_drift",
    "speed_profile",
    "faults",
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
"""Settings that an oracle depends on, with all values of line and pantograph; sensors are not among them."""


def fingerprint(given: Mapping[str, Any]) -> str:
    """Hash of everything that an oracle depends on except spans and seed, from settings of a run by name.

    Values at their defaults are left out, so that a new setting that is off changes nothing. Raises
    InputError for a value that is not valid.
    """
    settings = run_settings(given)
    matter = {*MATTER, *(OF_TRAINS if settings.pantographs else ())}
    plain = settings.model_dump(mode="json", include=matter, serialize_as_any=True, exclude_defaults=True)
    for name in ("catenary", "pantograph"):
        for words in ("description", "sources", "system", "uplift_stop"):  # no force depends on these
            plain[name].pop(words, None)
    if settings.spans is not None:  # then the number of spans does not come from the distance
        plain.pop("distance", None)
    plain["kinds"] = [type(one).__name__ for one in (settings.catenary, settings.actuator)]
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def requests(settings: OracleSettings) -> list[dict[str, Any]]:
    """Identities of the requested cells, in order, as plain data.

    Cells with the same identity have the same settings, spans, seeds, starts, hops and ``METHOD``.
    """
    table = settings.model_dump(mode="json", include={"spans", "seeds", "starts", "hops"})
    return [{"method": METHOD, **table, "fingerprint": fingerprint(given)} for given in settings.runs()]


def cell(request: Mapping[str, Any], passes: Sequence[Oracle]) -> dict[str, Any]:
    """A cell as plain data, with its passes under all seeds; request: its entry of ``requests``."""
    first = passes[0].problem
    settings = first.settings
    train: dict[str, Any] = {}
    if settings.pantographs:
        train = {name: getattr(settings, name) for name in ("distances", "controlled")}
        train = {"pantographs": [each.name for each in settings.pantographs]} | train
    table: dict[str, Any] = finite(
        {
            "catenary": line_name(run_settings(first.given)),
            "pantograph": settings.pantograph.name,
            **train,
            "speed_kmh": settings.speed_kmh[0],
            "actuator": settings.actuator.model_dump(mode="json"),
            "line_condition": [each.model_dump(mode="json") for each in settings.line_condition],
            "pantograph_scatter": settings.pantograph_scatter,
            "speed_drift": settings.speed_drift,
            "control_interval": settings.control_interval,
            "spans": first.spans,
            "ratio": float(np.mean([each.figures.std / each.problem.figures.std for each in passes])),
            "asked": dict(request),
            "passes": [_pass(each) for each in passes],
        }
    )
    return table


def as_data(cells: Sequence[Mapping[str, Any]], command: str) -> dict[str, Any]:
    """Content of a file: cells made by ``cell``, and the text of the command that found them."""
    return {"version": __version__, "command": command, "cells": list(cells)}


def _pass(oracle: Oracle) -> dict[str, Any]:
    return {
        "seed": oracle.problem.seed,
        "passive": oracle.problem.figures.as_dict(),
        "oracle": oracle.figures.as_dict(),
        "searches": [
            {"start": each.start, "std": each.std, "iterations": len(each.iterations) - 1}
            for each in oracle.searches
        ],
        "at_limits": oracle.best.iterations[-1].at_limits,
        "first_step": oracle.problem.begin,
        "commands": oracle.commands,
    }


def save(cells: Sequence[Mapping[str, Any]], path: str | Path, command: str) -> None:
    """Write cells as JSON with a checksum, one line per cell and per pass, whole or not at all."""
    text = json.dumps(with_checksum(as_data(cells, command)), separators=(",", ":"))
    text = text.replace('{"seed"', '\n{"seed"').replace('{"catenary"', '\n{"catenary"')
    write_text(path, f"{text}\n")


def read(path: str | Path) -> dict[str, Any]:
    """Read a file written by ``save``. Raises InputError for another file, or a damaged one."""
    data = read_checked(path)
    try:
        [one["fingerprint"] for one in (each["asked"] for each in data["cells"])]
    except (LookupError, TypeError) as error:
        raise InputError(
            f"{path} holds no oracles of this version; remove it, or name another file."
        ) from error
    return data


@cache
def stored_cells() -> list[dict[str, Any]]:
    """Cells of the project's own oracles, read once per process."""
    return [each for path in sorted(RESULTS.glob("*.json")) for each in read(path)["cells"]]


def stored_actions(given: Mapping[str, Any]) -> NDArray[np.float64] | None:
    """Actions, (control steps, actions), of a stored oracle from the start of its pass on; None without one.

    The oracle may be for another condition of the line: line and pantograph, by their values, speed and
    actuator are those of ``given``, settings of a run by name. Those of files are not found, nor those of
    trains of several pantographs, or of lines that each seed draws.
    """
    settings = run_settings(given)
    if settings.pantographs or draws_line(settings):
        return None
    actuator = settings.actuator.model_dump(mode="json")
    for one in stored_cells():
        if (
            "pantographs" not in one
            and one["speed_kmh"] == settings.speed_kmh[0]
            and one["actuator"] == actuator
            and is_entry(settings.line, one["catenary"], None)
            and is_entry(settings.pantograph, one["pantograph"], None)
        ):
            commands = np.array(one["passes"][0]["commands"])
            before = np.zeros((one["passes"][0]["first_step"], commands.shape[1]))
            return np.asarray(np.concatenate([before, commands]) / settings.actuator.force_limit)
    return None


def stored_changes(given: Mapping[str, Any], spans: tuple[int, int]) -> dict[int, float]:
    """Change of σ (%) from the passive run by seed, of the stored oracle for settings of a run by name.

    Empty if there is no oracle for exactly this line, pantograph, speed, actuator, condition of the line,
    control interval and computation over exactly these spans; sensors do not matter.
    """
    sought = fingerprint(given)
    for one in stored_cells():
        if one["asked"]["fingerprint"] == sought and tuple(one["spans"]) == spans:
            pairs = ((each["seed"], each["oracle"]["std"] / each["passive"]["std"]) for each in one["passes"])
            return {seed: 100 * (ratio - 1) for seed, ratio in pairs}
    return {}
