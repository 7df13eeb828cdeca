"""A table of designs: simulated in parts on all cores, then merged into one Parquet file with its card."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from panto_env.analysis.pool import Progress
from panto_env.base.checksums import read_checked
from panto_env.base.errors import InputError
from panto_env.base.locks import alone_in
from panto_env.cluster.parts import (
    PARTS,
    Job,
    first_difference,
    identity,
    make_parts,
    open_parts,
    remove_if_empty,
    remove_parts,
)

from .checksums import LIST, write_checksums
from .designs import simulate_designs
from .designs_card import card, columns
from .designs_settings import DesignsSettings

PER_PART = 64
"""Designs in a part: some seconds of work."""
TABLE = "designs.parquet"
KEY = b"panto_env"
"""Under which the schema's metadata have what the table was made of; a column's have its unit and range."""


@dataclass(frozen=True)
class MadeTable:
    """A table that is there."""

    folder: Path
    designs: int
    refused: int
    ended_early: int
    warned: int  # of inaccurate figures
    megabytes: float
    kept: bool  # whether it was there before


def make_designs(
    settings: DesignsSettings,
    output: Path,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> MadeTable:
    """Make the table in a folder, with its card and checksums; one that is there is kept.

    workers, ray: as ``spread`` takes them; the table does not depend on it. A script must call this under
    ``if __name__ == "__main__":``. progress: called with the parts there, and of all.

    Raises InputError where the folder holds a table that was made of something else.
    """
    made_of = identity("designs", settings.model_dump(mode="json"))
    folder = output / "designs"
    with alone_in(output, "makes data in"):
        there = (folder / LIST).is_file()
        if there:
            difference = first_difference(read_identity(folder / TABLE), made_of)
            if difference:
                raise InputError(f"{folder} holds another table ({difference}); take another --output.")
        else:
            parts = output / PARTS / "designs"
            open_parts(parts, made_of)
            jobs: dict[Path, Job] = {}
            for first in range(0, settings.count, PER_PART):
                last = min(first + PER_PART, settings.count)
                jobs[parts / f"{first:07d}.json"] = partial(simulate_designs, settings, first, last)
            make_parts(jobs, read_checked, workers=workers, ray=ray, progress=progress)
            _assemble(settings, folder, list(jobs), made_of)
            remove_parts(parts)
            remove_if_empty(output / PARTS)
    return _told(folder, kept=there)


def read_identity(path: Path) -> dict[str, Any]:
    """What a table was made of. Raises InputError where the file is no such table."""
    from pyarrow import ArrowException
    from pyarrow.parquet import read_schema

    try:
        table: dict[str, Any] = json.loads(read_schema(path).metadata[KEY])
        return table
    except (OSError, ArrowException, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is no table of designs that is whole; make it anew.") from error


def _assemble(
    settings: DesignsSettings, folder: Path, parts: Sequence[Path], made_of: dict[str, Any]
) -> None:
    """Write the table beside its place, and bring it there once it is whole."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    unfinished = folder.with_name(f".{folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)  # of a process that was killed
    unfinished.mkdir()
    told = columns(settings)
    schema = pa.schema(
        [
            pa.field(each.name, getattr(pa, each.kind)(), metadata={"description": each.description})
            for each in told
        ],
        metadata={KEY: json.dumps(made_of)},
    )
    table = pa.Table.from_pylist([row for path in parts for row in read_checked(path)["rows"]], schema=schema)
    pq.write_table(table, unfinished / TABLE, compression="zstd")
    (unfinished / "card.md").write_text(card(settings, told, table, made_of), encoding="utf-8")
    write_checksums(unfinished)
    unfinished.rename(folder)


def _told(folder: Path, *, kept: bool) -> MadeTable:
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    table = pq.read_table(folder / TABLE, columns=["refused", "ending", "accuracy_warning"])
    refused, ended, warned = (
        int(pc.sum(pc.not_equal(table[name], "")).as_py()) for name in table.column_names
    )
    size = (folder / TABLE).stat().st_size / 1e6
    return MadeTable(folder, table.num_rows, refused, ended, warned, size, kept)
