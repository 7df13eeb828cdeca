"""Each policy's overall result on a track: over all lines, speeds and seeds of a benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .settings import REFERENCE
from .single_pass import Row
from .statistics import (
    Array,
    Cell,
    LineAtSpeed,
    bootstrap_interval,
    interquartile_mean,
    relative_changes,
)


@dataclass(frozen=True)
class Standing:
    """Overall result of one policy on a track."""

    policy: str
    change: float  # of sigma from the passive one at the same mean force, interquartile mean of passes (%)
    interval: tuple[float, float] | None  # 95 % interval of ``change``, seeds resampled within each cell
    worst: float  # maximum change of any cell (%)
    worst_at: str  # line and speed of that cell
    improved: float  # share of passes with a smaller sigma than the passive one at the same mean force
    effort: float  # rms actuator force, mean over cells (N)
    power: float  # mechanical power, mean over cells (W)
    saturation: float  # share of control steps at the actuator's limit, mean over cells
    oracle_share: float | None  # share of the stored oracles' gain, mean over cells; None if one is missing
    better_than: Mapping[str, float]  # by other policy: share of passes with a smaller change than that one
    disqualified: str  # the reason, or "" if the policy qualifies in every cell
    rank: int | None  # by ``change``, from 1


def standings(rows: Sequence[Row], cells: Sequence[Cell]) -> tuple[Standing, ...]:
    """Overall results of the policies that run in every cell, in the order of the rows.

    Policies that qualify in every cell are ranked.
    """
    changes: dict[str, dict[LineAtSpeed, Array]] = {}
    for cell in cells:
        own = [row for row in rows if _place(row) == _place(cell) and row.policy == cell.policy]
        changes.setdefault(cell.policy, {})[_place(cell)] = relative_changes(own)
    places = list(changes[REFERENCE])
    everywhere = {policy: found for policy, found in changes.items() if list(found) == places}
    found = [_standing(policy, everywhere, cells) for policy in everywhere]
    ranked = sorted(each.change for each in found if not each.disqualified)
    return tuple(
        each if each.disqualified else replace(each, rank=1 + ranked.index(each.change)) for each in found
    )


def _place(one: Row | Cell) -> LineAtSpeed:
    return LineAtSpeed(one.catenary, one.pantograph, one.speed_kmh)


def _standing(
    policy: str, changes: Mapping[str, Mapping[LineAtSpeed, Array]], cells: Sequence[Cell]
) -> Standing:
    own = [cell for cell in cells if cell.policy == policy]
    by_place = changes[policy]
    every = np.concatenate(list(by_place.values()))
    worst = max(own, key=lambda cell: -np.inf if np.isnan(cell.change) else cell.change)
    reasons = [cell for cell in own if cell.disqualified]

    def mean(name: str) -> float:
        return float(np.mean([cell.figures[name] for cell in own]))

    return Standing(
        policy=policy,
        change=100 * interquartile_mean(every),
        interval=bootstrap_interval(*(100 * found for found in by_place.values())),
        worst=worst.change,
        worst_at=f"{worst.catenary}, {worst.speed_kmh:g} km/h",
        improved=float(np.mean([cell.improved for cell in own])),
        effort=mean("effort"),
        power=mean("power"),
        saturation=mean("saturation"),
        oracle_share=_oracle_share(own),
        better_than={
            other: float(np.mean([np.mean(by_place[place] < found[place]) for place in by_place]))
            for other, found in changes.items()
            if other != policy
        },
        disqualified=f"{_where(reasons[0])}: {reasons[0].disqualified}" if reasons else "",
        rank=None,
    )


def _oracle_share(cells: Sequence[Cell]) -> float | None:
    shares = [cell.oracle_share for cell in cells if cell.oracle_share is not None]
    return float(np.mean(shares)) if len(shares) == len(cells) else None


def _where(cell: Cell) -> str:
    return f"{cell.catenary} at {cell.speed_kmh:g} km/h"
