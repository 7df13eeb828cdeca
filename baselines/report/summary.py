"""One text table per track: every policy's change of sigma on every line, at every speed."""

from __future__ import annotations

from math import isnan

from panto_env.base.table import Table

from ..benchmark.statistics import LineAtSpeed
from .result import Result, StoredCell


def summary(result: Result) -> Table:
    """Table of policies, by rank, over lines and speeds; the best policy of each column is marked with *.

    Cells are changes of sigma (%) from the passive pantograph at the same mean force. A cell without a rank
    shows by how much the policy moves the mean, or that it ended early.
    """
    lines = {place[:2] for place in result.places}
    headings = ("policy", *(_heading(place, len(lines) > 1) for place in result.places), "all")
    cells = {(cell.policy, cell.place): cell for cell in result.cells}
    overall = {one.policy: one for one in result.standings}
    order = sorted(
        (policy for policy in result.policies if policy in overall),
        key=lambda policy: (overall[policy].rank is None, overall[policy].rank or 0),
    )
    rows = [
        (
            policy,
            *(_text(cells[policy, place]) for place in result.places),
            f"{overall[policy].change:.1f}" if overall[policy].rank is not None else "–",
        )
        for policy in order
    ]
    oracles = [_oracle(result, place) for place in result.places]
    if any(oracles):
        rows.append(("*oracle*", *(each or "–" for each in oracles), "–"))
    seeds = result.cells[0].seeds
    return Table(f"{result.title}: Δσ (%), {seeds} seeds", headings, tuple(rows))


def _heading(place: LineAtSpeed, several_lines: bool) -> str:
    return f"{place.catenary}, {place.speed_kmh:g}" if several_lines else f"{place.speed_kmh:g} km/h"


def _text(cell: StoredCell) -> str:
    if isnan(cell.change):
        return "ended early"
    if cell.disqualified:
        return f"({cell.change:.1f}; mean {cell.mean_change:+.1f})"
    return f"{cell.change:.1f}{' *' if cell.rank == 1 else ''}"


def _oracle(result: Result, place: LineAtSpeed) -> str:
    """Change of sigma (%) of the stored oracle for a line at a speed, or ""."""
    for cell in result.cells:
        if cell.place == place and cell.oracle_share:
            return f"{cell.change / cell.oracle_share:.1f}"
    return ""
