"""All steps of recorded episodes as one Parquet table, for readers that know no Minari."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .episodes import Episode
from .settings import Plan

STEPS = "steps.parquet"
"""Name of the table in a data set's folder."""
PER_GROUP = 100
"""Episodes per row group."""


class StepColumn(NamedTuple):
    """A column of the table."""

    name: str
    description: str


COLUMNS = (
    StepColumn("episode", "number of the episode, from 0"),
    StepColumn("step", "number of the control step in its episode, from 0"),
    StepColumn("policy", "policy that acted"),
    StepColumn("observation", "before the step, as the environment returned it"),
    StepColumn("action", "taken, noise included, as a share of the actuator's force limit"),
    StepColumn("reward", "of the step"),
    StepColumn("next_observation", "after the step"),
    StepColumn("terminated", "whether the step ended the episode early"),
    StepColumn("truncated", "whether the episode reached its distance"),
)
"""Those before the infos, which have the names of Minari's and are those at the step's end."""


class StepsTable:
    """Writes the table; a context manager."""

    def __init__(self, path: Path) -> None:
        """path: of the file to write."""
        self._path = path
        self._writer: pq.ParquetWriter | None = None
        self._waiting: list[pa.Table] = []

    def __enter__(self) -> StepsTable:
        return self

    def __exit__(self, *_: object) -> None:
        self._flush()
        if self._writer is not None:
            self._writer.close()

    def add(self, plan: Plan, episode: Episode) -> None:
        """Add an episode."""
        count = len(episode.rewards)
        values = (
            pa.array(np.full(count, plan.number)),
            pa.array(np.arange(count)),
            pa.array([plan.policy] * count),
            _column(episode.observations[:-1]),
            _column(episode.actions),
            pa.array(episode.rewards),
            _column(episode.observations[1:]),
            pa.array(episode.terminations),
            pa.array(episode.truncations),
        )
        infos = {name: _column(array[1:]) for name, array in episode.infos.items()}
        names = [column.name for column in COLUMNS]
        self._waiting.append(pa.table(dict(zip(names, values, strict=True)) | infos))
        if len(self._waiting) == PER_GROUP:
            self._flush()

    def _flush(self) -> None:
        if not self._waiting:
            return
        table = pa.concat_tables(self._waiting)
        if self._writer is None:
            self._writer = pq.ParquetWriter(self._path, table.schema, compression="zstd")
        self._writer.write_table(table)
        self._waiting.clear()


def _column(array: Any) -> Any:
    """Arrow array of (n,) numbers, or of (n, k) as lists of k."""
    if array.ndim == 1:
        return pa.array(array)
    return pa.FixedSizeListArray.from_arrays(pa.array(array.ravel()), array.shape[1])
