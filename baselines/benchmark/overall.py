"""Each policy's overall result on a track: over all lines, speeds and seeds of a benchmark."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np

from panto_env.base.arrays import Array

from .harm import Harm, last_if_nan, window_changes
from .settings import REFERENCE, TAPE, Number, control_of
from .single_pass import LATE, Row
from .statistics import (
    ADVICE,
    MOVED,
    Cell,
    Clusters,
    Interval,
    Share,
    interquartile_mean,
    interval_for_lines,
    interval_of_mean,
    relative_changes,
    share_of,
    worst_quarter,
)

MOVED_PASSES = 1 / 3
"""Share of a track's passes from which on a policy is disqualified for moving the mean by over ``MOVED``.

Of 56 places of policies in the rankings of November 2026, 47 had no such pass. Lines as built had most: a
fifth for `skyhook`, `tuned-fb+ff` and `lqg`. With 16 seeds such a share has a standard error of 6 points: at
a quarter, chance would throw it out once in five times, at a third hardly ever.
``statistics.MOVED_AT_MOST`` refuses policies that press harder in fewer passes.
"""
NEAR = 5.0
"""Points of change (%) from the best policy within which a tape shows that a track needs no feedback."""


@dataclass(frozen=True)
class Standing:
    """Overall result of one policy on a track, or of one method over its trainings."""

    policy: str  # or the method's name
    change: Number  # of sigma from the passive one at the same mean force, interquartile mean of passes (%)
    interval: Interval | None  # 95 % interval of ``change``; None: see interval_of_mean
    interval_for_lines: Interval | None  # 95 % interval for other lines; None with fewer than three
    early: Number  # ``change`` in the early window alone (%)
    late: float | None  # in the late window alone (%); None unless all lines have one
    worst_quarter: Number  # the same change, mean of the quarter of passes where it is largest (%)
    worst: Number  # maximum change of any cell (%)
    worst_at: str  # line and speed of that cell
    improved: Number  # share of passes with a smaller sigma than the passive one at the same mean force
    contact_loss: Number  # CL, mean over cells (%)
    cost_change: Number  # of CF from the passive one at the same mean force, mean over cells (%)
    effort: Number  # rms actuator force, mean over cells (N)
    power: Number  # mechanical power, mean over cells (W)
    saturation: Number  # share of control steps at the actuator's limit, mean over cells
    oracle_share: float | None  # share of the stored oracles' gain, mean over cells; None if one is missing
    passes: int
    moved: int  # passes whose mean force the policy moves by more than 1.5 %
    most_moved: Number  # change of the mean force in the pass where it is largest (%)
    harm: Harm
    disqualified: str  # the reason, or "" if the policy qualifies in every cell
    rank: int | None = None  # by ``change``, from 1; a training has none, its method has
    better_than: Mapping[str, Share] = field(default_factory=dict)  # by other policy: see standings
    trainings: Mapping[str, Number] = field(default_factory=dict)  # of a method: ``change`` of each (%)


def standings(
    rows: Sequence[Row], cells: Sequence[Cell], methods: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> tuple[Standing, ...]:
    """Overall results of the policies that run in every cell, in the order of the rows, and then of methods.

    methods: the policies that are trainings of one method, by its name. A method's figures are means over its
    trainings, its interval and shares take in that these differ, and it qualifies if all of them do. Policies
    that qualify are ranked, methods in the place of their trainings. Those that may be ranked are compared in
    pairs: in which share of passes one has a smaller change than the other, on the same line under the same
    seed.
    """
    own_rows, own_cells = defaultdict(list), defaultdict(list)
    for row in rows:
        own_rows[row.policy].append(row)
    for cell in cells:
        own_cells[cell.policy].append(cell)
    places = [cell.place for cell in own_cells[REFERENCE]]
    everywhere = [name for name, own in own_cells.items() if [cell.place for cell in own] == places]
    passive = own_rows[REFERENCE]
    names = [row.catenary for row in passive]  # a seed is one line for all pantographs and cases
    lines = {name: k for k, name in enumerate(dict.fromkeys(names))}
    clusters = Clusters(np.array([lines[name] for name in names]), np.array([row.seed for row in passive]))
    changes = {name: relative_changes(own_rows[name])[None] for name in everywhere}
    found = {
        name: _standing(name, own_cells[name], own_rows[name], changes[name][0], clusters)
        for name in everywhere
    }
    for method, trainings in methods.items():
        changes[method] = np.concatenate([changes.pop(name) for name in trainings])
        found[method] = _of_method(method, [found[name] for name in trainings], changes[method], clusters)
    ranked = sorted(found[name].change for name in changes if not found[name].disqualified)
    for name, own in changes.items():
        shares = {
            other: share_of(own[:, None] < np.where(np.isnan(theirs), np.inf, theirs), clusters)
            for other, theirs in changes.items()
            if other != name
        }
        rank = None if found[name].disqualified else 1 + ranked.index(found[name].change)
        found[name] = replace(found[name], rank=rank, better_than=shares)
    return tuple(found.values())


def without_feedback(found: Sequence[Standing]) -> str:
    """Words for a track's heading if a tape is within ``NEAR`` of the best policy or better; else ""."""
    policies = [each for each in found if each.rank is not None and not control_of(each.policy)]
    tapes = [each for each in found if control_of(each.policy) == TAPE and isfinite(each.change)]
    if not policies or not tapes:
        return ""
    best, tape = (min(some, key=lambda each: each.change) for some in (policies, tapes))
    if tape.change > best.change + NEAR:
        return ""
    return f"needs no feedback: {tape.policy} {tape.change:.1f} %, {best.policy} {best.change:.1f} %"


def with_feedback(title: str, found: Sequence[Standing]) -> str:
    """A title, and that a tape is nearly as good as the best policy where it is."""
    return "; ".join(filter(None, (title, without_feedback(found))))


def next_in_ranking(found: Sequence[Standing]) -> dict[str, str]:
    """The policy that is ranked next after each one."""
    ranked = sorted((each for each in found if each.rank is not None), key=lambda each: each.rank or 0)
    return {one.policy: after.policy for one, after in pairwise(ranked)}


def _standing(
    policy: str, cells: Sequence[Cell], rows: Sequence[Row], changes: Array, clusters: Clusters
) -> Standing:
    worst = max(cells, key=lambda cell: last_if_nan(cell.change))
    shares = [cell.oracle_share for cell in cells if cell.oracle_share is not None]

    def mean(name: str) -> float:
        """Over the cells, each the mean of its windows."""
        windows = [
            [cell.figures[key] for key in (name, f"{LATE}{name}") if key in cell.figures] for cell in cells
        ]
        return float(np.mean([np.mean(each) for each in windows]))

    def in_window(number: int) -> float:
        return 100 * interquartile_mean(np.array([window_changes([row])[number, 0] for row in rows]))

    return Standing(
        policy=policy,
        change=100 * interquartile_mean(changes),
        interval=interval_of_mean(100 * changes, clusters),
        interval_for_lines=interval_for_lines(100 * changes, clusters),
        early=in_window(0),
        late=None if any(row.late is None for row in rows) else in_window(1),
        worst_quarter=100 * worst_quarter(changes),
        worst=worst.change,
        worst_at=_where(worst),
        improved=float(np.mean([cell.improved for cell in cells])),
        contact_loss=mean("contact_loss"),
        cost_change=float(np.mean([cell.cost_change for cell in cells])),
        effort=mean("effort"),
        power=mean("power"),
        saturation=mean("saturation"),
        oracle_share=float(np.mean(shares)) if len(shares) == len(cells) else None,
        passes=sum(cell.seeds for cell in cells),
        moved=sum(cell.moved for cell in cells),
        most_moved=max((cell.most_moved for cell in cells), key=_size),
        harm=Harm.over([(_where(cell), cell.harm) for cell in cells]),
        disqualified=_disqualification(cells),
    )


def _of_method(method: str, trainings: Sequence[Standing], changes: Array, clusters: Clusters) -> Standing:
    """changes: relative changes of sigma, (trainings, passes)."""
    names = (
        *("change", "early", "worst_quarter", "improved", "contact_loss", "cost_change", "effort", "power"),
        *("saturation", "late", "oracle_share"),
    )
    values = {name: [getattr(each, name) for each in trainings] for name in names}
    means: dict[str, Any] = {n: float(np.mean(own)) for n, own in values.items() if own[0] is not None}
    out = next((each for each in trainings if each.disqualified), None)
    return replace(
        max(trainings, key=lambda each: last_if_nan(each.worst)),
        policy=method,
        interval=interval_of_mean(100 * changes, clusters),
        interval_for_lines=interval_for_lines(100 * changes, clusters),
        passes=sum(each.passes for each in trainings),
        moved=sum(each.moved for each in trainings),
        most_moved=max((each.most_moved for each in trainings), key=_size),
        harm=Harm.over([(each.policy, each.harm) for each in trainings]),
        disqualified=f"{out.policy}: {out.disqualified}" if out else "",
        trainings={each.policy: each.change for each in trainings},
        **means,
    )


def _where(cell: Cell) -> str:
    return f"{cell.catenary}{cell.case and f', {cell.case}'}, {cell.speed_kmh:g} km/h"


def _size(value: float) -> float:
    return np.inf if np.isnan(value) else abs(value)


def _disqualification(cells: Sequence[Cell]) -> str:
    """Reason why a policy is not ranked over all cells; empty if it is."""
    for cell in cells:
        if cell.disqualified:
            case = cell.case and f", {cell.case},"
            return f"{cell.catenary}{case} at {cell.speed_kmh:g} km/h: {cell.disqualified}"
    passes, moved = sum(cell.seeds for cell in cells), sum(cell.moved for cell in cells)
    if moved >= MOVED_PASSES * passes:
        return (
            f"it moves the mean force by more than {100 * MOVED:g} % in {moved} of {passes} passes, "
            f"a third of them or more ({ADVICE})"
        )
    return ""


def why(disqualified: str) -> str:
    """Why a policy is not ranked, without the rule: what it does, and where."""
    where, known, what = disqualified.partition(": it ")
    told = (what if known else disqualified.removeprefix("it ")).partition(", more than")[0]
    return f"{told}: {where}" if known else told


def method_of(standings: Sequence[Standing]) -> dict[str, str]:
    """Methods by the names of their trainings."""
    return {name: one.policy for one in standings for name in one.trainings}


def by_rank(standings: Sequence[Standing]) -> list[Standing]:
    """Standings, the best first, each method before its trainings, and last those without a rank."""
    trainings = method_of(standings)
    own = {one.policy: one for one in standings}
    return [
        each
        for one in sorted(standings, key=lambda one: (one.rank is None, one.rank or 0))
        if one.policy not in trainings
        for each in (one, *(own[name] for name in one.trainings))
    ]
