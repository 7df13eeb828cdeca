"""``panto film``: a film of one policy or saved run, or of several above each other."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from ..analysis.options import RENAMED, with_settings
from ..render.video import FILMS, write_film
from ..terminal import bars, console, writable

MOST = 4
"""Maximum number of passes in one film."""


@with_settings(left_out=("observation",))
def film(
    settings: dict[str, Any],
    policies: Annotated[
        list[str],
        typer.Argument(
            help="Passes to show above each other: a policy as a name, name:key=value,..., a model file or "
            "file.py:Class; or a run saved by panto simulate (.parquet), whose settings then apply to all."
        ),
    ],
    output: Annotated[
        str, typer.Option(help=f"Film to write ({', '.join(FILMS)}).", callback=writable(FILMS))
    ],
    first_span: Annotated[int, typer.Option(min=1, max=1000, help="Span in which the film begins.")] = 10,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=600, help="Time of the run that is shown (s).")
    ] = 3.0,
    slow_motion: Annotated[
        float, typer.Option(min=0.1, max=100, help="Factor by which the film is slowed down.")
    ] = 4.0,
    size: Annotated[
        tuple[int, int] | None,
        typer.Option(
            help="Width and height (px); by default 1280 x 720, for several policies 480 high each."
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of irregularity and noise; 0, unless a saved run has its own."),
    ] = None,
) -> None:
    """Write a film of a pass along a line: wires, pantograph, actuator and contact force.

    Several policies run on the same line under the same seed, above each other, with their figures.
    A saved run is repeated from its settings, and refused if its contact force differs.
    """
    from ..base.errors import InputError
    from ..render.film import excerpt, frames
    from ..render.filmed import Filmed, check_together, policy_pass, saved_passes

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
