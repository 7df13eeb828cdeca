"""The command `panto tune`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from panto_env.analysis.options import with_settings
from panto_env.cluster import RayAddress
from panto_env.terminal import Force, Json, counting_on, print_json, print_table, this_command, written_last


@with_settings(
    only=(
        "catenary",
        "pantograph",
        "pantograph_scatter",
        "speed_drift",
        "actuator",
        "sensors",
        "line_condition",
        "control_interval",
    ),
    defaults=False,
)
def tune(
    given: dict[str, Any],
    policy: Annotated[str, typer.Argument(help="Name of a policy that has gains: periodic, skyhook, ...")],
    speed: Annotated[
        list[float] | None,
        typer.Option(help="Speed (km/h); repeatable; 200 to 350 in steps of 25 by default."),
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=1000, help="Number of training seeds.")] = None,
    passes: Annotated[
        int | None, typer.Option(min=1, max=1_000_000, help="Simulated passes at each speed, at most.")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.")] = None,
    ray: RayAddress = None,
    output: Annotated[
        Path | None,
        typer.Option(
            help="TOML file to put the gains into; by default that in which the policy looks for them."
        ),
    ] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Fit a policy's gains to a line, a pantograph, an actuator and sensors, speed by speed.

    Least squares of the contact force at a mean force like the passive one's, on training seeds; the table
    shows what the gains do on selection seeds. Actuator and sensors are "realistic", the line "fair", unless
    told otherwise. Gains of the same line, pantograph and place in the file are replaced only with --force.
    A tuning that was ended loses the speeds that were in work; the same command goes on with it.
    """
    from panto_env.cluster.parts import remove_parts
    from panto_env.control.settings import run_settings

    from ..benchmark.seeds import TRAINING
    from ..policies.gains import gain_file
    from .parts import parts_of
    from .parts import tune as run
    from .store import check_gain_file, make_tuning, store
    from .tables import table
    from .tune import PASSES, SEEDS, SPEEDS_KMH, tunable

    settings = run_settings(
        {"actuator": "realistic", "sensors": "realistic", "line_condition": "fair"} | given
    )
    kind, path = tunable(policy), output or gain_file(policy)
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
