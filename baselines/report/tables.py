"""Sortable tables of a page: the leaderboard, and one table per line and speed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import compress
from math import isfinite, isnan, nan
from statistics import mean
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

from panto_env.base.table import Table, number

from ..benchmark.overall import Standing, next_in_ranking, why, with_feedback
from ..benchmark.report import FIGURES, kilometre_tables, margins_table
from ..benchmark.run import Result
from ..benchmark.settings import LineAtSpeed
from ..benchmark.single_pass import ROW_LABELS
from ..benchmark.statistics import Cell
from .charts import Scale

BAR = 96.0  # width of the picture of an interval, in units of its view box
FAR_OFF = 25.0
"""Change of σ (%) beyond which a disqualified policy is left out of the scales of pictures and colours."""
R = TypeVar("R", Standing, Cell)


class Entry(NamedTuple):
    """One cell of a table."""

    text: str
    key: str = ""  # sort key: a number, or a text; "" comes last
    note: str = ""
    # positions along a picture ``BAR`` wide: of 0, low and high end of the interval, and the change itself
    bar: dict[str, float] | None = None


Column = tuple[str, Callable[[R], Entry]]
"""One column: its heading, and the function that makes its entry for a row."""


class PageTable(NamedTuple):
    """A sortable table; its second column, the policy, is the heading of each row."""

    caption: str
    headings: list[str]
    rows: list[dict[str, Any]]  # policy, whether it is disqualified or best, and its entries


def leaderboard(result: Result) -> PageTable:
    """Table of the policies that ran on every line, over all lines, speeds and seeds."""
    after = next_in_ranking(result.standings)

    def better(one: Standing) -> Entry:
        share = one.better_than.get(after.get(one.policy) or "")
        return Entry("–") if share is None else _share(share.share)._replace(note=share.between)

    # max(nan, 0.0) is nan, which is shown as such
    columns: list[Column[Standing]] = [
        *_first_columns(result.standings, result.method_of),
        ("CL (%)", lambda one: _figure(one.contact_loss, 2)),
        ("ΔCF (%)", lambda one: _signed(one.cost_change, 0)),
        ("worst quarter, Δσ (%)", lambda one: _signed(one.worst_quarter, 1)),
        ("worst cell, Δσ (%)", lambda one: _signed(one.worst, 1, f"at {one.worst_at}")),
        ("passes improved", lambda one: _share(one.improved)),
        *_by_window(result.standings),
        ("worst pass, Δσ (%)", lambda one: _signed(one.harm.worst, 1, one.harm.worst_at)),
        ("σ higher in", lambda one: _figure(one.harm.sigma, 0)),
        ("CL higher in", lambda one: _figure(one.harm.loss, 0)),
        ("contact lost in", lambda one: _figure(one.harm.lost, 0)),
        ("minimum lower in", lambda one: _figure(one.harm.minimum, 0)),
        ("at most by (N)", lambda one: _figure(max(one.harm.lowest_minimum, 0.0), 0)),
        ("uplift higher in", lambda one: _figure(one.harm.uplift, 0)),
        ("at most by (mm)", lambda one: _figure(max(1e3 * one.harm.most_uplift, 0.0), 1)),
        ("better than the next in", better),
        ("effort (N)", lambda one: _figure(one.effort, 1)),
        ("mechanical power (W)", lambda one: _figure(one.power, 1)),
        ("at limit", lambda one: _share(one.saturation)),
        ("mean moved in", lambda one: _moved(one.moved, one.passes)),
        ("maximum ΔF_m of a pass (%)", lambda one: _signed(one.most_moved, 1)),
    ]
    return _table("All lines, speeds and seeds", columns, result.by_rank)


def _by_window(rows: Sequence[R]) -> list[Column[R]]:
    """Columns of the windows, where there are two."""
    if all(one.late is None for one in rows):
        return []
    return [
        ("Δσ early (%)", lambda one: _signed(one.early, 1)),
        ("Δσ late (%)", lambda one: _signed(nan if one.late is None else one.late, 1)),
    ]


def table_of_cells(cells: Sequence[Cell], caption: str) -> PageTable:
    """Table of all policies on one line at one speed."""

    def of_figure(name: str) -> Column[Cell]:
        label = ROW_LABELS[name]
        return (
            label.short_heading.removesuffix(" (-)"),
            lambda one: _figure(label.scale * one.figures.get(name, nan), FIGURES[name]),
        )

    first = ("std", "contact_loss", "cost_function")
    columns: list[Column[Cell]] = [
        *_first_columns(cells),
        *map(of_figure, first),
        ("ΔCF (%)", lambda one: _signed(one.cost_change, 0)),
        ("passes improved", lambda one: _share(one.improved)),
        *_by_window(cells),
        ("worst pass, Δσ (%)", lambda one: _signed(one.harm.worst, 1, one.harm.worst_at)),
        ("ΔF_m (%)", lambda one: _signed(one.mean_change, 1)),
        ("mean moved in", lambda one: _moved(one.moved, one.seeds)),
        *(of_figure(name) for name in FIGURES if name not in first),
    ]
    return _table(caption, columns, sorted(cells, key=lambda one: (one.rank is None, one.rank or 0)))


def _first_columns(rows: Sequence[R], method_of: Mapping[str, str] = MappingProxyType({})) -> list[Column[R]]:
    """Columns of rank, policy and change of sigma, and of the oracle's gain if there is a stored oracle.

    method_of: methods by the names of their trainings, which the policies' names show.
    """

    def name(one: R) -> Entry:
        method = method_of.get(one.policy)
        return Entry(one.policy, one.policy, f"a training of {method}" if method else "")

    scale = _scale(rows)
    columns: list[Column[R]] = [
        ("rank", lambda one: Entry("–") if one.rank is None else Entry(str(one.rank), str(one.rank))),
        ("policy", name),
        ("Δσ (%)", lambda one: _change(one, scale)),
    ]
    if any(one.oracle_share is not None for one in rows):
        columns.append(("of the oracle's gain", lambda one: _share(one.oracle_share)))
    return columns


def _table(caption: str, columns: Sequence[Column[R]], rows: Sequence[R]) -> PageTable:
    made = [
        {"policy": one.policy, "disqualified": one.disqualified, "best": one.rank == 1}
        | {"entries": [entry(one) for _, entry in columns]}
        for one in rows
    ]
    return PageTable(caption, [heading for heading, _ in columns], made)


def _figure(value: float, decimals: int) -> Entry:
    return Entry(number(value, decimals), _key(value))


def _signed(value: float, decimals: int, note: str = "") -> Entry:
    return Entry(signed(value, decimals), _key(value), note)


def signed(value: float, decimals: int) -> str:
    """A change with its sign, but no sign if it rounds to zero; a dash if it is not finite."""
    if not isfinite(value):
        return "–"
    text = f"{value:+.{decimals}f}"
    return text[1:] if float(text) == 0 else text


def _share(value: float | None) -> Entry:
    if value is None or not isfinite(value):
        return Entry("–")
    return Entry(f"{100 * value:.0f} %", _key(value))


def _moved(passes: int, of: int) -> Entry:
    return Entry(f"{passes} of {of}", _key(passes / of))


def _key(value: float) -> str:
    return f"{value:.9g}" if isfinite(value) else ""


def _change(one: Standing | Cell, scale: Scale) -> Entry:
    if not isfinite(one.change):
        return Entry("–")
    low, high = one.interval or (one.change, one.change)
    note = "" if one.interval is None else f"{signed(low, 1)} to {signed(high, 1)}"
    if isinstance(one, Standing) and one.interval_for_lines is not None:
        note += "; other lines {} to {}".format(*(signed(end, 1) for end in one.interval_for_lines))
    bar = None
    if scale.lowest <= low and high <= scale.highest:
        places = {"zero": 0.0, "low": low, "high": high, "at": one.change}
        bar = {name: scale(value) for name, value in places.items()}
    return Entry(signed(one.change, 1), _key(one.change), note, bar)


def _scale(rows: Sequence[Standing | Cell]) -> Scale:
    """Scale of the pictures of intervals; a disqualified policy that is far off does not stretch it."""
    ends = [
        end
        for one in rows
        for end in (one.change, *(one.interval or ()))
        if isfinite(end) and (abs(end) <= FAR_OFF or not one.disqualified)
    ]
    lowest, highest = min([-1.0, *ends]), max([1.0, *ends])
    return Scale(lowest, highest, 4.0, BAR - 4.0)


OVERALL = ("all", "95 %", "CL (%)", "ΔCF (%)", "worst quarter", "better than next", "mean moved in")
"""Headings of the columns over all passes."""
TRAINING = "· "  # before the name of a method's training


def tables_of(result: Result) -> list[Table]:
    """Tables of a track for a document: the ranking, then cases, kilometres and margins where it has them."""
    by_case = [summary(result)] if any(place.case for place in result.places) else []
    margins = margins_table(result.title, result.settings.get("lines", ()), result.cells)
    tables = [ranking(result), *by_case, *kilometre_tables(result.title, result.cells), margins]
    return [table for table in tables if table is not None]


def _indented(result: Result, one: Standing) -> str:
    return f"{TRAINING}{one.policy}" if one.policy in result.method_of else one.policy


def ranking(result: Result) -> Table:
    """Table of policies over all passes, by rank, and why the last ones have none.

    Δσ with its 95 % interval for these lines, and for others like them; CL and the change of CF, means over
    cells; the worst pass; the share of passes in which the policy is better than the next one, with its
    interval. A method's trainings follow it.
    """
    after = next_in_ranking(result.standings)
    rows: list[tuple[str, ...]] = []
    for one in result.by_rank:
        name = _indented(result, one)
        windows = signed(one.early, 1), signed(nan if one.late is None else one.late, 1)
        figures = number(one.contact_loss, 2), number(one.cost_change, 0), signed(one.harm.worst, 0)
        if one.disqualified:
            out = f"({number(one.change, 1)})", "", ""
            rows.append((name, *out, *windows, *figures, "", why(one.disqualified)))
            continue
        between = one.interval, one.interval_for_lines
        intervals = ("" if each is None else "{:.1f} to {:.1f}".format(*each) for each in between)
        better = str(one.better_than.get(after.get(one.policy) or "", ""))
        rows.append((name, f"{one.change:.1f}", *intervals, *windows, *figures, better, ""))
    headings = ("policy", "Δσ (%)", "95 %", "other lines", "spans 10-19", "100 spans on", "CL (%)", "ΔCF (%)",
                "worst pass (%)", "better than next", "not ranked, since")  # fmt: skip
    of_lines = any(one.interval_for_lines for one in result.standings)
    late = any(one.late is not None for one in result.standings)
    known = [True] * 3 + [of_lines] + [late] * 2 + [True] * 5
    title = f"{result.title}: Δσ (%), {result.cells[0].seeds} seeds"
    return Table(
        with_feedback(title, result.standings),
        tuple(compress(headings, known)),
        [tuple(compress(row, known)) for row in rows],
    )


def summary(result: Result) -> Table:
    """Table of policies, by rank, over lines and speeds; the best policy of each column is marked with *.

    Cells are changes of sigma (%) from the passive pantograph at the same mean force. A cell without a rank
    shows by how much the policy moves the mean, or that it ended early. The last columns are over all passes:
    the change with its 95 % interval, the mean of the worst quarter of passes, the share of passes in which
    the policy is better than the next one, with its interval, and in how many it moves the mean by more than
    1.5 %. A method's trainings follow it. CL and the change of CF are means over cells.
    """
    headings = ("policy", *_headings(result.places), *OVERALL)
    cells = {(cell.policy, cell.place): cell for cell in result.cells}
    after = next_in_ranking(result.standings)
    rows = []
    for one in result.by_rank:
        own = [[cells[run, place] for run in one.trainings or (one.policy,)] for place in result.places]
        rows.append((_indented(result, one), *map(_text, own), *_overall(one, after.get(one.policy))))
    oracles = {cell.place: f"{cell.oracle:.1f}" for cell in result.cells if cell.oracle is not None}
    if oracles:
        changes = (oracles.get(place, "–") for place in result.places)
        rows.append(("*oracle*", *changes, *["–"] * len(OVERALL)))
    seeds = result.cells[0].seeds
    return Table(f"{result.title}: Δσ (%) by case, {seeds} seeds", headings, tuple(rows))


def _headings(places: Sequence[LineAtSpeed]) -> list[str]:
    """Headings of columns for lines, cases and speeds: what differs between them."""
    lines, speeds = ({getattr(at, name) for at in places} for name in ("catenary", "speed_kmh"))
    if len({at.line for at in places}) == 1:
        return [f"{at.speed_kmh:g} km/h" for at in places]
    if not any(at.case for at in places):
        return [f"{at.catenary}, {at.speed_kmh:g}" for at in places]
    return [
        ", ".join(
            [at.catenary] * (len(lines) > 1)
            + [at.case] * bool(at.case)
            + [f"{at.speed_kmh:g}"] * (len(speeds) > 1)
        )
        for at in places
    ]


def _overall(one: Standing, after: str | None) -> tuple[str, ...]:
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


def _text(cells: Sequence[Cell]) -> str:
    """Change in a policy's cell, or the mean over the cells of a method's trainings."""
    change, moved = mean(cell.change for cell in cells), mean(cell.mean_change for cell in cells)
    if isnan(change):
        return "ended early"
    reasons = [cell.disqualified for cell in cells if cell.disqualified]
    if reasons:
        return f"({change:.1f}; mean {moved:+.1f})" if "mean force" in reasons[0] else f"({change:.1f})"
    return f"{change:.1f}{' *' if cells[0].rank == 1 and len(cells) == 1 else ''}"
