"""The Parquet file of a run: written, and read again.

Its checksum shows that a file is undamaged, not that it is of a run: so what figures depend on is checked.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, ValidationError

from ..base.arrays import Array
from ..base.checksums import with_checksum, without_checksum
from ..base.errors import InputError
from ..base.extras import require
from ..base.files import write_whole
from ..base.settings import Between, Settings, explain
from ..plant.alignment import Alignment
from ..plant.catenary.schema import PowerSystem
from .compliance import LineFacts
from .trajectory import OF_TWO_WIRES, OUTPUTS, SERIES, Trajectory, follower_columns

FORMAT = 3
OF_FOLLOWERS = ("pantograph", "nominal_force", "target_mean", "policy", "design", "reached")
"""Facts that a collector behind the first has of its own; the others are those of the first."""
OF_PLACES = {"uplift": "support_position", "dropper_force": "dropper_position"}
"""Series with a column for each place, and where these are."""
KEY = b"panto_env"
"""Key of the file's metadata that holds the facts as JSON, with a checksum of them and of all columns."""
DAMAGED: tuple[type[Exception], ...] = (OSError, LookupError, TypeError, AttributeError, ValueError)
DAMAGED += (ArithmeticError, RecursionError, MemoryError)
"""Errors that reading a damaged file can raise, besides Arrow's own."""
LARGEST = 1e9
"""Maximum size of a sample, in its SI unit."""
Places = tuple[Annotated[float, Between(-1e7, 1e7, "m")], ...]


class Facts(Settings):
    """Facts that figures depend on; a file holds more. Numbers that are unknown are nan or infinite."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=True)
    support_position: Places
    dropper_position: Places
    speed: Annotated[float, Between(0.1, 500, "m/s")]
    alignment: tuple[Places, float | None] | tuple[Places, float | None, list[tuple[str, float | None]]]
    time_step: Annotated[float, Between(1e-7, 1, "s")]
    nominal_force: Annotated[float, Between(-1e6, 1e6, "N")]
    target_mean: float
    reached: float
    system: PowerSystem  # of the line, as what follows
    wave_speed: float = Field(ge=1)
    free_uplift: float
    dropper_reflection: float
    support_reflection: float
    controlled: tuple[Annotated[int, Between(1, 4)], ...] = Field((1,), min_length=1)
    line_condition: tuple[dict[str, Any], ...] | None = None
    catenary: dict[str, Any]  # as designed, as what follows
    pantograph: dict[str, Any]


def check_stored(facts: Mapping[str, Any], columns: Mapping[str, Array]) -> None:
    """Raise ValueError, with a clause, for facts and columns, (n,) each, of a file that is of no run."""
    try:
        for own in ({}, *facts["followers"]):
            design = {"catenary": {}, "pantograph": {}} | (facts | own)["design"]
            table = facts["settings"] | facts["line"] | design["pantograph"] | facts | own | design
            known = Facts.model_validate(table)
    except ValidationError as error:
        raise ValueError(explain(error, Facts)) from error
    for name, column in columns.items():
        usable = column.dtype.kind == "f" and len(column) > 1
        own = column[~np.isnan(column)] if usable and "@" in name else column  # nan: not yet on the line
        if not (usable and (np.abs(own) <= LARGEST).all()):
            raise ValueError(f"column {name} does not hold finite numbers of two samples or more")
    supports, pitch = np.array(known.alignment[0]), known.alignment[1]
    if len(supports) < 2 or (np.diff(supports) <= 0).any() or pitch not in (None, supports[1]):
        raise ValueError("its supports do not stand one behind the other")
    if (np.diff(columns["position"]) <= 0).any() or columns["position"][0] < 0:
        raise ValueError("its positions do not rise with time")


def write(run: Trajectory, path: str | Path) -> None:
    """Write a run, whole or not at all; see ``Trajectory.save``."""
    import pyarrow as pa
    from pyarrow.parquet import write_table

    columns = {name: getattr(run, name) for name in run.series}
    for number, follower in enumerate(run.followers, start=2):
        columns |= follower_columns(follower, number, len(run.time))
    for name in OF_PLACES:
        for k, column in enumerate(getattr(run, name).T):
            columns[f"{name}_{k}"] = np.ascontiguousarray(column)
    facts = {"format": FORMAT} | {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(run).items()
        if name not in {*SERIES, *OF_TWO_WIRES, *OF_PLACES, "followers"}
    }
    masts = [run.alignment.masts] * bool(run.alignment.masts)
    facts |= {"line": vars(run.line), "alignment": (run.alignment.supports, run.alignment.pitch, *masts)}
    facts["followers"] = [{name: getattr(each, name) for name in OF_FOLLOWERS} for each in run.followers]
    table = pa.table(columns, metadata={KEY: json.dumps(with_checksum(facts, columns))})
    with write_whole(path) as temporary:
        write_table(table, temporary, write_page_checksum=True)


def read(path: str | Path) -> Trajectory:
    """The run of a file of ``write``; see ``Trajectory.load``."""
    if not os.path.isfile(path):
        raise InputError(f"The trajectory file {path} does not exist; check the path.")
    if Path(path).suffix.lower() in OUTPUTS[1:]:
        raise InputError(f"{path} is for other programs: a run is read from its .parquet file only.")
    require(str(path), "parquet", "pyarrow", otherwise="a run cannot be read from another kind of file")
    from pyarrow import ArrowException
    from pyarrow.parquet import ParquetFile

    try:
        with ParquetFile(path, page_checksum_verification=True) as file:
            table = file.read()
        columns = {name: table[name].to_numpy() for name in table.column_names}
        facts = without_checksum(json.loads(table.schema.metadata[KEY]), columns)
        if facts.pop("format") != FORMAT:
            raise ValueError("it has another format")
        check_stored(facts, columns)
        for name in OF_PLACES.values():
            facts[name] = np.array(facts[name], dtype=float)
        heights = tuple(facts["line"].pop("contact_heights", ()))
        facts["line"] = LineFacts(**facts["line"], contact_heights=heights)
        supports, pitch, *masts = facts["alignment"]
        facts["alignment"] = Alignment(tuple(supports), pitch, tuple(map(tuple, *masts)) if masts else ())
        more = [name for name in OF_TWO_WIRES if name in columns]
        series = {name: columns[name] for name in (*SERIES, *more)}
        for name, places in OF_PLACES.items():
            count = sum(column.startswith(f"{name}_") for column in columns)
            rows = np.array([columns[f"{name}_{k}"] for k in range(count)])
            series[name] = rows.T if count else np.zeros((table.num_rows, 0))
            if count and count != len(facts[places]):
                raise ValueError(f"columns of {name} are missing")
        followers = facts.pop("followers")
        first = Trajectory(**series, **facts)
        own = [_follower_of(first, columns, *each) for each in enumerate(followers, start=2)]
        return dataclasses.replace(first, followers=tuple(own))
    except (ArrowException, *DAMAGED) as error:
        reason = str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
        raise InputError(
            f"{path} is not a whole trajectory file ({reason}); write it again with "
            "Trajectory.save or `panto simulate --output`."
        ) from error


def _follower_of(first: Trajectory, columns: Mapping[str, Array], number: int, facts: Any) -> Trajectory:
    """The inverse: the record from a file's columns, and what it has of its own."""
    on_line = ~np.isnan(columns[f"time@{number}"])
    series = {name: columns[f"{name}@{number}"][on_line] for name in first.series}
    shared = {name: getattr(first, name)[on_line] for name in OF_PLACES}
    own: dict[str, Any] = {**series, **shared, **facts}
    return dataclasses.replace(first, **own)
