"""The command `panto returns`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from panto_env.base.table import Table
from panto_env.terminal import Json, counting, print_json, print_table

if TYPE_CHECKING:
    from .returns import Returned


def returns(
    result: Annotated[Path, typer.Argument(help="JSON of `panto benchmark`, of one line.")],
    environment: Annotated[str, typer.Option("--id", help="Id of the environment.")] = "Pantograph-v0",
    episodes: Annotated[
        int, typer.Option(min=2, help="Episodes per policy, seeds 0, 1, ..., at the result's speeds in turn.")
    ] = 20,
    ingredients: Annotated[
        bool,
        typer.Option("--ingredients", help="Also with each ingredient of the reward left out or changed."),
    ] = False,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.", min=1)] = None,
    json: Json = False,
) -> None:
    """Compare the returns of an environment with a benchmark's ranks.

    Every policy of the result runs episodes on its line, at its speeds in turn. Disqualified policies
    share the last rank of the benchmark.
    """
    from ..report.result import read_result
    from .returns import INGREDIENTS, as_dict, rank_correlation
    from .returns import returns as measure

    judged = read_result(result)
    chosen = INGREDIENTS if ingredients else {"all": {}}
    found = {}
    for name, arguments in chosen.items():
        with counting(f"episodes, {name}" if ingredients else "episodes") as progress:
            found[name] = measure(
                judged,
                environment,
                episodes=episodes,
                arguments=arguments,
                workers=workers,
                progress=progress,
            )
    if json:
        print_json({name: as_dict(each) for name, each in found.items()})
        return
    print_table(_table(f"{environment}, {episodes} episodes beside {result.name}", found["all"]))
    rows = tuple((name, f"{rank_correlation(each):.3f}") for name, each in found.items())
    print_table(Table("rank correlation of return and benchmark", ("reward", "Spearman's ρ"), rows))


def _table(title: str, found: list[Returned]) -> Table:
    """Policies in the order of their returns."""
    rows = tuple(
        (each.policy, f"{each.mean:.1f} ± {each.error:.1f}", f"{each.change:+.1f}", each.disqualified or "–")
        for each in sorted(found, key=lambda each: -each.mean)
    )
    return Table(title, ("policy", "return", "Δσ (%)", "disqualified"), rows)
