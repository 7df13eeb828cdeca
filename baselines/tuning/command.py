"""The command `panto tune`; a tuning is stored speed by speed beside its file of gains, and can continue."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from panto_env.analysis.options import with_settings
from panto_env.analysis.pool import Progress
from panto_env.base.checksums import __version__, read_checked, write_checked
from panto_env.base.errors import InputError
from panto_env.base.files import alone_in, check_output, write_text
from panto_env.base.table import Table, number
from panto_env.catalog.loader import content_unless_catalogue
from panto_env.cluster import RayAddress, identity, make_parts, open_parts, remove_parts
from panto_env.control.lines import draws_line, line_name
from panto_env.control.settings import RunSettings, run_settings
from panto_env.terminal import Force, Json, counting_on, print_json, print_table, this_command, written_last

from ..benchmark.settings import TRAINING
from ..line import CONDITIONS, OPTIONS, as_toml
from ..policies.lanes_law import GainFile, Tuning, gain_file, load_gains
from .tune import PASSES, SEEDS, SPEEDS_KMH, Tuned, tunable, tune_at


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
    settings = run_settings(
        {"actuator": "realistic", "sensors": "realistic", "line_condition": "smooth"} | given
    )
    kind, path = tunable(policy, settings.washout), output or gain_file(policy)
    check_gain_file(path, policy, settings, force)
    count, parts = seeds or SEEDS, path.with_name(f".{path.stem}-parts")
    work = parts, policy, settings, sorted(set(speed or SPEEDS_KMH)), count, passes or PASSES
    with counting_on("speeds", parts) as progress:
        tuned = tune_speeds(*work, workers=workers, ray=ray, progress=progress)
    tuning = make_tuning(settings, list(kind.TUNED), tuned, TRAINING[:count], this_command())
    with written_last() as later:
        later(store, path, policy, tuning)
        later(remove_parts, parts)
        if json:
            print_json(tuning.model_dump(mode="json"))
            return
        print_table(table(policy, tuned))


def tune_speeds(
    folder: Path,
    policy: str,
    settings: RunSettings,
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    seeds: int = SEEDS,
    passes: int = PASSES,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> list[Tuned]:
    """Tune a policy for the settings' line, pantograph, actuator and sensors, at each speed.

    Each speed is written to the folder once it is done; speeds that are there already are not tuned again.
    seeds, passes: see ``tune_at``. workers, ray: see ``spread``; the gains do not depend on them. Raises
    InputError for a policy without gains, if the folder holds parts of another tuning, and if another
    process is tuning into it.
    """
    tunable(policy)
    made_of = {"policy": policy, "seeds": seeds, "passes": passes} | settings.model_dump(mode="json")
    with alone_in(folder, "tunes into"):
        open_parts(folder, identity("tuning", made_of))
        parts = {
            folder / f"{speed!r}.json": partial(_tune_part, policy, settings, speed, seeds, passes)
            for speed in speeds_kmh
        }
        make_parts(parts, read_checked, workers=workers, ray=ray, progress=progress)
        found = map(read_checked, parts)
        return [Tuned(**each | {name: tuple(each[name]) for name in ("gains", "history")}) for each in found]


def _tune_part(
    policy: str, settings: RunSettings, speed_kmh: float, seeds: int, passes: int, path: Path
) -> None:
    write_checked(path, asdict(tune_at(policy, settings, speed_kmh, seeds, passes)))


DIGITS = 5  # significant digits of a gain: far more than a tuning can resolve


def make_tuning(
    settings: RunSettings, names: Sequence[str], tuned: Sequence[Tuned], seeds: Sequence[int], command: str
) -> Tuning:
    """The outcome of a tuning in its stored form; ``line_condition`` holds the drawn conditions as JSON."""
    conditions = [each.model_dump(mode="json", exclude_defaults=True) for each in settings.line_condition]
    pantograph = settings.controlled_pantograph
    return Tuning(
        catenary=line_name(settings),
        pantograph=pantograph.name,
        catenary_sha256=None if draws_line(settings) else content_unless_catalogue(settings.line),
        pantograph_sha256=content_unless_catalogue(pantograph),
        place=settings.actuator.place,
        names=tuple(names),
        speeds_kmh=tuple(each.speed_kmh for each in tuned),
        gains=tuple(tuple(float(f"{gain:.{DIGITS}g}") for gain in each.gains) for each in tuned),
        command=command,
        version=__version__,
        actuator=settings.actuator.model_dump(mode="json", exclude_none=True),
        sensors=settings.sensors.model_dump(mode="json", exclude_none=True),
        line_condition=json.dumps(conditions),
        washout=settings.washout,
        seeds=tuple(seeds),
        passes=sum(each.passes for each in tuned),
        std_change=tuple(round(each.std_change, 4) for each in tuned),
        mean_change=tuple(round(each.mean_change, 4) for each in tuned),
    )


def check_gain_file(path: Path, policy: str, settings: RunSettings, force: bool) -> None:
    """Raise InputError unless a policy's gains can be stored in a file; called before any work begins.

    force: gains in the file for the same line, pantograph, place and washout may be replaced.
    """
    check_output(path, (".toml",))
    if not os.path.isfile(path):
        return
    file = load_gains(path)
    if file.policy != policy:
        raise InputError(f"{path} holds gains of '{file.policy}'; give another --output.")
    line = None if draws_line(settings) else settings.line
    pantograph, place = settings.controlled_pantograph, settings.actuator.place
    alike = [each for each in file.tunings if each.washout == settings.washout]
    if not force and any(each.is_for(line, pantograph, place) for each in alike):
        raise InputError(
            f"{path} already holds gains for {pantograph.name} on {line_name(settings)}, "
            f"actuator on '{place}'; give another --output, or --force to replace them."
        )


def store(path: Path, policy: str, tuning: Tuning) -> None:
    """Store a tuning in a file of gains; it replaces one for the same case, see ``_case``."""
    old = load_gains(path).tunings if os.path.isfile(path) else ()
    kept = [each for each in old if _case(each) != _case(tuning)]
    file = GainFile(policy=policy, tunings=(*kept, tuning)).model_dump(mode="json")
    write_text(path, "# Gains of a policy, written by `panto tune`.\n" + as_toml(file))


def _case(tuning: Tuning) -> tuple[str | float, ...]:
    line, pantograph = tuning.catenary_sha256, tuning.pantograph_sha256
    return line or tuning.catenary, pantograph or tuning.pantograph, tuning.place, tuning.washout


def table(policy: str, tuned: Sequence[Tuned]) -> Table:
    """Table with a row per speed: objective before and after, sigma and mean force relative to passive."""
    columns: dict[str, Callable[[Tuned], str]] = {
        "speed (km/h)": lambda one: f"{one.speed_kmh:g}",
        "passes": lambda one: str(one.passes),
        "iterations": lambda one: str(len(one.history) - 1),
        "objective before": lambda one: number(one.history[0], 3),
        "after": lambda one: number(one.history[-1], 3),
        "σ to passive (%)": lambda one: f"{100 * one.std_change:+.1f}",
        "mean force (%)": lambda one: f"{100 * one.mean_change:+.2f}",
    }
    return Table.of(f"{policy}, tuned: σ and mean on selection seeds", tuned, columns)
