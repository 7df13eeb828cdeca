"""The command `panto tune`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from panto_env.analysis.options import with_settings
from panto_env.cluster import RayAddress
from panto_env.terminal import Force, Json, counting_on, print_json, print_table, this_command, written_last

from ..line import CONDITIONS, OPTIONS


@with_settings(only=(*OPTIONS, *CONDITIONS, "actuator", "sensors", "washout"), defaults=False)
def tune(
    given: dict[str, Any],
    policy: Annotated[str, typer.Argument(help="Name of a policy that has gains: periodic, skyhook, ...")],
    speed: Annotated[
        list[float] | None,
        typer.Option(help="Speed (km/h); repeatable; 200 to 350 in steps of 25 by default."),
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=1000, help="Number of training seeds.")] = None,
    passes: Annotated[
        int | None, typer.Option(min=1, max=1_000_000, help="Maximum simulated passes per speed.")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.")] = None,
    ray: RayAddress = None,
    output: Annotated[
        Path | None,
        typer.Option(help="TOML file to write the gains to; by default the one that the policy reads."),
    ] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Fit a policy's gains to a line, a pantograph, an actuator and sensors, speed by speed.

    The fit minimises the variance of the contact force on training seeds, near the passive mean force;
    the table shows the result on selection seeds. By default actuator and sensors are "realistic" and
    the line is "smooth". Gains for the same line, pantograph and place in the file are replaced only with
    --force. An interrupted tuning keeps the speeds that are done; the same command continues it.
    With --washout gains are for the policy with that washout: tuned-pd:washout=1.
    """
    from panto_env.cluster import remove_parts
    from panto_env.control.settings import run_settings

    from ..benchmark.settings import TRAINING
    from ..policies.lanes_law import gain_file
    from .store import check_gain_file, make_tuning, parts_of, store, table
    from .store import tune as run
    from .tune import PASSES, SEEDS, SPEEDS_KMH, tunable

    settings = run_settings(
        {"actuator": "realistic", "sensors": "realistic", "line_condition": "smooth"} | given
    )
    kind, path = tunable(policy, settings.washout), output or gain_file(policy)
    check_gain_file(path, policy, settings, force)
    count = seeds or SEEDS
    speeds = sorted(set(speed or SPEEDS_KMH))
    parts = parts_of(path)
    with counting_on("speeds", parts) as progress:
        tuned = run(
            parts,
            policy,
            settings,
            speeds,
            count,
            passes or PASSES,
            workers=workers,
            ray=ray,
            progress=progress,
        )
    command = this_command()
    tuning = make_tuning(settings, list(kind.TUNED), tuned, TRAINING[:count], command)
    with written_last() as later:
        later(store, path, policy, tuning)
        later(remove_parts, parts)
        if json:
            print_json(tuning.model_dump(mode="json"))
            return
        print_table(table(policy, tuned))
