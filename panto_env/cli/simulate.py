"""``panto simulate``, ``film`` and ``app``: one pass along a line, as figures, as a film, in the browser."""

from __future__ import annotations

import math
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from rich.table import Table
from typer import Argument, Option

from ..analysis import simulation
from ..analysis.options import (
    RENAMED,
    DroppersFile,
    FiguresFile,
    Seed,
    Spans,
    parse_spans,
    print_criteria,
    with_settings,
)
from ..analysis.plots import plot_run, save
from ..base.errors import InputError
from ..base.extras import require
from ..base.table import Table as TextTable
from ..base.table import number
from ..metrics.by_span import SPEED_HEADINGS, by_speed
from ..metrics.figures import LABELS, SpanChoice, in_words
from ..metrics.run_tables import save_droppers, save_figures
from ..metrics.trajectory import OUTPUTS, Trajectory
from ..render.video import FILMS, write_film
from ..terminal import (
    Json,
    Plot,
    alert,
    bars,
    console,
    into_file,
    print_json,
    print_table,
    say,
    writable,
    written_last,
)

LIVE_COLUMNS = 40
"""Minimum width of a terminal for the live picture."""


@with_settings(left_out=("observation",))
def simulate(
    settings: dict[str, Any],
    policy: Annotated[
        str | None, Option(help="Policy: a name, name:key=value,..., a model file or file.py:Class.")
    ] = None,
    spans: Spans = None,
    seed: Seed = 0,
    output: Annotated[
        str | None,
        Option(
            help="Save the run to this file: .parquet, which other commands read, .csv or .xlsx.",
            callback=writable(OUTPUTS),
        ),
    ] = None,
    figures: FiguresFile = None,
    droppers: DroppersFile = None,
    plot: Plot = None,
    live: Annotated[
        bool, Option("--live", help="Draw force and heights in the terminal during the run.")
    ] = False,
    json: Json = False,
) -> None:
    """Simulate one pass along a line and print its figures; exit with 1 if it ended early."""
    chosen = parse_spans(spans)
    with _shown(live, policy or "passive") as (progress, watch):
        trajectory = simulation.simulate(policy=policy, seed=seed, progress=progress, watch=watch, **settings)
    with written_last() as later:
        if output is not None:
            later(trajectory.save, output, None if trajectory.terminated else chosen)
        for write, path in ((save_figures, figures), (save_droppers, droppers)):
            if path is not None and trajectory.terminated:
                say(f"{path} is not written, since the run has no figures.")
            elif path is not None:
                later(write, [trajectory], path, chosen)
        if plot is not None:
            later(save, plot_run(trajectory, "all" if trajectory.terminated else chosen), plot)
        _print(trajectory, chosen, json)


def _print(trajectory: Trajectory, chosen: SpanChoice, json: bool) -> None:
    if trajectory.terminated:
        if json:
            print_json(_facts(trajectory) | {"spans": None, "figures": None, "compliance": None})
        else:
            alert(trajectory.ending, "It has no figures.")
        raise typer.Exit(1)
    train = trajectory.train
    covered = trajectory.common_spans(chosen)
    chosen = covered or chosen
    profile = trajectory.identity.has_profile
    if json:
        results = [
            {
                "figures": own.summary(chosen).as_dict(),
                "compliance": [each.as_dict() for each in own.compliance(chosen)],
            }
            | ({"by_speed": [each._asdict() for each in by_speed(own, chosen)]} if profile else {})
            for own in train
        ]
        others = [_facts(own, OWN_FACTS) | found for own, found in zip(train[1:], results[1:], strict=True)]
        behind = {"followers": others} if others else {}
        print_json(_facts(trajectory) | {"spans": covered} | results[0] | behind)
        return
    numbered = [f"{place} {own.pantograph}" for place, own in enumerate(train, start=1)]
    table = Table("figure", *(numbered if len(train) > 1 else ["value"]), "unit")
    every = [own.summary(chosen) for own in train]
    for key, label in LABELS.items():
        table.add_row(label.name, *(number(label.scale * getattr(own, key), 2) for own in every), label.unit)
    title = f"{trajectory.pantographs} on {trajectory.catenary} at {trajectory.speed_in_words}"
    console.print(f"{title}, policy {trajectory.policies}, spans {in_words(covered)}")
    for place, own in enumerate(train, start=1):
        if not math.isnan(own.target_mean):
            at = ", both at the mean speed" if own.identity.drifts else ""
            whose = f"Pantograph {place}: applied" if len(train) > 1 else "Applied"
            console.print(
                f"{whose} force {own.nominal_force:.1f} N, trimmed for a passive mean of "
                f"{own.target_mean:.1f} N{at}."
            )
    console.print(table)
    if profile:
        for own in train:
            title = f"{own.pantograph} by the train's speed"
            headings = tuple(SPEED_HEADINGS.values())
            print_table(TextTable(title, headings, by_speed(own, chosen), text_columns=0))
    for place, own in enumerate(train, start=1):
        title = f"Requirements at {own.speed_kmh:g} km/h, {own.line.system}"
        title += f", pantograph {place}" if len(train) > 1 else ""
        print_criteria(own.compliance(chosen), title)


@contextmanager
def _shown(
    live: bool, policy: str
) -> Iterator[tuple[Callable[[float], None] | None, Callable[[Any], None] | None]]:
    """Progress of a run as a bar or as a live picture: arguments ``progress`` and ``watch`` of the run."""
    drawable = console.is_terminal and not console.is_dumb_terminal and console.width >= LIVE_COLUMNS
    if live and drawable:
        from ..render.strip import live as on_terminal

        with on_terminal(console, policy) as watch:
            yield None, watch
        return
    if live:
        say(f"--live needs a terminal of {LIVE_COLUMNS} columns to draw in; the run continues without.")
    with bars() as progress:
        bar = progress.add_task("simulating", total=1.0)
        yield lambda share: progress.update(bar, completed=share), None


OWN_FACTS = ("pantograph", "policy", "nominal_force", "target_mean")
"""What JSON has of a pantograph behind the first."""
FACTS = (
    *("catenary", "pantograph", "speed_kmh", "policy", "seed", "terminated", "ending"),
    *("nominal_force", "target_mean", "settings"),
)
"""What it has of a run."""


def _facts(run: Trajectory, names: tuple[str, ...] = FACTS) -> dict[str, Any]:
    return {name: getattr(run, name) for name in names}


MOST = 4
"""Maximum number of passes in one film."""


@with_settings(left_out=("observation",))
def film(
    settings: dict[str, Any],
    policies: Annotated[
        list[str],
        Argument(
            help="Passes to show above each other: a policy as a name, name:key=value,..., a model file or "
            "file.py:Class; or a run saved by panto simulate (.parquet), whose settings then apply to all."
        ),
    ],
    output: Annotated[str, into_file("Film to write", FILMS)],
    first_span: Annotated[int, Option(min=1, max=1000, help="Span in which the film begins.")] = 10,
    seconds: Annotated[float, Option(min=0.1, max=600, help="Time of the run that is shown (s).")] = 3.0,
    slow_motion: Annotated[
        float, Option(min=0.1, max=100, help="Factor by which the film is slowed down.")
    ] = 4.0,
    size: Annotated[
        tuple[int, int] | None,
        Option(help="Width and height (px); by default 1280 x 720, for several policies 480 high each."),
    ] = None,
    seed: Annotated[
        int | None, Option(min=0, help="Seed of irregularity and noise; 0, unless a saved run has its own.")
    ] = None,
) -> None:
    """Write a film of a pass along a line: wires, pantograph, actuator and contact force.

    Several policies run on the same line under the same seed, above each other, with their figures.
    A saved run is repeated from its settings, and refused if its contact force differs.
    """
    from ..render.film import Filmed, check_together, excerpt, frames, policy_pass, saved_passes

    if len(policies) > MOST:
        raise InputError(f"A film shows up to {MOST} passes, not {len(policies)}.")
    whole = size or (1280, 720 if len(policies) == 1 else 480 * len(policies))
    even = whole[0] % 2 == 0 and whole[1] % (2 * len(policies)) == 0
    if not (even and all(64 <= pixels <= 4096 for pixels in whole)):
        raise InputError(
            f"The size must be even numbers of pixels from 64 to 4096, and the height for each pass's part, "
            f"not {whole}."
        )
    saved = saved_passes(policies)
    if saved:
        check_together(list(saved.values()))  # before any work begins
        first = next(iter(saved.values()))
        given = [f"--{RENAMED.get(name, name).replace('_', '-')}" for name in settings]
        given += [] if seed is None else ["--seed"]
        if given:
            raise InputError(f"The film takes all settings from {first.file}; leave out {', '.join(given)}.")
        settings, seed = first.settings, first.seed
    with bars() as progress:
        bar = progress.add_task("simulating all passes", total=len(policies))
        filmed: list[Filmed] = []
        for policy in policies:
            each = saved.get(policy) or policy_pass(policy, settings, seed or 0)
            each.check()
            filmed.append(each)
            progress.advance(bar)
        what = excerpt(filmed[0], first_span, seconds, slow_motion)
        bar = progress.add_task("drawing", total=1.0)
        drawn = frames(filmed, what, whole, lambda share: progress.update(bar, completed=share))
        write_film(drawn, output, what.rate, whole)
    for each in filmed:
        if each.run.terminated:
            console.print(f"{each.title}: {each.run.ending}", soft_wrap=True)
    console.print(
        f"The film is {output}: {what.rate:g} frames per second, {slow_motion:g} times slower than real.",
        highlight=False,
        soft_wrap=True,
    )


def app(
    port: Annotated[
        int, Option(min=1024, max=65535, help="Port of this machine at which it is served.")
    ] = 5006,
    no_browser: Annotated[
        bool, Option("--no-browser", help="Only serve the page, and open no browser.")
    ] = False,
) -> None:
    """Serve a page on which line, pantograph, speed and policy are chosen and their run is seen at once.

    Only browsers of this machine reach it, and it needs no network. Ctrl+C ends it.
    """
    require("The page", "app", "bokeh")
    from ..app.page import serve

    def ready(address: str) -> None:
        console.print(f"The page is {address}; Ctrl+C ends it.", soft_wrap=True)
        if not no_browser:
            webbrowser.open(address)

    serve(port, ready)
