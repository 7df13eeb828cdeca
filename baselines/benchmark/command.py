"""``panto benchmark``, ``replay``, ``returns`` and ``submission``."""

from __future__ import annotations

import secrets
from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from panto_env.analysis.options import with_settings
from panto_env.base.files import PAGES
from panto_env.base.settings import parse
from panto_env.base.table import Table
from panto_env.cluster import RayAddress
from panto_env.terminal import (
    Force,
    Json,
    PlainConsole,
    Plot,
    alert,
    console,
    counting,
    print_json,
    print_table,
    refuse_overwriting,
    writable,
    written_last,
)

from ..line import OPTIONS
from .run import SUFFIXES, parse_result, read_result, run
from .settings import BenchmarkSettings, load_benchmark, salt_hash
from .submission import Checked
from .submission import check as run_check
from .submission import replay as play

PLACE = (*OPTIONS, "pantographs")
"""Options that say what runs on which line: they replace the lines of a file."""
Workers = Annotated[int | None, typer.Option(help="Processes; one per core by default.", min=1)]
DRAW = "draw"  # salt that stands for one drawn at random


@with_settings(only=(*OPTIONS, "actuator", "sensors", "line_condition", "control_interval"), defaults=False)
def benchmark(
    given: dict[str, Any],
    policies: Annotated[
        list[str] | None,
        typer.Argument(help="Names, with parameters (p:gain=0.5) or without, or model files."),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="TOML file, or a name such as benchmark; other options take precedence over it."),
    ] = None,
    speed: Annotated[list[float] | None, typer.Option(help="Speed (km/h) on every line; repeatable.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Number of seeds.")] = None,
    salt: Annotated[
        str | None,
        typer.Option(
            help="Make new test seeds from this text, which the result holds with its SHA-256, or from one "
            "drawn at random: 'draw'."
        ),
    ] = None,
    trusted: Annotated[
        bool,
        typer.Option(
            "--trusted", help="Run installed policies in the process of the plant, which is faster."
        ),
    ] = False,
    workers: Annotated[int | None, typer.Option(help="Processes; two per core by default.")] = None,
    ray: RayAddress = None,
    output: Annotated[
        str | None,
        typer.Option(
            help="File to write: everything as .json, or the passes as .csv, .xlsx or .parquet.",
            callback=writable(SUFFIXES, announced=False),
        ),
    ] = None,
    force: Force = False,
    plot: Plot = None,
    html: Annotated[
        str | None,
        typer.Option(help="Page to write, as `panto report` does.", callback=writable(PAGES)),
    ] = None,
    wide: Annotated[
        bool, typer.Option("--wide", help="Print every figure at every speed, in up to 200 columns.")
    ] = False,
    json: Json = False,
) -> None:
    """Compare policies on the same lines, at the same speeds, under the same seeds.

    Ranks them by the change of σ from a passive pantograph at the same mean force. A policy that moves the
    mean force by more than 1.5 % in a cell or in a third of all passes, or by more than 5 % in any pass, is
    shown but not ranked.
    The plot shows the contact force on every line at its highest speed, and σ over speed.
    """
    from panto_env.analysis.plots import save

    from ..report.page import save as save_page
    from .brief import brief
    from .report import plot as draw_plot
    from .report import tables

    line = {name: given.pop(name, None) for name in PLACE}
    settings = _settings(
        config,
        line=line | {"speeds_kmh": speed or None},
        policies=policies or None,
        trainings={} if policies else None,
        seeds=seeds,
        salt=secrets.token_hex(16) if salt == DRAW else salt,
        trusted=trusted or None,
        **given,
    )
    if output is not None:
        refuse_overwriting(output, force)
    with counting("passes") as progress:
        outcome = run(settings, workers, progress, ray)
    with written_last() as later:
        if output is not None:
            later(outcome.save, output)
        if plot is not None:
            later(save, draw_plot(outcome), plot)
        if html is not None:
            later(save_page, [parse_result(outcome.as_dict(), "the outcome")], html)
        if json:
            print_json(outcome.as_dict())
            return
        console.print(tables(outcome) if wide else brief(outcome))
        if settings.salt is not None:
            words = f"Seeds are made from the salt '{settings.salt}', SHA-256 {salt_hash(settings.salt)}."
            console.print(words, soft_wrap=True)


def _settings(config: Path | None, line: dict[str, Any], **given: Any) -> BenchmarkSettings:
    """Settings of the file, or the defaults, changed by what was given on the command line.

    A catenary or pantograph replaces all of the file's lines; speeds apply to every line.
    """
    base = BenchmarkSettings() if config is None else load_benchmark(config)
    changes, own = ({key: each for key, each in some.items() if each is not None} for some in (given, line))
    table = base.model_dump() | changes
    table["lines"] = [own] if own.keys() & set(PLACE) else [old | own for old in table["lines"]]
    return parse(BenchmarkSettings, table, "the benchmark")


def replay(
    result: Annotated[
        Path,
        typer.Argument(help="JSON of `panto benchmark --output`, with its actions beside it."),
    ],
    policy: Annotated[list[str] | None, typer.Option(help="Policy of the result; repeatable.")] = None,
    tolerance: Annotated[
        float, typer.Option(min=0, help="Relative difference that is allowed; 0 means bit for bit.")
    ] = 0.0,
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Play a result's passes again from the actions that it keeps, and compare all figures.

    No policy runs. Ends with status 1 where a figure differs by more than the tolerance. On another kind of
    processor figures differ in their last digits: give a tolerance there.
    """
    with counting("passes") as progress:
        played = play(result, policy or (), workers, progress)
    if json:
        rows = [{**each.row, "difference": each.difference} for each in played.rows]
        print_json({"follows": played.follows, "rows": rows})
    else:
        groups = defaultdict(list)
        for each in played.rows:
            groups[each.row["policy"]].append(each.difference)
        rows_of = [
            (policy, str(len(found)), str(found.count(0.0)), f"{max(found):.2g}")
            for policy, found in groups.items()
        ]
        headings = ("policy", "passes", "bit for bit", "maximum relative difference")
        print_table(Table(f"{result.name}, played again", headings, rows_of))
    apart = [each for each in played.rows if each.difference > tolerance]
    if apart or played.follows is False:
        what = f"{len(apart)} of {len(played.rows)} rows do" if apart else "its cells or standings do"
        alert("No:", f"{what} not follow from the actions.")
        raise typer.Exit(1)


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
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Compare the returns of an environment with a benchmark's ranks.

    Every policy of the result runs episodes on its line, at its speeds in turn. Disqualified policies
    share the last rank of the benchmark.
    """
    from .returns import INGREDIENTS, as_dict, rank_correlation
    from .returns import returns as measure

    judged = read_result(result)
    chosen = INGREDIENTS if ingredients else {"all": {}}
    run_all = partial(measure, judged, environment, episodes=episodes, workers=workers)
    found = {}
    for name, arguments in chosen.items():
        with counting(f"episodes, {name}" if ingredients else "episodes") as progress:
            found[name] = run_all(arguments=arguments, progress=progress)
    if json:
        print_json({name: as_dict(each) for name, each in found.items()})
        return
    rows = [
        (each.policy, f"{each.mean:.1f} ± {each.error:.1f}", f"{each.change:+.1f}", each.disqualified or "–")
        for each in sorted(found["all"], key=lambda each: -each.mean)
    ]
    title = f"{environment}, {episodes} episodes beside {result.name}"
    print_table(Table(title, ("policy", "return", "Δσ (%)", "disqualified"), rows))
    correlations = [(name, f"{rank_correlation(each):.3f}") for name, each in found.items()]
    print_table(Table("rank correlation of return and benchmark", ("reward", "Spearman's ρ"), correlations))


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
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Run a submission as the benchmark would, with few seeds, and say whether it would be ranked, and where.

    Its policy runs in a process of its own, by the Python that PANTO_POLICY_PYTHON names.
    """
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
    card, standing, tape = checked.card, checked.standing, checked.tape
    within = ", 95 % interval {:.1f} to {:.1f}".format(*standing.interval) if standing.interval else ""
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
    place = 1 + sum(other < standing.change for other in others)
    return [*lines, f"It would be ranked{f', at place {place} of {len(others) + 1}' if others else ''}."]
