"""``panto film``: a film of one policy, or of several above each other."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.progress import Progress

from ..analysis.options import Seed, with_settings
from ..render.video import FILMS, write_film
from ..terminal import console, progress_console, writable

MOST = 4
"""Policies in one film."""


@with_settings(left_out=("observation",))
def film(
    settings: dict[str, Any],
    policies: Annotated[
        list[str],
        typer.Argument(
            help="Policies, above each other: a name, name:key=value,..., a model file, file.py:Class."
        ),
    ],
    output: Annotated[
        str, typer.Option(help=f"Film to write ({', '.join(FILMS)}).", callback=writable(FILMS))
    ],
    first_span: Annotated[int, typer.Option(min=1, help="Span in which the film begins.")] = 10,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=600, help="Time of the run that is shown (s).")
    ] = 3.0,
    slow_motion: Annotated[
        float, typer.Option(min=0.1, max=100, help="How many times slower than life the film is.")
    ] = 4.0,
    size: Annotated[
        tuple[int, int] | None,
        typer.Option(help="Width and height (px); by default 1280 x 720, twice 480 high for two policies."),
    ] = None,
    seed: Seed = 0,
) -> None:
    """Write a film of a pass along a line: wires, pantograph, actuator and contact force.

    Several policies drive the same line under the same seed, above each other; their figures stand beside.
    """
    from ..base.errors import InputError
    from ..control.settings import run_settings
    from ..render.film import frames, shown, source

    if len(policies) > MOST:
        raise InputError(f"A film shows up to {MOST} policies, not {len(policies)}.")
    whole = size or (1280, 720 if len(policies) == 1 else 480 * len(policies))
    if any(pixels % (2 * len(policies)) or not 64 <= pixels <= 4096 for pixels in whole):
        raise InputError(
            f"The size must be even numbers of pixels, from 64 to 4096, for each policy's part, not {whole}."
        )
    with Progress(
        console=progress_console, transient=True, disable=not progress_console.is_terminal
    ) as progress:
        bar = progress.add_task("running the whole passes", total=len(policies))
        sources = []
        for policy in policies:
            sources.append(source(policy, settings, seed))
            progress.advance(bar)
        interval = run_settings(sources[0].settings).control_interval
        what = shown(sources[0].run, interval, first_span, seconds, slow_motion)
        bar = progress.add_task("drawing", total=1.0)

        def done(share: float) -> None:
            progress.update(bar, completed=share)

        write_film(frames(sources, what, whole, done), output, what.rate, whole)
    for each in sources:
        if each.run.terminated:
            console.print(f"{each.run.policy}: {each.run.ending}", markup=False, soft_wrap=True)
    console.print(
        f"The film is {output}: {what.rate:g} frames per second, {slow_motion:g} times slower than life.",
        markup=False,
        highlight=False,
        soft_wrap=True,
    )
