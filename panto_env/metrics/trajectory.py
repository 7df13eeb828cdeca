"""The record of one run along a line, and its figures.

A run holds its settings, and its line and pantographs, as plain data, as its file does; ``Identity`` and
``Design`` read them. Lines and pantographs are checked only when they are needed, since those of another
version need not be valid in this one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from ..base.files import check_output
from ..plant.alignment import Alignment, Spans
from ..plant.catenary import CATENARIES, CatenaryData
from ..plant.catenary.flexible.parts import Overlap
from ..plant.line_condition import NEW, LineCondition
from ..plant.pantograph.schema import PantographData
from .by_span import evaluated, near_train
from .compliance import SLOW, Criterion, LineFacts, Requirement, compliance, of_train
from .figures import Figures, SpanChoice, arcing, chosen_spans, contact_loss, cost_function, statistics
from .low_pass import low_pass

FEWEST = 3
"""Samples that a speed is found from, by differences of second order."""
SUFFIXES = (".parquet",)
"""Suffixes of the file of a saved run, which can be read again."""
OUTPUTS = (*SUFFIXES, ".csv", ".xlsx")
"""Suffixes of files that a run can be written to."""
SERIES = {
    "time": "s",
    "position": "m",
    "contact_force": "N",
    "head": "m",
    "frame": "m",
    "wire": "m",
    "head_velocity": "m/s",
    "frame_velocity": "m/s",
    "frame_force": "N",
    "head_force": "N",
}
"""Units of the series of a run, in the order of a file's columns."""
OF_TWO_WIRES = {"second_force": "N"}
"""The same of what only runs on two contact wires have."""


@dataclass(frozen=True)
class Identity:
    """Version, settings and resulting grid of a run, as far as they are read again."""

    version: str
    controlled: tuple[int, ...]  # numbers of the controlled pantographs, 1 for the first
    drifts: bool  # whether the train's speed drifts, or follows a profile
    has_profile: bool  # whether it follows a profile
    conditions: tuple[Mapping[str, Any], ...]  # of the line, of which one was drawn; plain data
    spacing: float | None  # of the grid (m); None for lines without one
    window: int | None  # travelling spans, 0 for the whole line; None for lines without a grid

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Self:
        """Identity from a run's settings as plain data."""
        return cls(
            version=settings.get("version", "unknown"),
            controlled=tuple(settings.get("controlled", (1,))),
            drifts=bool(settings.get("speed_drift") or settings.get("speed_profile")),
            has_profile=bool(settings.get("speed_profile")),
            conditions=tuple(settings.get("line_condition") or ()),
            spacing=settings.get("spacing"),
            window=settings.get("window"),
        )

    @property
    def wind(self) -> float:
        """Mean wind along the track in which the run may have been made, the strongest (m/s); 0: none."""
        return max((each.get("wind", 0.0) for each in self.conditions), key=abs, default=0.0)

    @property
    def line_condition(self) -> LineCondition:
        """Condition of the line, the first of several. Raises ValueError where it is not valid."""
        return LineCondition.model_validate(self.conditions[0]) if self.conditions else NEW


@dataclass(frozen=True)
class Design:
    """Line and pantographs of a run by value, as designed.

    A line or a pantograph that is missing or not valid raises KeyError or ValueError.
    """

    tables: Mapping[str, Any]  # plain data by "catenary", "pantograph" and, for a train, "pantographs"

    @property
    def line(self) -> CatenaryData:
        """The line."""
        table = self.tables["catenary"]
        return CATENARIES[table["kind"]].schema.model_validate(table)

    @property
    def pantograph(self) -> PantographData:
        """The pantograph whose record this is."""
        return PantographData.model_validate(self.tables["pantograph"])

    @property
    def pantographs(self) -> tuple[PantographData, ...]:
        """Pantographs of a train, the first in front; none where there is one alone."""
        return tuple(map(PantographData.model_validate, self.tables.get("pantographs", ())))

    @property
    def known_pantograph(self) -> PantographData | None:
        """The pantograph whose record this is; None where it is missing or not valid."""
        try:
            return self.pantograph
        except (KeyError, ValueError):
            return None

    def of_line(self, key: str) -> Any:
        """An entry of the line's table; None where it is missing."""
        return self.tables.get("catenary", {}).get(key)

    @property
    def line_ends(self) -> bool:
        """Whether the line ends with its own spans, as a sequence does; else wires go on behind them."""
        return bool(self.of_line("sequence"))

    @property
    def overlaps(self) -> list[Overlap]:
        """Overlaps of the line."""
        return [Overlap(**each) for each in self.of_line("overlaps") or ()]


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
    # (n, supports): of the contact wire, at the end of each step (m); behind all that of a second one
    uplift: Array
    support_position: Array  # (supports,): m; with two contact wires all twice
    dropper_force: Array  # (n, droppers): tension, 0 where slack (N)
    dropper_position: Array  # (droppers,): m
    catenary: str
    pantograph: str
    speed: float  # of the train, its mean where it drifts (m/s)
    alignment: Alignment  # of the line
    time_step: float  # s
    nominal_force: float  # static force and aerodynamic uplift (N), at the mean speed where it drifts
    # Mean force (N) for which the static force was trimmed, at the mean speed; nan: it was not
    target_mean: float = math.nan
    settings: Mapping[str, Any] = field(default_factory=dict)  # as ``identity`` reads them, plain data
    policy: str = "passive"
    seed: int = 0
    terminated: bool = False  # whether the run ended early, outside the plant's valid range
    ending: str = ""  # where and why it ended early, as a sentence
    line: LineFacts = field(default_factory=LineFacts)
    design: Mapping[str, Any] = field(default_factory=dict)  # as ``designed`` reads it, plain data
    # Of a collector behind the first: where it came to (m). The first came as far as its samples show.
    reached: float = math.nan
    # (n,): share of contact_force on the second of two contact wires (N); (0,) where there is one
    second_force: Array = field(default_factory=lambda: np.zeros(0))
    followers: tuple[Trajectory, ...] = ()  # records of the collectors behind this one, from the front

    @property
    def series(self) -> dict[str, str]:
        """Names and units of the series that it has."""
        return SERIES | (OF_TWO_WIRES if self.second_force.size else {})

    @property
    def identity(self) -> Identity:
        """Settings with which the run was made, by type."""
        return Identity.of(self.settings)

    @property
    def designed(self) -> Design:
        """Line and pantographs as designed, by type."""
        return Design(self.design)

    @property
    def train(self) -> tuple[Trajectory, ...]:
        """Records of all collectors, this one in front."""
        return self, *self.followers

    @property
    def controlled(self) -> Trajectory:
        """Record of the controlled collector, of several the first, also where there was no policy."""
        return self.train[self.identity.controlled[0] - 1]

    def worst_controlled(self, spans: SpanChoice = None) -> Trajectory:
        """Record of the controlled collector by which a train is judged: that with the largest sigma.

        If the run ended early, the first controlled one. spans and InputError: as in ``summary``.
        """
        numbers = self.identity.controlled
        if len(numbers) == 1 or self.terminated:
            return self.controlled
        return max((self.train[number - 1] for number in numbers), key=lambda own: own.summary(spans).std)

    @property
    def pantographs(self) -> str:
        """Names of the pantographs of all collectors, the first in front."""
        return " and ".join(own.pantograph for own in self.train)

    @property
    def policies(self) -> str:
        """Names of the policies of all collectors; one name where all have the same."""
        names = [own.policy for own in self.train]
        return names[0] if len(set(names)) == 1 else " and ".join(names)

    def common_spans(self, choice: SpanChoice = None) -> Spans | None:
        """First and last span over which all collectors are compared: those that the last one covers.

        None for the whole run. Raises InputError as ``spans`` does.
        """
        return self.train[-1].spans(choice)

    @property
    def spans_differ(self) -> bool:
        """Whether the line is a sequence of spans, not one that is repeated."""
        return self.alignment.pitch is None or self.designed.line_ends

    def summary(self, spans: SpanChoice = None) -> Figures:
        """Figures over spans (first, last), counted from 1 (EN 50318 takes 5 and 6), or "all".

        By default the spans are those after the start has died out and, where a sequence of spans ends,
        before its end is felt. Uplift is the maximum at all supports of these spans, both ends included.
        Raises InputError where the run does not cover the spans, is too short for its start to die out, or
        ended early and no earlier spans are given.
        """
        covered, inside = self.spans(spans), self.inside(spans)
        begin, end = (0.0, float(self.position[-1])) if covered is None else self.alignment.limits(covered)
        force = self.contact_force[inside]
        found = statistics(low_pass(self.contact_force, self.time_step)[inside])
        near = (self.support_position > begin - 1e-6) & (self.support_position < end + 1e-6)
        until = np.flatnonzero(inside)[-1] + 1
        uplifts = [self.uplift[:until, k].max() for k in np.flatnonzero(near[: self.uplift.shape[1]])]
        frame, head = self.frame_force[inside], self.head_force[inside]
        ways = np.diff(self.position[inside]) if self.identity.drifts else self.stride
        changes = sum(change @ change for change in map(np.diff, (frame, head)))
        return Figures(
            **found,
            statistical_max=found["mean"] + 3 * found["std"],
            statistical_min=found["mean"] - 3 * found["std"],
            max_uplift=float(max(uplifts, default=math.nan)),
            contact_loss=contact_loss(force),
            cost_function=cost_function(force, self.lift[inside], ways),
            effort=math.sqrt((frame @ frame + head @ head) / len(force)),
            effort_rate=math.sqrt(changes / (len(force) - 1)) / self.time_step if len(force) > 1 else 0.0,
            distance=float(inside.sum() * np.mean(ways)),
        )

    def compliance(self, spans: SpanChoice = None) -> list[Criterion]:
        """Criteria of EN 50367 and EN 50119 for the run over the spans, and values without limits.

        Limits are those of the mean speed over the spans. Values of droppers need their record. Raises
        InputError as ``summary`` does.
        """
        tension, _ = evaluated(self, spans)
        inside = self.inside(spans)
        return compliance(
            self.summary(spans),
            arcing(self.contact_force[inside], self.time_step),
            self.line,
            float(self.speeds[inside].mean()) if self.identity.drifts else self.speed,
            tension,
            tension[near_train(self, spans)] if tension.size else tension,
            self.static_force,
        )

    def requirements(self, spans: SpanChoice = None) -> list[Requirement]:
        """Criteria with limits of the whole train: of each that of the pantograph with the smallest margin.

        Over the spans that the last one covers. Raises InputError as ``summary`` does.
        """
        covered = self.common_spans(spans)
        return of_train([own.compliance(covered) for own in self.train])

    @property
    def static_force(self) -> float | None:
        """Static force as it was set (N); nan where one force is for all speeds, None where not known."""
        known = self.designed.known_pantograph
        if known is None:
            return None
        if not known.lifted_by_air and self.speed_kmh > SLOW:
            return math.nan
        return float(self.nominal_force - known.aerodynamic_uplift(self.speed))

    def uplift_at(self, place: float) -> Array:
        """Uplift (m), (n,), at the support at a place (m), of two contact wires that of the higher."""
        places = self.support_position[: self.uplift.shape[1]]
        return np.asarray(self.uplift[:, places == place].max(axis=1))

    def mechanical_power(self, spans: SpanChoice = None) -> float:
        """Mechanical power (W) of the actuators, mean of its magnitude over the spans.

        The frame's actuator acts between the ground and the frame, the head's between the head and the mass
        below it. It is not what a supply gives: motors lose power, and feed some back. Raises InputError as
        ``spans`` does.
        """
        on_frame = self.frame_force * self.frame_velocity
        on_head = self.head_force * (self.head_velocity - self.frame_velocity)
        return float(np.mean(np.abs(on_frame) + np.abs(on_head), where=self.inside(spans)))

    @property
    def speed_kmh(self) -> float:
        """Speed of the train, its mean where it drifts (km/h)."""
        return to_kmh(self.speed)

    @property
    def speed_in_words(self) -> str:
        """Speed of the train, or lowest and highest of a profile, as "200 to 260 km/h"."""
        if not self.identity.has_profile:
            return f"{self.speed_kmh:g} km/h"
        return f"{to_kmh(self.speeds.min()):.4g} to {to_kmh(self.speeds.max()):.4g} km/h"

    @property
    def speeds(self) -> Array:
        """Speed of the train at each sample, (n,) (m/s)."""
        if not self.identity.drifts or len(self.time) < FEWEST:
            return np.full(len(self.time), self.speed)
        return np.asarray(np.gradient(self.position, self.time_step, edge_order=2))

    @property
    def lift(self) -> Array:
        """Static force and aerodynamic uplift in each step, (n,) (N), in still air: wind adds to it."""
        known = self.designed.known_pantograph if self.identity.drifts else None
        more = known.uplift_change(self.speeds, self.speed) if known else 0.0
        return np.asarray(np.full(len(self.time), self.nominal_force) + more)

    @property
    def lift_by_height(self) -> Array | float:
        """What the contact wire's height as designed adds to ``lift`` in each step, (n,) (N)."""
        heights = self.line.contact_heights
        if not heights or "pantograph" not in self.design:
            return 0.0
        own = np.interp(self.position, self.alignment.supports[: len(heights)], heights)
        return np.asarray(self.designed.pantograph.lift_over(own))

    @property
    def stride(self) -> float:
        """Distance from one sample to the next (m), the mean where the speed drifts."""
        return self.speed * self.time_step

    @property
    def distance(self) -> float:
        """Distance from the line's start to the end of the last step (m)."""
        return float(self.position[-1] + self.position[0]) if math.isnan(self.reached) else self.reached

    def time_at(self, position: float) -> float:
        """Time (s) since the start at which the train reaches a position (m), drift included."""
        places = np.array([0.0, *self.position, self.distance])
        begin = 0.0 if math.isnan(self.reached) else self.time[0] - self.position[0] / self.speed
        return float(np.interp(position, places, [begin, *self.time, self.time[-1] + 0.5 * self.time_step]))

    def spans(self, choice: SpanChoice = None) -> Spans | None:
        """First and last span of a choice, by default those after the start; None for the whole run.

        Raises InputError where the run does not cover them.
        """
        if choice is None and self.terminated:
            raise InputError(f"{self.ending} It has figures only for earlier spans, which must be given.")
        spans = chosen_spans(choice, self.distance, self.alignment, self.designed.line_ends)
        if spans is None:
            return None
        _, end = self.alignment.limits(spans)
        if self.position[-1] + self.stride < end:
            first, last = spans
            if self.terminated:
                raise InputError(f"Spans {first} to {last} end at {end:g} m. {self.ending}")
            raise InputError(
                f"spans {first} to {last} end at {end:g} m, but the run ends at "
                f"{self.position[-1]:.1f} m; run further or choose earlier spans."
            )
        return spans

    def inside(self, spans: SpanChoice = None) -> NDArray[np.bool_]:
        """Which samples lie inside the spans, (n,). Raises InputError as ``spans`` does."""
        covered = self.spans(spans)
        if covered is None:
            return np.ones(len(self.time), dtype=bool)
        return self.alignment.within(self.position, covered)

    def save(self, path: str | Path, spans: SpanChoice = None) -> None:
        """Write a Parquet, CSV or Excel file, whole or not at all, by its suffix.

        A Parquet file is the whole run, which ``load`` reads again; it has a column for each series, each
        support and each dropper, by number. CSV has the same columns as far as the train came, and the
        filtered force, with units in the headings. A workbook (.xlsx) has them without the droppers, and
        sheets of figures, requirements included, and of droppers, both over ``spans`` as in ``summary``.
        Raises InputError for a name with another suffix, and for a run that is too long for Excel.
        """
        from .run_tables import save_tables
        from .stored_run import write

        check_output(path, OUTPUTS)
        if Path(path).suffix.lower() in SUFFIXES:
            write(self, path)
        else:
            save_tables(self, path, spans)

    @classmethod
    def load(cls, path: str | Path) -> Trajectory:
        """Read a file of ``save``. Raises InputError where it is not a whole trajectory, or is damaged."""
        from .stored_run import read

        return read(path)


def follower_columns(follower: Trajectory, number: int, rows: int) -> dict[str, Array]:
    """Series of a collector behind the first, by name, (rows,); nan before it came onto the line.

    number: of the collector, counted from 1.
    """
    before = np.full(rows - len(follower.time), np.nan)
    return {f"{name}@{number}": np.concatenate([before, getattr(follower, name)]) for name in follower.series}
