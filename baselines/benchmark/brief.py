"""A benchmark's outcome in a hundred columns: who is first, by how much, and why others are out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby

from rich.console import Group, RenderableType
from rich.text import Text

from panto_env.base.table import Table, number

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
    out = {
        each.policy: f"Not ranked: {each.policy}: {why(each.disqualified)}."
        for each in standings
        if each.disqualified
    }
    judged = {each.policy for each in standings}
    for cell in outcome.cells:  # of policies that did not run on every line the first without a rank
        if cell.disqualified and cell.policy not in judged:
            words = f"Out there: {cell.policy}: {why(cell.disqualified)}, at {cell.speed_kmh:g} km/h."
            out.setdefault(cell.policy, words)
    return Group(*parts, *(Text(words, style="red") for words in out.values()), Text(NOTE, style="dim"))


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
    after, methods = next_in_ranking(standings), method_of(standings)

    def ahead(one: Standing) -> str:
        better = one.better_than.get(after.get(one.policy, ""))
        return "–" if better is None else f"{100 * better.share:.0f} %"

    columns: dict[str, Callable[[Standing], str]] = {
        "policy": lambda one: f"{methods[one.policy]}: {one.policy}" if one.policy in methods else one.policy,
        "rank": lambda one: "–" if one.rank is None else str(one.rank),
        "Δσ (%)": lambda one: (
            f"({number(one.change, 1)})" if one.rank is None else f"{number(one.change, 1)}{_within(one)}"
        ),
        "CL (%)": lambda one: number(one.contact_loss, 2),
        "worst pass (%)": lambda one: number(one.harm.worst, 0),
        "ahead of next": ahead,
    }
    title = with_feedback(f"{title}: all lines, speeds and seeds", standings)
    return Table.of(title, standings, columns)


def by_speed(cells: Sequence[Cell], title: str) -> Table:
    """Δσ of each policy at each speed of a line; in brackets where it is not ranked there."""
    speeds = list(dict.fromkeys(cell.speed_kmh for cell in cells))
    at = {(cell.policy, cell.speed_kmh): cell for cell in cells}

    def shown(cell: Cell) -> str:
        change = number(cell.change, 1)
        return f"({change})" if cell.disqualified else change

    policies = dict.fromkeys(cell.policy for cell in cells)
    rows = [(policy, *(shown(at[policy, speed]) for speed in speeds)) for policy in policies]
    return Table(title, ("policy", *(f"{speed:g} km/h" for speed in speeds)), rows)
