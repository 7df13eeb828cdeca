"""A benchmark's outcome in a hundred columns: who is first, by how much, and why others are out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.console import Group, RenderableType
from rich.text import Text

from panto_env.base.table import Table
from panto_env.terminal import number

from .overall import Standing, by_rank, method_of, next_in_ranking, why, with_feedback
from .report import as_rich, spans_in_words
from .run import Benchmark
from .statistics import Cell

NOTE = (
    "Δσ: change of the contact force's standard deviation from a passive pantograph at the same mean force, "
    "mean of the middle half of passes, with its 95 % interval. CL: contact loss. Brackets: not ranked. "
    "--wide prints every figure at every speed, what does harm, and what the columns mean."
)


MOST_LINES = 2  # number of lines up to which Δσ is shown at each speed


def brief(outcome: Benchmark) -> RenderableType:
    """The headline, the ranking, Δσ at each speed of one or two lines, and why policies have no rank."""
    standings = by_rank(outcome.standings)
    parts: list[RenderableType] = [
        Text(headline(standings), style="bold"),
        as_rich(ranking(outcome.settings.title, standings)),
    ]
    if len(outcome.windows) <= MOST_LINES:
        groups = groupby(outcome.cells, key=lambda cell: cell.place.line)
        for (_, cells), windows in zip(groups, outcome.windows, strict=True):
            own = list(cells)
            parts.append(as_rich(by_speed(own, f"Δσ (%), {own[0].place.name}, {spans_in_words(windows)}")))
    parts += [
        Text(f"Not ranked: {each.policy}: {why(each.disqualified)}.", style="red")
        for each in standings
        if each.disqualified
    ]
    parts += [
        Text(
            f"Out there: {cell.policy}: {why(cell.disqualified)}, at {cell.place.speed_kmh:g} km/h.",
            style="red",
        )
        for cell in _out_elsewhere(outcome.cells, [each.policy for each in standings])
    ]
    return Group(*parts, Text(NOTE, style="dim"))


def _out_elsewhere(cells: Sequence[Cell], judged: Sequence[str]) -> list[Cell]:
    """Of each policy that did not run on every line, and has no standing: its first cell without a rank."""
    found: dict[str, Cell] = {}
    for cell in cells:
        if cell.disqualified and cell.policy not in judged:
            found.setdefault(cell.policy, cell)
    return list(found.values())


def headline(standings: Sequence[Standing]) -> str:
    """Who is first, by how much, and who follows."""
    ranked = [each for each in standings if each.rank is not None]
    if not ranked or not ranked[0].change < 0:
        return "No policy that is ranked lowers σ."
    first, *others = ranked
    words = f"{first.policy} is first: σ {number(first.change, 1)}{_within(first)} %"
    if not others:
        return f"{words}."
    better = first.better_than.get(others[0].policy)
    share = f"; better in {100 * better.share:.0f} % of passes" if better is not None else ""
    return f"{words}. {others[0].policy} follows with {number(others[0].change, 1)} %{share}."


def _within(one: Standing) -> str:
    """Half the width of a policy's 95 % interval."""
    return "" if one.interval is None else f" ± {(one.interval[1] - one.interval[0]) / 2:.1f}"


def ranking(title: str, standings: Sequence[Standing]) -> Table:
    """A row for each policy that ran on every line."""
    after = next_in_ranking(standings)
    methods = method_of(standings)
    rows = []
    for each in standings:
        change = f"{number(each.change, 1)}{_within(each)}"
        better = each.better_than.get(after.get(each.policy, ""))
        rows.append(
            (
                f"{methods[each.policy]}: {each.policy}" if each.policy in methods else each.policy,
                "–" if each.rank is None else str(each.rank),
                change if each.rank is not None else f"({number(each.change, 1)})",
                number(each.contact_loss, 2),
                number(each.harm.worst, 0),
                "–" if better is None else f"{100 * better.share:.0f} %",
            )
        )
    headings = ("policy", "rank", "Δσ (%)", "CL (%)", "worst pass (%)", "ahead of next")
    return Table(with_feedback(f"{title}: all lines, speeds and seeds", standings), headings, rows)


def by_speed(cells: Sequence[Cell], title: str) -> Table:
    """Δσ of each policy at each speed of a line; in brackets where it is not ranked there."""
    speeds = list(dict.fromkeys(cell.speed_kmh for cell in cells))
    at = {(cell.policy, cell.speed_kmh): cell for cell in cells}
    rows = []
    for policy in dict.fromkeys(cell.policy for cell in cells):
        own = [at[policy, speed] for speed in speeds]
        words = (
            f"({number(cell.change, 1)})" if cell.disqualified else number(cell.change, 1) for cell in own
        )
        rows.append((policy, *words))
    return Table(title, ("policy", *(f"{speed:g} km/h" for speed in speeds)), rows)
