"""The record of one run along a line, its figures, and its Parquet file."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.files import write_whole
from . import figures as metrics

FORMAT = 1
SERIES = (
    "time",
    "position",
    "contact_force",
    "head",
    "frame",
    "wire",
    "head_velocity",
    "frame_velocity",
    "frame_force",
    "head_force",
)


@dataclass(frozen=True)
class Trajectory:
    """One pass along a line. n samples; each is the mean over one time step, at its middle."""

    time: Array  # (n,): s
    position: Array  # (n,): of the pantograph along the line (m)
    contact_force: Array  # (n,): raw, 0 where contact is lost (N)
    head: Array  # (n,): height of the collector head (m); 0 is the contact wire at the support
    frame: Array  # (n,): height of the articulated frame about its rest (m)
    wire: Array  # (n,): height of the contact wire above the pantograph (m)
    head_velocity: Array  # (n,): m/s
    frame_velocity: Array  # (n,): m/s
    frame_force: Array  # (n,): of the actuator on the frame (N)
    head_force: Array  # (n,): of the actuator between head and frame (N)
    uplift: Array  # (n, supports): of the contact wire, at the end of each step (m)
    support_position: Array  # (supports,): m
    dropper_force: Array  # (n, droppers): tension, 0 where slack (N)
    dropper_position: Array  # (droppers,): m
    catenary: str
    pantograph: str
    speed_kmh: float
    span_length: float  # m
    time_step: float  # s
    nominal_force: float  # static and aerodynamic uplift (N)
    policy: str = "passive"
    seed: int = 0
    terminated: bool = False  # whether the run ended early, outside the plant's valid range

    def summary(self, spans: tuple[int, int] | None = None) -> metrics.Figures:
        """Figures over spans first..last, counted from 1 (EN 50318 takes 5 and 6), or the whole run.

        Uplift is that of the supports at the ends of these spans and between. Raises InputError
        where the run does not cover the spans.
        """
        inside, lowest, highest = self._select(spans)
        force = self.contact_force[inside]
        filtered = metrics.low_pass(self.contact_force, self.time_step)[inside]
        mean, std = float(filtered.mean()), float(filtered.std())
        near = (self.support_position > lowest - 1e-6) & (self.support_position < highest + 1e-6)
        uplift = self.uplift[: np.flatnonzero(inside)[-1] + 1, near]
        frame, head = self.frame_force[inside], self.head_force[inside]
        frame_change, head_change = np.diff(frame), np.diff(head)
        changes = frame_change @ frame_change + head_change @ head_change
        stride = self.speed_kmh / 3.6 * self.time_step
        return metrics.Figures(
            mean=mean,
            std=std,
            statistical_max=mean + 3 * std,
            statistical_min=mean - 3 * std,
            max=float(filtered.max()),
            min=float(filtered.min()),
            max_uplift=float(uplift.max()) if uplift.size else float("nan"),
            contact_loss=metrics.contact_loss(force),
            cost_function=metrics.cost_function(force, self.nominal_force, stride),
            effort=math.sqrt((frame @ frame + head @ head) / len(force)),
            effort_rate=math.sqrt(changes / len(frame_change)) / self.time_step if len(force) > 1 else 0.0,
            distance=float(inside.sum() * stride),
        )

    def _select(self, spans: tuple[int, int] | None) -> tuple[NDArray[np.bool_], float, float]:
        if spans is None:
            return np.ones(len(self.time), dtype=bool), 0.0, float(self.position[-1])
        first, last = spans
        if not (isinstance(first, int) and isinstance(last, int) and 1 <= first <= last):
            raise InputError(
                f"spans must be two whole numbers, first and last, counted from 1, not {spans!r}."
            )
        lowest, highest = (first - 1) * self.span_length, last * self.span_length
        stride = self.speed_kmh / 3.6 * self.time_step
        if self.position[-1] + stride < highest:
            raise InputError(
                f"spans {first} to {last} end at {highest:g} m, but the run ends at "
                f"{self.position[-1]:.1f} m; run further or choose earlier spans."
            )
        inside = (self.position >= lowest) & (self.position < highest)
        return inside, lowest, highest

    def save(self, path: str | Path) -> None:
        """Write a Parquet file, whole or not at all.

        One column a series; the arrays of supports and droppers one column each, by number.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = {name: getattr(self, name) for name in SERIES}
        for name in ("uplift", "dropper_force"):
            for k, column in enumerate(getattr(self, name).T):
                columns[f"{name}_{k}"] = np.ascontiguousarray(column)
        facts = {"format": FORMAT} | {
            name: value.tolist() if isinstance(value := getattr(self, name), np.ndarray) else value
            for name in _facts()
        }
        table = pa.table(columns).replace_schema_metadata({"panto_env": json.dumps(facts)})
        with write_whole(path) as temporary:
            pq.write_table(table, temporary)

    @classmethod
    def load(cls, path: str | Path) -> Trajectory:
        """Read what ``save`` wrote. Raises InputError where the file is not a whole trajectory."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        if not os.path.isfile(path):
            raise InputError(f"The trajectory file {path} does not exist; check the path.")
        try:
            table = pq.read_table(path)
            facts = json.loads(table.schema.metadata[b"panto_env"])
            if facts.pop("format") != FORMAT:
                raise ValueError("it has another format")
            for name in ("support_position", "dropper_position"):
                facts[name] = np.array(facts[name], dtype=float)
            series = {name: table[name].to_numpy() for name in SERIES}
            for name, places in (
                ("uplift", "support_position"),
                ("dropper_force", "dropper_position"),
            ):
                held = [c for c in table.column_names if c.startswith(f"{name}_")]
                columns = [table[f"{name}_{k}"].to_numpy() for k in range(len(held))]
                series[name] = np.array(columns).T if columns else np.zeros((table.num_rows, 0))
                if held and len(held) != len(facts[places]):
                    raise ValueError(f"columns of {name} are missing")
            return cls(**series, **facts)
        except (pa.ArrowException, OSError, KeyError, TypeError, ValueError) as error:
            raise InputError(
                f"{path} is not a whole trajectory file ({error}); write it anew with "
                "Trajectory.save or `panto simulate --output`."
            ) from error


def _facts() -> tuple[str, ...]:
    arrays = {*SERIES, "uplift", "dropper_force"}
    return tuple(f.name for f in dataclasses.fields(Trajectory) if f.name not in arrays)
