"""One text table per track: every policy's change of sigma on every line, at every speed."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from statistics import mean

from panto_env.base.table import Table
from panto_env.terminal import number

from ..benchmark.overall import next_in_ranking, with_feedback
from ..benchmark.statistics import LineAtSpeed
from .result import Result, StoredCell, StoredStanding

OVERALL = ("all", "95 %", "CL (%)", "ΔCF (%)", "worst quarter", "better than next", "mean moved in")
"""Headings of the columns over all passes."""
TRAINING = "· "
"""Before the name of a method's training."""


def summary(result: Result) -> Table:
    """Table of policies, by rank, over lines and speeds; the best policy of each column is marked with *.

    Cells are changes of sigma (%) from the passive pantograph at the same mean force. A cell without a rank
    shows by how much the policy moves the mean, or that it ended early. The last columns are over all passes:
    the change with its 95 % interval, the mean of the worst quarter of passes, the share of passes in which
    the policy is better than the next one, with its interval, and in how many it moves the mean by more than
    1.5 %. A method's trainings follow it. CL and the change of CF are means over cells.
    """
    lines = {place[:2] for place in result.places}
    headings = ("policy", *(_heading(place, len(lines) > 1) for place in result.places), *OVERALL)
    cells = {(cell.policy, cell.place): cell for cell in result.cells}
    after = next_in_ranking(result.standings)
    rows = []
    for one in result.by_rank:
        name = f"{TRAINING}{one.policy}" if one.policy in result.method_of else one.policy
        own = [[cells[run, place] for run in one.trainings or (one.policy,)] for place in result.places]
        rows.append((name, *map(_text, own), *_overall(one, after.get(one.policy))))
    oracles = [_oracle(result, place) for place in result.places]
    if any(oracles):
        rows.append(("*oracle*", *(each or "–" for each in oracles), *["–"] * len(OVERALL)))
    seeds = result.cells[0].seeds
    title = with_feedback(f"{result.title}: Δσ (%), {seeds} seeds", result.standings)
    return Table(title, headings, tuple(rows))


def _overall(one: StoredStanding, after: str | None) -> tuple[str, ...]:
    """The columns ``OVERALL`` of a policy; after: the policy ranked next."""
    moved = f"{one.moved} of {one.passes}"
    losses = number(one.contact_loss, 2), number(one.cost_change, 0)
    if one.disqualified:
        return "–", "–", *losses, "–", "–", moved
    between = "–" if one.interval is None else "{:.1f} to {:.1f}".format(*one.interval)
    if one.interval_for_lines is not None:
        between += " (other lines {:.1f} to {:.1f})".format(*one.interval_for_lines)
    return (
        f"{one.change:.1f}",
        between,
        *losses,
        f"{one.worst_quarter:.1f}",
        str(one.better_than.get(after or "", "–")),
        moved,
    )


def _heading(place: LineAtSpeed, several_lines: bool) -> str:
    return f"{place.catenary}, {place.speed_kmh:g}" if several_lines else f"{place.speed_kmh:g} km/h"


def _text(cells: Sequence[StoredCell]) -> str:
    """Change in a policy's cell, or the mean over the cells of a method's trainings."""
    change, moved = mean(cell.change for cell in cells), mean(cell.mean_change for cell in cells)
    if isnan(change):
        return "ended early"
    if any(cell.disqualified for cell in cells):
        return f"({change:.1f}; mean {moved:+.1f})"
    return f"{change:.1f}{' *' if cells[0].rank == 1 and len(cells) == 1 else ''}"


def _oracle(result: Result, place: LineAtSpeed) -> str:
    """Change of sigma (%) of the stored oracle for a line at a speed, or ""."""
    for cell in result.cells:
        if cell.place == place and cell.oracle is not None:
            return f"{cell.oracle:.1f}"
    return ""
