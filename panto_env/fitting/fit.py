"""What a fit found: each value with its interval, whether it is identifiable, and the residual.

Where more is left in a span than noise, the model lacks something, which moves values. It is in the same
place of all records and no chance, but the only draw of it that there is: so values are as uncertain as it
moves them, as in a covariance by clusters (Bell and McCaffrey, 2002, Survey Methodology 28:169, recalled).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Array, one_thread
from ..estimation.innovations import Whiteness, whiteness
from ..plant.catenary.schema import CatenaryData
from ..plant.pantograph.schema import PantographData
from ..records.record import Record
from .misfit import OWN, Part, Problem, State
from .problem import problem
from .solve import FREEDOM, Fitting, Solution
from .values import USUAL, Value

SLACK = 0.015
"""Length (m) by which a dropper is surely too long to carry anything: three tolerances. Own choice."""
INTERVAL = 1.96
"""Standard deviations on each side of a 95 % interval."""
IDENTIFIABLE = 0.6
"""Share of its tolerance below which the standard deviation of an identifiable value has fallen."""
CORRELATED = 0.9
"""Correlation from which on two values are named: the records know their sum or difference better."""
FASTER = 2e-4
"""Relative difference of a train's speed from the simulated one above which it is simulated anew: twice as
much as of a tension."""
WHITE = 0.01
"""Probability below which a residual is called unlike noise."""
TOO_MUCH = 3.0
"""Standard deviations of noise's power by which a span has too much left. Own choice: one span of some 300
has so much by chance."""


@dataclass(frozen=True)
class Found:
    """One value of the fit, as its difference from the design."""

    value: Value
    difference: float
    deviation: float  # standard deviation

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the difference."""
        return self.difference - INTERVAL * self.deviation, self.difference + INTERVAL * self.deviation

    @property
    def identifiable(self) -> bool:
        """Whether the records determine it better than its tolerance."""
        return self.deviation < IDENTIFIABLE * self.value.tolerance

    @property
    def differs(self) -> bool:
        """Whether the design's value lies outside the interval."""
        return self.identifiable and abs(self.difference) > INTERVAL * self.deviation


def slack_droppers(found: Sequence[Found]) -> list[str]:
    """A sentence for each dropper that is so much too long that it carries nothing."""
    return [
        f"{each.value.name} reads {each.value.scale * each.difference:+.0f} mm: it carries nothing, so it is "
        "slack, probably broken; the values of its neighbours make up for that and are less sure."
        for each in found
        if each.value.kind == "droppers" and each.interval[0] > SLACK
    ]


def within(found: Iterable[Found], stretch: tuple[float, float]) -> tuple[Found, ...]:
    """Values that act everywhere, or have their place in a stretch (m)."""
    return tuple(
        each for each in found if each.value.place is None or stretch[0] <= each.value.place <= stretch[1]
    )


def moved(problem: Problem, solution: Solution) -> dict[int, Array]:
    """By how much what is left in each span that has too much moves all values, (n,).

    By numbers of the simulated spans, from 1.
    """
    deviation = solution.state.noise.ravel()[problem.band]
    both = np.column_stack([solution.jacobian, solution.residual]) / deviation[:, None]
    measured = [part.measured for part in problem.parts]
    pairs = zip(measured, problem.by_part(both), strict=True)
    rows = np.concatenate([own.back(coefficients.T).T for own, coefficients in pairs])
    shares = [np.full(len(own.place), len(own.compared) / len(own.place)) for own in measured]
    free = np.concatenate(shares)  # coefficients for each place
    design = problem.values.design
    spans = design.catenary.alignment(design.spans).span_of(np.concatenate([own.place for own in measured]))
    found = {}
    for span in np.unique(spans).tolist():
        inside = spans == span
        jacobian, left = rows[inside, :-1], rows[inside, -1]
        # Values follow noise too, most where few places tell them: what is left is made as large as it was.
        used, axes = np.linalg.eigh(jacobian @ solution.covariance @ jacobian.T)
        whole = axes @ ((axes.T @ left) / np.sqrt(np.maximum(1 - used, FREEDOM)))
        freedom = float(free[inside].sum())
        if whole @ whole > freedom + TOO_MUCH * np.sqrt(2 * freedom):
            found[span] = solution.covariance @ (jacobian.T @ whole)
    return found


def wider(covariance: Array, moves: Iterable[Array], prior: Array) -> Array:
    """Covariance, (n, n), with moves of all values added, (n,) each; no wider than the prior's, (n,)."""
    added = [np.outer(move, move) for move in moves]
    if not added:
        return covariance
    scale = np.outer(prior, prior)
    sizes, axes = np.linalg.eigh((covariance + np.sum(added, axis=0)) / scale)
    return np.asarray((axes * np.minimum(sizes, 1.0)) @ axes.T * scale)


@dataclass(frozen=True, eq=False)
class Fit:
    """The end of a fit."""

    problem: Fitting
    solution: Solution

    @property
    def parts(self) -> Sequence[Part]:
        """Pieces of records that were compared."""
        return self.problem.parts

    @cached_property
    def moved(self) -> dict[int, Array]:
        """Simulated spans that have more left than noise, and by how much it moves all values, (n,)."""
        return moved(self.problem, self.solution)

    @cached_property
    def covariance(self) -> Array:
        """(n, n), of all values: of the solution, and of what moves them."""
        return wider(self.solution.covariance, self.moved.values(), self.problem.prior)

    @cached_property
    def found(self) -> tuple[Found, ...]:
        """All values, of droppers and supports only those along what was compared."""
        x, deviations = self.solution.state.x, np.sqrt(np.diag(self.covariance))
        triples = zip(self.problem.values.all, x.tolist(), deviations.tolist(), strict=False)
        return within((Found(*each) for each in triples), self.problem.stretch)

    def of_kind(self, kind: str) -> list[Found]:
        """Values of one kind."""
        return [each for each in self.found if each.value.kind == kind]

    @property
    def differing(self) -> list[Found]:
        """Values that differ from the design."""
        return [each for each in self.found if each.differs]

    @cached_property
    def correlated(self) -> list[tuple[Value, Value, float]]:
        """Pairs of identifiable values that the records hardly tell apart, strongest first."""
        values = [each.value for each in self.found if each.identifiable]
        which = [self.problem.values.all.index(value) for value in values]
        covariance = self.covariance[np.ix_(which, which)]
        scale = np.sqrt(np.diag(covariance))
        matrix = np.triu(covariance / np.outer(scale, scale), 1)
        pairs = np.argwhere(np.abs(matrix) > CORRELATED)
        found = [(values[i], values[j], float(matrix[i, j])) for i, j in pairs]
        return sorted(found, key=lambda pair: -abs(pair[2]))

    @cached_property
    def residual(self) -> list[Array]:
        """Coefficients of each part, (coefficients,): measured less simulated (N)."""
        return self.problem.by_part(self.solution.residual)

    @cached_property
    def whiteness(self) -> list[Whiteness]:
        """Whether the residual of each part, divided by its noise, is white; one result per part."""
        deviation = self.solution.state.noise.ravel()[self.problem.band]
        parts = self.problem.by_part(self.solution.residual / deviation)
        return [whiteness(own[:, None]) for own in parts]

    @property
    def sensors(self) -> dict[str, Array]:
        """What was found of each of ``OWN``, (parts,); shifts are beside the rough ones."""
        return dict(zip(OWN, self.problem.sensors(self.solution.state.x), strict=True))

    def measured(self, k: int) -> Array:
        """Coefficients of a part's measured force (N), with its place, scale and gain corrected."""
        return self.parts[k].measured.coefficients(self.problem.measured(k, self.solution.state.x))

    @cached_property
    def std(self) -> list[tuple[float, float]]:
        """Standard deviation (N) of what is compared of each part, and of its residual."""
        return [
            (part.measured.std(self.measured(k)), part.measured.std(residual))
            for k, (part, residual) in enumerate(zip(self.parts, self.residual, strict=True))
        ]


def fit(
    records: Sequence[Record],
    line: CatenaryData,
    pantograph: PantographData,
    *,
    free: Sequence[str] = USUAL,
    tolerances: Mapping[str, float] | None = None,
    begin: State | None = None,
    report: Callable[[State, float], None] = lambda state, gain: None,
    working: Callable[[str], None] = lambda doing: None,
) -> Fit:
    """Fit ``free`` values of a line, and of the pantograph, to records of the contact force.

    line, pantograph: as designed. tolerances: standard deviations of values before any record is seen, by
    kind. begin: where to go on, by default with the design. report, working: as ``Fitting.run`` takes them.
    What is found does not depend on the number of cores: steps magnify what is rounded in another order.
    Raises InputError as ``problem`` does, and where a simulated pass diverges.
    """
    with one_thread():
        ready = problem(records, line, pantograph, free=free, tolerances=tolerances)
        if begin is None:
            begin = ready.start()
        elif np.abs(ready.sensors(begin.x)[3]).max() > FASTER:
            ready = ready.at_speeds(begin.x)
        solution = ready.run(begin, report, working)
        speeds = [part.fine.speed / part.measured.piece.speed - 1 for part in ready.parts]
        if np.abs(ready.sensors(solution.state.x)[3] - speeds).max() > FASTER:
            ready = ready.at_speeds(solution.state.x)
            solution = ready.run(solution.state, report, working)
        return Fit(ready, solution)
