"""Lanes of trains on one line: the arrays behind the kernels; and how lanes go on with one lane's state."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..backend import aligned_zeros, bind, copy_whole, pack
from ..base.arrays import Array, Index, Lanes, sparse_zeros, to_kmh
from ..base.errors import InputError, beside
from .catenary import CATENARIES, CatenaryData, CatenaryModel
from .catenary.flexible.scattered_build import slots_of_links
from .catenary.protocol import check_speeds
from .catenary.schema import check_span_count
from .line_condition import DrawnLine
from .numerics import RUNS, Numerics, Runs
from .pantograph.schema import (
    NONE_REFLECTED,
    PantographData,
    check_compression,
    pantographs,
    parts,
    rest_state,
)
from .pantograph.step import Part
from .speed import ahead, gain
from .state import LATERAL_EVERY, SAMPLE_ROWS, Place, Row, Run, Samples, per_collector
from .step import advance
from .train import Train
from .wind import GUST_ROWS, check_wind, draw_wind, winds_at


class Plant:
    """A train on a line in each lane; all lanes advance together in one kernel call."""

    def __init__(
        self,
        catenary: CatenaryData,
        train: Train,
        *,
        lanes: int = 1,
        spans: int | None = None,
        numerics: Numerics | None = None,
        runs: Runs = RUNS,
        bilateral: bool = False,
        varied: bool = False,
        drifting: int = 0,
    ) -> None:
        """Build the line and the tables of all lanes; each lane must be started before it advances.

        runs: the speeds and line conditions for which the plant is built. bilateral: let the contact pull, as
        paper 3's equations do. varied: each lane may have a pantograph with other values. drifting: number
        of entries of each lane's drift, 0 where the speed is constant. Raises InputError where grid and step
        are not usable, or a defect is given at a dropper, support or place that the line does not have; and
        for several collectors on a line along which no waves run from one to the other.
        """
        riding = [own.pantograph for own in train.collectors]
        count, kind = len(riding), CATENARIES[catenary.kind]
        if count > 1 and not kind.several_collectors:
            raise InputError(
                "Several pantographs need a flexible catenary or a single wire, whose waves run from one to "
                f"the other, and line '{catenary.name}' is neither; give one pantograph, or another line."
            )
        self.catenary, self.train, self.lanes, self.runs = catenary, train, lanes, runs
        self.spans = check_span_count(catenary.spans if spans is None else spans)
        self.alignment = catenary.alignment(self.spans)
        winds = [condition.weather for condition in runs.conditions if condition.wind]
        for own in riding:
            check_wind(winds, runs.speeds, own)
            own.check_heights(catenary.name, catenary.contact_heights)
        size: dict[str, Any] = {"lanes": lanes, "collectors": count, "spans": self.spans}
        self.model: CatenaryModel = kind.model(catenary, **size, numerics=numerics or Numerics(), runs=runs)
        if bilateral and self.model.wires_per_collector > 1:
            two = "two side by side" if catenary.wires_touched > 1 else "overlaps of two"
            raise InputError(
                f"A contact that may pull (bilateral) has one wire, and line '{catenary.name}' has {two}; "
                "take a line of one contact wire without overlaps."
            )
        self.time_step = self.model.time_step
        self.speed = np.zeros(lanes)  # of each lane's train, its mean where it drifts (m/s)
        sizes = [2 * len(own.masses) for own in riding]
        self.pantographs = pantographs(sizes, lanes if varied else 1)
        for number, own in enumerate(riding):
            self._set_pantograph(number, np.arange(self.pantographs.table.shape[1]), own)
        self.actuators = train.first.actuator.arrays(self.time_step, lanes, count)
        waves = max(condition.waves for condition in runs.conditions)
        heights = sorted({0.0, *(height for own in riding for height, _ in own.force_over_height)})
        speeds = np.array(sorted({0.0, *(speed for own in riding for speed, _ in own.uplift_table)}))
        speeds /= to_kmh(1.0)
        lateral: Array = np.zeros(0)
        if any(own.rolls for own in riding):
            places = np.arange(0.0, self.alignment.length + LATERAL_EVERY, LATERAL_EVERY)
            lateral = catenary.lateral(places, self.spans, runs.conditions)
        squared = to_kmh(1 / self.time_step) ** 2
        self.run = Run(
            table=aligned_zeros((count, lanes, Row.STATE + 2 * max(sizes) + (2 if lateral.size else 0))),
            distance=per_collector((own.distance for own in train.collectors), float, count),
            driven=per_collector((own.driven for own in train.collectors), int, count),
            aerodynamic=per_collector(
                (own.aerodynamic_coefficient * squared for own in riding), float, count
            ),
            over_stride=np.array(
                [speeds * self.time_step, *(0.0 * speeds + own.tabled_uplift(speeds) for own in riding)]
            ),
            tunnels=catenary.tunnel_rows,
            waves=aligned_zeros((lanes, 3 * waves)),
            drift=aligned_zeros((lanes, drifting)),
            wind=aligned_zeros((lanes, GUST_ROWS if winds else 0)),
            alignment=self.alignment.arrays,
            levels=np.array(catenary.contact_heights),
            over_height=np.array([heights, *(own.force_over(heights) for own in riding)]),
            lateral=lateral,
            lowest_force=-np.inf if bilateral else 0.0,
        )
        copy_whole(*self.arrays)
        self._advance: Callable[..., Any] | None = None  # bound to the arrays at the first call

    def __getstate__(self) -> dict[str, Any]:
        """State without the kernel that is bound to the arrays: a copy has arrays of its own."""
        return vars(self) | {"_advance": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        copy_whole(*self.arrays)

    @property
    def pantograph(self) -> PantographData:
        """The first collector's pantograph."""
        return self.train.first.pantograph

    def row(self, row: Row) -> Array:
        """A row of the first collector in all lanes, (lanes,), a copy."""
        return self.run.table[0, :, row].copy()

    def of(self, lane: int, row: Row, collector: int = 0) -> float:
        """A row of a collector in one lane."""
        return float(self.run.table[collector, lane, row])

    def ahead(self, lanes: Any, steps: Array) -> Array:
        """Lead of the trains in lanes, (n,), over steady ones (m), (n, m), after numbers of steps, (n, m)."""
        return ahead(self.run.drift[lanes], steps)

    def position(self, lane: int, steps: Any, collector: int = 0) -> Array:
        """Position of a lane's collector (m), (n,), after numbers of steps, (n,), not necessarily whole."""
        steps = np.atleast_1d(steps)
        steady = steps * self.time_step * self.speed[lane]
        way = steady + self.ahead(np.array([lane]), steps[None])[0]
        return np.asarray(way - self.train.collectors[collector].distance)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The named tuples that every kernel takes first: line, wire, pantographs, actuators, run."""
        return self.model.line, self.model.wire, self.pantographs, self.actuators, self.run

    def check_speed(self, speed: float) -> None:
        """Raise InputError unless a train can run at this speed (m/s) on this line."""
        check_speeds(self.catenary.name, self.model.wave_speed, [speed])

    def _set_pantograph(self, collector: int, lanes: Lanes, pantograph: PantographData) -> None:
        own = self.train.collectors[collector]
        reflected = own.actuator.reflected_masses if own.driven else NONE_REFLECTED
        constants = parts(pantograph, self.model, reflected, self.catenary.wires_touched)
        self.pantographs.table[collector, lanes, : len(constants)] = constants

    def start(
        self,
        lanes: Lanes,
        speeds: Any,
        drawn: Sequence[DrawnLine] = (),
        pantographs: Sequence[Sequence[PantographData]] = (),
        static_forces: Array | None = None,
        drift: Array | None = None,
    ) -> None:
        """Put lanes at the start of the line, at rest under the nominal force at their present speed.

        Every collector starts at the line's first anchor; those behind the first wait there until their turn
        to go. lanes: a number or (n,). speeds: of the trains (m/s), a number or (n,), below the wave speed of
        the wire. drawn: the lanes' lines, from ``line_condition.draw``; by default as the first condition
        gives them. pantographs: of the collectors, for each lane, where they are varied. static_forces:
        instead of the pantographs', (collectors, n) (N). drift: of their speeds, (n, drifting), by default
        none. Raises InputError for a bad speed, and for springs of a pantograph that give way.
        """
        lanes, run = np.atleast_1d(lanes), self.run
        speeds = np.full(len(lanes), speeds, dtype=float)
        check_speeds(self.catenary.name, self.model.wave_speed, (speeds.min(), speeds.max()))
        self.speed[lanes] = speeds
        drawn = drawn or [DrawnLine(self.runs.conditions[0])] * len(lanes)
        waves = np.zeros((len(lanes), run.waves.shape[1]))
        for own_waves, line in zip(waves, drawn, strict=True) if waves.size else ():
            own_waves[: line.waves.size] = line.waves.ravel()
        run.waves[lanes] = waves
        run.drift[lanes] = 0.0 if drift is None else drift
        if run.wind.shape[1]:
            run.wind[lanes] = [
                draw_wind(line.condition.weather, self.time_step) if line.wind is None else line.wind
                for line in drawn
            ]
        uneven = np.sum(waves[:, ::3] * np.cos(2 * np.pi * waves[:, 2::3]), axis=1)
        heights = self.model.start_point.height + uneven
        for collector in range(len(self.train.collectors)):
            static = None if static_forces is None else static_forces[collector]
            varied = [own[collector] for own in pantographs]
            run.table[collector, lanes] = self._at_rest(collector, lanes, heights, varied, static)
        if not self.model.massless:
            forces = run.table[0, lanes, Row.CONTACT_FORCE].tolist()
            for lane, line, force in zip(lanes.tolist(), drawn, forces, strict=True):
                self.model.settle(lane, line, force)
        self.actuators.table[:, lanes] = 0.0

    def _at_rest(
        self,
        collector: int,
        lanes: Index,
        heights: Array,
        pantographs: Sequence[PantographData],
        static_forces: Array | None,
    ) -> Array:
        """Rows of a collector in lanes, (n, rows), at rest at the start; heights: of the wire there (m)."""
        own, run, start = self.train.collectors[collector], self.run, self.model.start_point
        for lane, pantograph in zip(lanes, pantographs, strict=False):
            self._set_pantograph(collector, lane, pantograph)
        strip: Any = float(self.pantographs.table[collector, 0, Part.STRIP_COMPLIANCE])  # alike in all lanes
        compliance: Any = strip + start.wire_compliance + start.spring_compliance
        speeds = self.speed[lanes]
        nominal_forces = own.pantograph.nominal_force(speeds)
        if static_forces is not None:
            nominal_forces = nominal_forces + (static_forces - own.pantograph.static_force)
        strides = speeds * self.time_step
        now = strides + gain(run.drift[lanes], 0.0)
        lifts = nominal_forces + run.aerodynamic[collector] * (now**2 - strides**2)
        wind = winds_at(run.wind[lanes], -own.distance, 0.0) if run.wind.shape[1] else 0.0
        by_wind = run.aerodynamic[collector] * wind * (2 * now + wind)
        if run.over_stride.shape[1] > 1:
            mean, present, in_wind = (
                own.pantograph.tabled_uplift(each / self.time_step) for each in (strides, now, now + wind)
            )
            lifts, by_wind = lifts + (present - mean), by_wind + (in_wind - present)
        if run.tunnels.shape[1]:
            blowing, more = (np.interp(-own.distance, run.tunnels[0], row) for row in run.tunnels[1:])
            still = own.pantograph.aerodynamic_uplift(now / self.time_step)
            by_wind = by_wind * blowing + still * more
        begin = run.levels[:1].sum()  # height there; 0 on a level line
        by_height = np.array([each.lift_over(begin) for each in pantographs or [own.pantograph]])
        aside = float(run.lateral[:1].sum())  # 0 where no head rolls
        rolled = aside**2 / own.pantograph.roll_stiffness if own.pantograph.rolls else 0.0
        compliance += rolled
        rest = partial(rest_state, pantographs or own.pantograph, lifts + by_wind + by_height)
        if self.catenary.wires_touched > 1:  # the lower wire alone is touched, or both
            above = heights + max(start.apart, 0.0)
            lower, middle = heights + min(start.apart, 0.0), heights + start.apart / 2
            one, both = rest(lower, compliance), rest(middle, compliance / 2)
            touched = both[:, 0] > above
            state = np.where(touched[:, None], both, one)
            heights = np.where(touched, middle, lower)
            compliance = strip = np.where(touched, strip / 2, strip)
        else:
            state = rest(heights, compliance)
        check_compression(own.pantograph.name, state)
        forces = (state[:, 0] - heights) / compliance
        table = np.zeros((len(lanes), run.table.shape[2]))
        table[:, Row.STATE : Row.STATE + state.shape[1]] = state
        for row, values in (
            (Row.STRIDE, strides),
            (Row.NOMINAL_FORCE, nominal_forces),
            (Row.LIFT, lifts),
            (Row.WIND, by_wind),
            (Row.CONTACT_FORCE, forces),
            (Row.HEAD_HEIGHT, state[:, 0]),
            (Row.FRAME_HEIGHT, state[:, state.shape[1] // 2 - 1]),
            (Row.WIRE_HEIGHT, state[:, 0] - forces * (strip + rolled)),
        ):
            table[:, row] = values
        if aside and own.pantograph.rolls:
            table[:, -2] = -forces * aside / own.pantograph.roll_stiffness
        return table

    def samples(self, rows: int, *, tension: bool = False) -> Samples:
        """Arrays in which kernels record; rows: number of steps to keep, plus one for the start."""
        droppers, two = len(self.model.droppers) if tension else 0, self.catenary.wires_touched > 1
        return Samples(
            rows=np.zeros((self.lanes, rows, len(self.train.collectors), SAMPLE_ROWS)),
            uplift=sparse_zeros((self.lanes, len(self.model.supports), rows)),
            tension=np.zeros((self.lanes, rows, droppers), dtype=np.float32),
            second=np.zeros((self.lanes, rows if two else 0, len(self.train.collectors))),
        )

    def clear(self, samples: Samples, lanes: Array) -> None:
        """Reset the samples of lanes, (n,), to rest: kernels write only what lies within the window."""
        used = lanes if samples.rows.shape[1] == 1 else lanes[samples.rows[lanes, 1].any(axis=(1, 2))]
        samples.uplift[used] = 0.0  # memory that is fresh stays untouched
        if samples.tension.shape[2]:
            for lane in lanes.tolist():
                samples.tension[lane] = self.model.rest_tension(lane)

    def advance(self, command: Array, steps: int, samples: Samples, lanes: int | None = None) -> None:
        """Advance the first lanes, by default all, by ``steps``.

        command: N, (lanes, collectors, places). The sample of a lane's step n (counted from 0) is recorded in
        row n + 1. Raises InputError where a train would run beyond the line's end, or the samples have no row
        for a step.
        """
        count = self.lanes if lanes is None else lanes
        self._check_way(steps, samples, count)
        if self._advance is None:
            self._advance = bind(advance, pack(*self.arrays), samples, command, steps, 0, 1)
        self._advance(samples, command, steps, 0, count)

    def _check_way(self, steps: int, samples: Samples, lanes: int) -> None:
        end, rows = self.row(Row.STEP)[:lanes] + steps, samples.rows.shape[1]
        if rows > 1 and end.max() >= rows:
            raise InputError(
                f"The samples have rows for {rows - 1} steps, not for {end.max():.0f}; make more rows."
            )
        drifted = self.ahead(np.arange(lanes), end[:, None])[:, 0]
        position = end * self.row(Row.STRIDE)[:lanes] + drifted
        if not self.model.massless and position.max() > self.model.length + 1e-6:
            farthest = beside(position.max(), self.model.length, ".1f")
            raise InputError(
                f"Lane {position.argmax()} would run to {farthest} m, beyond the line's end at "
                f"{self.model.length:g} m; take fewer steps, or more spans."
            )

    def advance_passively(self, steps: int, samples: Samples, lanes: int | None = None) -> None:
        """Advance the first lanes, by default all, by ``steps`` without actuators, as ``advance`` does."""
        self.advance(np.zeros((self.lanes, len(self.train.collectors), len(Place))), steps, samples, lanes)


class Kept(NamedTuple):
    """State of one lane of a flexible line, to go on with."""

    wire: tuple[Array, ...]  # its row of each array of the wires
    static: Array  # (links,): of its line (N)
    gap: Array  # (links,): (m)
    speed: float  # m/s
    rows: tuple[Array, ...]  # of pantographs, actuators and trains


def keep(plant: Plant) -> Kept:
    """The present state of the first lane of a flexible line."""
    line = plant.model.line
    wire = tuple(array[0].copy() for array in _arrays(plant.model.wire))
    rows = tuple(table[..., 0, :].copy() for table in _tables(plant))
    return Kept(wire, line.link_static[0].copy(), line.link_gap[0].copy(), float(plant.speed[0]), rows)


def go_on(plant: Plant, drawn: Sequence[DrawnLine], kept: Kept) -> None:
    """Put the first lanes into a kept state, of this plant or of one like it, each on a line of its own.

    The lines must have the kept one's tensions, and not differ from it where the train has been, nor for some
    spans ahead of it: three for a dropper, six for a support. Closer, the force would differ from that of a
    run from the line's start; waves ahead of a train have died out farther away.
    """
    line, wire = plant.model.line, plant.model.wire
    for lane, own_line in enumerate(drawn):
        plant.model.settle(lane, own_line, 0.0)
        for array, own in zip(_arrays(wire), kept.wire, strict=True):
            array[min(lane, len(array) - 1)] = own
        if len(line.link_static) > 1:  # else all lanes have one line
            numbers, sets, segments = slots_of_links(line, wire, lane)
            longer = (line.link_gap[lane] - kept.gap)[numbers]
            wire.static[lane, sets, segments] += (line.link_static[lane] - kept.static)[numbers]
            wire.gap[lane, sets, segments] += longer
            wire.extension[lane, sets, segments] -= longer
    plant.speed[: len(drawn)] = kept.speed
    for table, row in zip(_tables(plant), kept.rows, strict=True):
        table[..., : len(drawn), :] = np.expand_dims(row, -2)


def _arrays(tuples: Any) -> Iterator[Array]:
    """Arrays of nested named tuples."""
    for each in tuples:
        yield from [each] if isinstance(each, np.ndarray) else _arrays(each)


def _tables(plant: Plant) -> tuple[Array, ...]:
    """Tables whose last axis but one is the lanes."""
    run = plant.run
    return run.table, run.waves, run.drift, run.wind, plant.pantographs.table, plant.actuators.table
