"""Cells: one policy on one line at one speed, over all seeds, compared with passive and ranked."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from panto_env.base.errors import beside

from .intervals import Array, Clusters, Interval, interquartile_mean, interval_of_mean
from .settings import REFERENCE
from .single_pass import Row

IDENTITY = ("policy", "catenary", "pantograph", "speed_kmh", "seed", "nominal_force", "terminated")
"""Columns that identify a row; all others are figures."""

MOVED = 0.015
"""Share by which a policy may move the mean force from that of its own passive run."""
MOVED_AT_MOST = 0.05
"""Share by which a policy may not move it in any pass, or it could do as it likes in one pass of four.

Interquartile means don't show that, and ``overall.MOVED_PASSES`` permits it. In the results of November 2026
no ranked policy moves the mean of any pass by more than 4.4 %, and `pd` moves it by up to 17 %.
"""


LEARNT = (
    "played again alone, a pass of it has other actions: it learns from other passes, or draws without a seed"
)
ADVICE = "a policy's attribute washout = 1.0 keeps the mean"
"""Advice to the author of a policy that is disqualified for moving the mean."""


class LineAtSpeed(NamedTuple):
    """A line, the pantograph on it, and its speed (km/h)."""

    catenary: str
    pantograph: str
    speed_kmh: float


@dataclass(frozen=True)
class Cell:
    """One policy on one line at one speed, over all seeds; changes are relative, pass by pass.

    "At the same mean": a passive pantograph on the same line with the mean force of the policy's own pass.
    """

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seeds: int
    nominal_force: float  # N
    figures: dict[str, float]  # interquartile means; nan if a pass ended early
    change: float  # of sigma from the passive pantograph at the same mean (%)
    interval: Interval | None  # 95 % interval of ``change``; None: see interval_of_mean
    cost_change: float  # of CF from the passive pantograph at the same mean (%)
    mean_change: float  # of the mean force from the unchanged passive pantograph (%)
    most_moved: float  # that change in the pass where it is largest (%)
    moved: int  # passes in which it is more than 1.5 %
    improved: float  # share of passes with a smaller sigma than the passive pantograph at the same mean
    spread: float  # standard deviation of sigma over the seeds, relative to its mean (%)
    oracle: float | None  # change of sigma that the stored oracle reaches (%); None without a pass of both
    oracle_share: float | None  # of the oracle's gain, over the passes that it ran; None likewise
    disqualified: str  # the reason, or "" if the policy qualifies
    rank: int | None  # by ``change`` among the policies that qualify, from 1


def mean_range(passive: float) -> tuple[float, float]:
    """Minimum and maximum mean force (N) that qualify, for a passive mean (N)."""
    return passive * (1 - MOVED), passive * (1 + MOVED)


def compare(
    rows: Sequence[Row],
    oracles: Mapping[LineAtSpeed, Mapping[int, float]] = MappingProxyType({}),
    learnt: Collection[str] = (),
) -> tuple[Cell, ...]:
    """Cells of all rows, in the rows' order of lines, speeds and policies; passive is the reference.

    oracles: change of sigma (%) of the stored oracles, by line and speed, and by seed. learnt: policies that
    learn from one pass for another, or play no pass twice in the same way; they are not ranked.
    """
    groups: dict[LineAtSpeed, dict[str, list[Row]]] = {}
    for row in rows:
        group = groups.setdefault(LineAtSpeed(row.catenary, row.pantograph, row.speed_kmh), {})
        group.setdefault(row.policy, []).append(row)
    return tuple(
        cell
        for place, rows_of_policies in groups.items()
        for cell in _ranked_cells(rows_of_policies, oracles.get(place, {}), learnt)
    )


def _ranked_cells(
    rows_of_policies: dict[str, list[Row]], oracle: Mapping[int, float], learnt: Collection[str]
) -> list[Cell]:
    """Cells of all policies on one line at one speed."""
    passive_rows = rows_of_policies[REFERENCE]
    cells = [_cell(rows, passive_rows, oracle) for rows in rows_of_policies.values()]
    cells = [replace(cell, disqualified=LEARNT) if cell.policy in learnt else cell for cell in cells]
    changes = sorted(cell.change for cell in cells if not cell.disqualified)
    return [
        cell if cell.disqualified else replace(cell, rank=1 + changes.index(cell.change)) for cell in cells
    ]


def _cell(rows: list[Row], passive_rows: list[Row], oracle: Mapping[int, float]) -> Cell:
    """Cell of one policy on one line at one speed, without its rank."""
    first = rows[0]
    tables = [row.as_dict() for row in rows]
    names = [name for name in tables[0] if name not in IDENTITY]
    figures = {name: interquartile_mean(np.array([table[name] for table in tables])) for name in names}
    sigma = np.array([row.figures.std for row in rows])
    changes = relative_changes(rows)
    costs = _relative(
        [row.figures.cost_function for row in rows], [row.pressed_cost_function for row in rows]
    )
    # Pass by pass, with the same line, speed, seed and noise.
    paired = zip(rows, passive_rows, strict=True)
    means = np.array([_mean_moved(row, passive) for row, passive in paired])
    both = [(own, oracle[row.seed]) for own, row in zip(changes, rows, strict=True) if row.seed in oracle]
    reached, bound = np.mean(both, axis=0).tolist() if both else (0.0, None)
    return Cell(
        policy=first.policy,
        catenary=first.catenary,
        pantograph=first.pantograph,
        speed_kmh=first.speed_kmh,
        seeds=len(rows),
        nominal_force=first.nominal_force,
        figures=figures,
        change=100 * interquartile_mean(changes),
        interval=interval_of_mean(100 * changes, Clusters.of_one_line(len(rows))),
        cost_change=100 * interquartile_mean(costs),
        mean_change=100 * interquartile_mean(means),
        most_moved=100 * float(means[np.argmax(np.abs(means))]),  # nan if any is nan
        moved=int(np.sum(np.abs(means) > MOVED)),
        improved=float("nan") if np.isnan(changes).any() else float(np.mean(changes < 0)),
        oracle=bound,
        oracle_share=None if bound is None else 100 * reached / bound + 0.0,  # no minus zero
        spread=float(100 * sigma.std(ddof=1) / sigma.mean()) if len(sigma) > 1 else float("nan"),
        disqualified=_disqualification(rows, passive_rows, means),
        rank=None,
    )


def _mean_moved(row: Row, passive: Row) -> float:
    """Relative change of the mean force in a pass: of several controlled pantographs the largest in size."""
    each = [own / its - 1 for own, its in zip(row.means, passive.means, strict=True)]
    return max(each, key=abs)


def relative_changes(rows: Sequence[Row]) -> Array:
    """Relative changes of sigma from the passive pantograph at the same mean, (rows,); nan if it has none."""
    return _relative([row.figures.std for row in rows], [row.pressed_std for row in rows])


def _relative(values: Sequence[float], to: Sequence[float]) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):  # a sigma of 0 has no relative change
        changes: Array = np.asarray(values) / np.asarray(to) - 1
    return changes


def _beyond(change: float, most: float) -> str:
    """A relative change that is larger in size than ``most``."""
    return f"{beside(100 * change, math.copysign(100 * most, change), '+.1f')} %"


def _disqualification(rows: list[Row], passive_rows: list[Row], means: Array) -> str:
    """Reason why a policy is not ranked; empty if it is.

    means: relative changes of the mean force, (rows,).
    """
    ended_early = sum(row.terminated for row in rows)
    if ended_early:
        return f"{ended_early} of {len(rows)} runs ended early, outside the plant's range"
    if any(row.terminated for row in passive_rows):
        return "the passive pantograph's runs ended early: there is nothing to compare with"
    typical, most = interquartile_mean(means), means[np.argmax(np.abs(means))]
    if abs(typical) > MOVED:
        return f"it moves the mean force by {_beyond(typical, MOVED)}, more than {100 * MOVED:g} % ({ADVICE})"
    if abs(most) > MOVED_AT_MOST:
        moved = _beyond(most, MOVED_AT_MOST)
        return (
            f"it moves the mean force by {moved} in one pass, more than {100 * MOVED_AT_MOST:g} % ({ADVICE})"
        )
    if any(np.isnan(row.pressed_std) for row in rows):
        return "no passive pantograph can reach its mean force"
    return ""
