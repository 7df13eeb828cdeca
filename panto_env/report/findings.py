"""Content of a report besides a run's figures: supports, droppers, contact losses, elasticity."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..analysis.line_plan import LinePlan, line_plan
from ..base.arrays import Array
from ..base.errors import InputError
from ..base.table import Table
from ..catalog import unusual
from ..metrics.by_span import MovingDropper, SpanFigures, StretchFigures, by_span, by_stretch, moving_droppers
from ..metrics.compliance import Criterion
from ..metrics.figures import Figures, SpanChoice, losses_of_contact
from ..metrics.low_pass import low_pass
from ..metrics.strip import StripUse, strip_use
from ..metrics.trajectory import Trajectory
from ..plant.alignment import Spans
from ..plant.catenary.flexible import FlexibleCatenaryData
from ..plant.catenary.flexible.as_run import AsRun, as_run, as_run_tables, non_uniformity
from ..plant.catenary.flexible.static import RestingDropper, droppers_at_rest
from ..plant.pantograph.schema import PantographData

FOLDS = 240  # number of places in a span at which spans are compared


class Loss(NamedTuple):
    """One contact loss."""

    position: float  # where it begins (m)
    duration: float  # s


class Folded(NamedTuple):
    """The low-passed force of all evaluated spans over the place within the span."""

    share: Array  # (n,): of the span, 0 at the support where it begins (-)
    median: Array  # (n,): N
    low: Array  # (n,): minimum of all spans (N)
    high: Array  # (n,): maximum of all spans (N)


@dataclass(frozen=True, eq=False)
class Findings:
    """All findings of one run, of a train those of one pantograph; two objects are never equal."""

    run: Trajectory
    file: str
    number: int = 0  # of the pantograph in a train, from 1; 0: it is the only one
    train: tuple[Trajectory, ...] = ()  # records of all pantographs of the train

    @classmethod
    def of(cls, run: Trajectory, file: str) -> list[Findings]:
        """Findings of each pantograph of a run."""
        if not run.followers:
            return [cls(run, file)]
        return [cls(own, file, number, run.train) for number, own in enumerate(run.train, start=1)]

    @property
    def leads(self) -> bool:
        """Whether it is the first pantograph, or the only one: what concerns the whole run is said there."""
        return self.number <= 1

    @property
    def whole(self) -> Trajectory:
        """The run, with the records of all its pantographs."""
        return self.train[0] if self.train else self.run

    @cached_property
    def covered(self) -> Spans | None:
        """The evaluated spans, of a train the last one's; None where it ended early or is too short."""
        try:
            return self.whole.common_spans()
        except InputError:
            return None

    @cached_property
    def figures(self) -> Figures | None:
        """Figures of the evaluated spans."""
        return None if self.covered is None else self.run.summary(self.covered)

    @cached_property
    def criteria(self) -> list[Criterion]:
        """Requirements, and values without limits; of the line itself those of its plan."""
        own = [] if self.covered is None else self.run.compliance(self.covered)
        return own + (self.plan.criteria() if own and self.plan else [])

    @cached_property
    def plan(self) -> LinePlan | None:
        """The line seen from above, in the run's wind; None without stagger."""
        if not isinstance(self.line, FlexibleCatenaryData):
            return None
        return line_plan(self.line, self.run.identity.line_condition)

    @cached_property
    def strip_use(self) -> StripUse | None:
        """Where the contact wire ran on the collector strips in the evaluated spans; None without stagger."""
        return strip_use(self.run, self._chosen)

    @cached_property
    def line(self) -> Any:
        """Data of the line. Raises InputError where the file does not hold them."""
        with self._of_this_version():
            return self.run.designed.line

    @cached_property
    def pantograph(self) -> PantographData:
        """Data of the pantograph. Raises InputError where the file does not hold them."""
        with self._of_this_version():
            return self.run.designed.pantograph

    @cached_property
    def remarks(self) -> list[str]:
        """Sentences about values far from the catalogue's, as a wrong unit makes them."""
        if self.leads:
            return unusual(self.line) + unusual(self.pantograph)
        known = [own.designed.pantograph for own in self.train[: self.number - 1]]
        return [] if self.pantograph in known else unusual(self.pantograph)

    @contextmanager
    def _of_this_version(self) -> Iterator[None]:
        try:
            yield
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(
                f"{self.file} was written by an older version, without its line and pantograph as this one "
                "has them; simulate it again with `panto simulate --output`."
            ) from error

    @property
    def _chosen(self) -> SpanChoice:
        if self.covered is None:
            return "all"
        return self.covered if self.train else None  # the default of a single pantograph

    @cached_property
    def inside(self) -> Any:
        """Samples in the evaluated spans, (n,)."""
        return self.run.inside(self._chosen)

    @cached_property
    def filtered(self) -> Array:
        """The contact force of the whole run behind EN 50317's filter (N)."""
        return low_pass(self.run.contact_force, self.run.time_step)

    @cached_property
    def folded(self) -> Folded | None:
        """The force folded over the span."""
        if self.covered is None:
            return None
        share = np.linspace(0.0, 1.0, FOLDS, endpoint=False)
        first, last = self.covered
        places = (self.run.alignment.support(k - 1 + share) for k in range(first, last + 1))
        spans = [np.interp(each, self.run.position, self.filtered) for each in places]
        return Folded(share, np.median(spans, axis=0), np.min(spans, axis=0), np.max(spans, axis=0))

    @cached_property
    def uplifts(self) -> list[tuple[int, float, float]]:
        """Number, position (m) and maximum uplift (m) of the supports of the evaluated spans.

        Of two contact wires it is that of the one that rises more.
        """
        run = self.run
        begin, end = run.position[self.inside][[0, -1]]
        stride, places = 1.5 * run.stride, run.support_position[: run.uplift.shape[1]]
        return [
            (round(run.alignment.in_spans(place)), float(place), float(run.uplift_at(place).max()))
            for place in np.unique(places)
            if begin - stride <= place <= end + stride
        ]

    @cached_property
    def by_span(self) -> list[SpanFigures]:
        """Figures of each evaluated span, or of all that the run covers, where spans differ."""
        return by_span(self.run, self._chosen) if self.run.spans_differ else []

    @cached_property
    def by_stretch(self) -> list[StretchFigures]:
        """Figures of overlaps, of what lies behind them and of all else; none where there are no overlaps."""
        return by_stretch(self.run, self._chosen)

    @cached_property
    def at_rest(self) -> list[RestingDropper]:
        """Droppers of a span of the line, or of all where they differ, as designed, at rest."""
        return droppers_at_rest(self.line)

    @cached_property
    def droppers(self) -> list[MovingDropper]:
        """Droppers by place in the span, or one by one where spans differ: forces over the evaluated run."""
        return moving_droppers(self.run, self._chosen)

    @cached_property
    def losses(self) -> list[Loss]:
        """Contact losses in the evaluated spans."""
        run = self.run
        begins, ends = losses_of_contact(run.contact_force[self.inside])
        position = run.position[self.inside]
        return [
            Loss(float(position[begin]), float((end - begin) * run.time_step))
            for begin, end in zip(begins, ends, strict=True)
        ]

    @cached_property
    def elasticity(self) -> tuple[Array, Array, float] | None:
        """Places (m), uplift per newton (m/N) and its non-uniformity (%), at the mean force, if known."""
        run = self.as_run
        return run and (run.places, run.elasticities, non_uniformity(run.elasticities))

    @cached_property
    def as_run(self) -> AsRun | None:
        """The line at rest as it was run, at the mean force, if known; None for lines without wires."""
        if not isinstance(self.line, FlexibleCatenaryData):
            return None
        force = self.run.nominal_force if self.figures is None else self.figures.mean
        return as_run(self.line, self.run.identity.line_condition, force)

    @cached_property
    def as_run_tables(self) -> list[Table]:
        """The line as designed beside the line as run; none where they do not differ."""
        return [] if self.as_run is None else as_run_tables(self.line, self.as_run)

    @cached_property
    def plan_tables(self) -> list[Table]:
        """Supports and spans seen from above; none without stagger."""
        alignment = self.run.alignment
        return self.plan.tables(lambda k: alignment.support_name(k, k + 1)) if self.plan else []
