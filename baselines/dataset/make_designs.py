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
from panto_env.base.files import alone_in
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
from .designs_card import TABLE, card, columns
from .designs_settings import DesignsSettings

PER_PART = 64
"""Designs per part: some seconds of work."""
KEY = b"panto_env"
"""Key of the table's identity in the schema's metadata; a column's metadata hold its description."""


@dataclass(frozen=True)
class MadeTable:
    """A finished table of designs."""

    folder: Path
    designs: int
    refused: int
    ended_early: int
    warned: int  # designs with a warning of inaccurate figures
    megabytes: float
    kept: bool  # whether it existed before


def make_designs(
    settings: DesignsSettings,
    output: Path,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> MadeTable:
    """Make the table in a folder, with its card and checksums; a table that exists is kept.

    workers, ray: see ``spread``; the table does not depend on them. A script must call this under
    ``if __name__ == "__main__":``. progress: called with the number of parts done and of all.

    Raises InputError if the folder holds a table made with other settings.
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
    return _made(folder, kept=there)


def read_identity(path: Path) -> dict[str, Any]:
    """Identity of a table: the settings and version it was made with. Raises InputError for another file."""
    from pyarrow import ArrowException
    from pyarrow.parquet import read_schema

    try:
        table: dict[str, Any] = json.loads(read_schema(path).metadata[KEY])
        return table
    except (OSError, ArrowException, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is not a complete table of designs; make it anew.") from error


def _assemble(
    settings: DesignsSettings, folder: Path, parts: Sequence[Path], made_of: dict[str, Any]
) -> None:
    """Write the table to a hidden folder, and rename that once it is complete."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    unfinished = folder.with_name(f".{folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)  # left by a process that was killed
    unfinished.mkdir()
    described = columns(settings)
    schema = pa.schema(
        [
            pa.field(each.name, getattr(pa, each.kind)(), metadata={"description": each.description})
            for each in described
        ],
        metadata={KEY: json.dumps(made_of)},
    )
    table = pa.Table.from_pylist([row for path in parts for row in read_checked(path)["rows"]], schema=schema)
    pq.write_table(table, unfinished / TABLE, compression="zstd")
    (unfinished / "card.md").write_text(card(settings, described, table, made_of), encoding="utf-8")
    write_checksums(unfinished)
    unfinished.rename(folder)


def _made(folder: Path, *, kept: bool) -> MadeTable:
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    table = pq.read_table(folder / TABLE, columns=["refused", "ending", "accuracy_warning"])
    refused, ended, warned = (
        int(pc.sum(pc.not_equal(table[name], "")).as_py()) for name in table.column_names
    )
    size = (folder / TABLE).stat().st_size / 1e6
    return MadeTable(folder, table.num_rows, refused, ended, warned, size, kept)
