"""The command `panto submission`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from panto_env.terminal import Json, PlainConsole, counting, print_json

if TYPE_CHECKING:
    from .submission import Checked

submission = typer.Typer(no_args_is_help=True, help="Submissions to the leaderboard.")


@submission.callback()
def _group() -> None:
    """Submissions to the leaderboard."""


@submission.command()
def check(
    folder: Annotated[Path, typer.Argument(help="Folder with card.toml and the policy that it names.")],
    config: Annotated[
        str, typer.Option(help="Track: TOML file of a benchmark, or a name.")
    ] = "benchmark/high-speed-as-built",
    seeds: Annotated[int, typer.Option(min=1, help="Number of seeds; a track has more.")] = 2,
    salt: Annotated[str | None, typer.Option(help="Make new test seeds from this text.")] = None,
    against: Annotated[
        Path | None, typer.Option(help="JSON of `panto benchmark` on the same track, to be ranked in.")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.", min=1)] = None,
    json: Json = False,
) -> None:
    """Run a submission as the benchmark would, with few seeds, and say whether it would be ranked, and where.

    Its policy runs in a process of its own, by the Python that PANTO_POLICY_PYTHON names.
    """
    from panto_env.base.settings import parse

    from ..report.result import read_result
    from .settings import BenchmarkSettings, load_benchmark
    from .submission import check as run_check

    given: dict[str, Any] = {"seeds": seeds, "salt": salt}
    settings = parse(BenchmarkSettings, load_benchmark(config).model_dump() | given, "the benchmark")
    ranked = [] if against is None else [each for each in read_result(against).standings if each.rank]
    with counting("passes") as progress:
        checked = run_check(folder, settings, workers, progress)
    if json:
        print_json({"card": checked.card.model_dump(mode="json"), "result": checked.outcome.as_dict()})
        return
    console = PlainConsole()
    for line in _report(checked, [each.change for each in ranked]):
        console.print(line, soft_wrap=True)


def _report(checked: Checked, others: list[float]) -> list[str]:
    """What is said of a submission, line by line."""
    from .submission import place_among

    card, standing, tape = checked.card, checked.standing, checked.tape
    interval = standing.interval
    within = f", 95 % interval {interval[0]:.1f} to {interval[1]:.1f}" if interval else ""
    lines = [
        f"{card.name} by {', '.join(card.authors)} ({card.licence})",
        f"Learnt from: {card.learnt_from}",
        f"Change of sigma: {standing.change:+.1f} %{within}; its tape: {tape.change:+.1f} %",
        f"Worst: {standing.worst:+.1f} %, {standing.worst_at}; ahead of passive in {standing.improved:.0%} "
        "of passes",
    ]
    if checked.requirements:
        lines.append(f"It requires: {', '.join(checked.requirements)}")
    if standing.disqualified:
        return [*lines, f"It would not be ranked: {standing.disqualified}."]
    where = f", at place {place_among(standing.change, others)} of {len(others) + 1}" if others else ""
    return [*lines, f"It would be ranked{where}."]
