"""The commands that train, evaluate and export. Torch is imported only when they run."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich import table as rich_table

from panto_env.analysis.options import print_criteria, with_settings
from panto_env.base.errors import InputError
from panto_env.base.extras import require
from panto_env.base.files import check_output, make_folder
from panto_env.base.table import Table, number
from panto_env.cluster import RayAddress
from panto_env.metrics.compliance import worst
from panto_env.metrics.figures import FIRST_SETTLED, LABELS
from panto_env.terminal import (
    Json,
    Plot,
    announce_overwriting,
    console,
    counting,
    print_json,
    print_table,
    progress_console,
    this_command,
    writable,
    written_last,
)

if TYPE_CHECKING:
    from .evaluation import Pair


Workers = Annotated[int | None, typer.Option(help="Processes; one per core by default.")]


def check_packages() -> None:
    """Raise InputError, naming them, if packages that a training needs are not installed."""
    require("Training", "agents", "torch", "stable_baselines3", "tensorboard")


ROWS = ["mean", "std", "max", "min", "cost_function", "contact_loss", "max_uplift", "effort", "effort_rate"]
"""Figures that `panto evaluate` prints."""


def train(
    config: Annotated[Path, typer.Argument(help="Training: a TOML file, or a name such as ppo or sac.")],
    output: Annotated[
        Path | None, typer.Option(help="Folder of the run; runs/NAME-ALGORITHM-seedK by default.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the run's newest checkpoint.")
    ] = False,
    seed: Annotated[int | None, typer.Option(help="Seed, instead of the file's.")] = None,
    steps: Annotated[int | None, typer.Option(help="Environment steps, instead of the file's.")] = None,
    device: Annotated[
        str | None, typer.Option(help='"cuda": environments and network on a GPU; the processor by default.')
    ] = None,
    json: Json = False,
) -> None:
    """Train a model; the benchmark takes its file as a policy."""
    check_packages()
    from .settings import load_training
    from .trainings import RunFolder, run_name

    training = load_training(config, seed=seed, total_steps=steps, device=device)
    folder = output or Path("runs") / run_name(config, training)
    RunFolder(folder).check(training, resume)
    make_folder(folder)  # now: torch takes its time to load
    with progress_console.status("loading torch"):
        from .model_file import read_model
        from .train import train as run
    try:
        paths = run(training, folder, resume=resume, command=this_command())
    except KeyboardInterrupt as error:
        progress_console.print(f"Stopped. To continue, repeat the command with --resume ({folder}).")
        raise typer.Exit(130) from error
    report: dict[str, Any] = {"output": str(paths.path), "tensorboard": str(paths.tensorboard)}
    lines = []
    for name, label in (("model", "final model"), ("best", "best at an evaluation")):
        path = getattr(paths, name)
        facts, _ = read_model(path)
        report |= {name: str(path), f"{name}_steps": facts.steps}
        report |= {f"{name}_ratio": facts.ratio, f"{name}_qualified": facts.qualified}
        ratio = facts.ratio
        change = "a run ended early" if ratio is None else f"σ {100 * (ratio - 1):+.1f} % of passive"
        note = "" if facts.qualified else ", F_m out of range: disqualified"
        lines.append(f"{label} (step {facts.steps}): {path}: {change}{note}")
    if json:
        print_json(report)
        return
    for line in (*lines, f"panto evaluate {paths.best}"):
        console.print(line, soft_wrap=True)


EXPORTS = {"safetensors": ".safetensors", "c": ".c", "fmu": ".fmu", "onnx": ".onnx"}
"""Suffix of the file that each format of `panto export` has."""


@with_settings(only=("catenary", "pantograph", "controlled", "actuator", "sensors"), defaults=False)
def export(
    settings: dict[str, Any],
    policy: Annotated[str, typer.Argument(help="Model file, or a policy's name (with parameters).")],
    output: Annotated[
        str | None,
        typer.Argument(
            help=f"File to write ({', '.join(EXPORTS.values())}); by default one named as the policy, here.",
            callback=writable(tuple(EXPORTS.values())),
        ),
    ] = None,
    format: Annotated[
        str | None, typer.Option(help=f"One of {', '.join(EXPORTS)}; by default that of the file's suffix.")
    ] = None,
) -> None:
    """Write a policy for use elsewhere: a model file to publish, or a program for a train's controller.

    safetensors: only what the policy needs, as arrays and JSON, with nothing pickled; it is the same policy,
    but cannot be trained further. onnx: its network. c: one C99 file and its header, which need nothing but
    libm. fmu: a co-simulation unit of FMI 3.0 with this C. The options say which line, pantograph and
    actuator the constants of the last two are for, by default those of its training: of several pantographs
    of a train those of the first that is controlled.
    """
    from panto_env.policies import find_policy

    from .model_file import write_policy
    from .onboard import exported, write_fmu, write_onnx
    from .onboard.export import name_in_c
    from .policy import TrainedPolicy

    kind = _format(output, format)
    path = Path(output or f"{name_in_c(policy)}{EXPORTS[kind]}")
    if kind in ("safetensors", "onnx"):
        driver = find_policy(policy)
        if settings:
            raise InputError(
                "A model file holds nothing of line, train, actuator or sensors; leave them out."
            )
        if kind == "onnx":
            write_onnx(driver, _announced(path, output))
            return
        if not isinstance(driver, TrainedPolicy):
            raise InputError(
                f"The policy '{policy}' has no model of its own to write; take a trained one, or c."
            )
        write_policy(_announced(path, output), driver.facts, driver.actor)
        return
    name = name_in_c(_announced(path, output).stem)
    if kind == "c":
        header = _announced(path.with_name(f"{name}.h"), None)
    made = exported(policy, name, **settings)
    if kind == "c":
        made.write(path)
        words = f"{path}, {header}: {name}_init, {name}_step"
    else:
        write_fmu(made, path)
        words = f"{path}: a step"
    console.print(f"{words} every {made.interval:g} s", soft_wrap=True)
    rows = [("reading", *asdict(each).values()) for each in made.inputs]
    rows += [("force", *asdict(each).values()) for each in made.outputs]
    print_table(Table("inputs and outputs", ("", "name", "unit", "meaning"), tuple(rows)))


def _format(output: str | None, given: str | None) -> str:
    """Format of an export. Raises InputError where none is given, or file and format differ."""
    if given not in (None, *EXPORTS):
        raise InputError(f"--format must be one of {', '.join(EXPORTS)}, not '{given}'.")
    suffix = Path(output).suffix.lower() if output else None
    kind = given or next((name for name, own in EXPORTS.items() if own == suffix), None)
    if kind is None:
        raise InputError(f"Name a file to write, or a --format: {', '.join(EXPORTS)}.")
    if suffix not in (None, EXPORTS[kind]):
        raise InputError(f"A file for --format {kind} must end in {EXPORTS[kind]}, not {output}.")
    return kind


def _announced(path: Path, given: str | None) -> Path:
    """The path, checked and announced before any work, unless it was as an argument."""
    if given is None:
        check_output(path, (path.suffix,))
        announce_overwriting(path)
    return path


@with_settings(
    only=("catenary", "pantograph", "actuator", "sensors", "line_condition", "distance"), defaults=False
)
def evaluate(
    settings: dict[str, Any],
    policy: Annotated[str, typer.Argument(help="Model file, or a policy's name (with parameters).")],
    speed: Annotated[
        list[float] | None, typer.Option(help="Speed (km/h); repeatable; those of the training by default.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Runs at each speed, seeds 0, 1, ...")] = 1,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Compare a policy with the passive pantograph, paired by line, speed and seed.

    Options that are left out are as in the model's training.
    """
    from panto_baselines.benchmark.settings import TEST, check_seeds
    from panto_env.analysis.pool import check_passes
    from panto_env.policies import find_policy, wishes

    from .evaluation import Comparison, in_words, verdict
    from .policy import Ensemble, TrainedPolicy
    from .settings import arguments, speeds

    driver = find_policy(policy)
    in_training = driver.facts.environment if isinstance(driver, TrainedPolicy | Ensemble) else {}
    environment = {"id": "Pantograph-v0"} | in_training | settings
    chosen = speed or speeds(arguments(environment))
    check_passes(2 * seeds * len(chosen), "This evaluation")
    judged_on = range(TEST.start, TEST.start + seeds)
    check_seeds(judged_on, "test")
    given = arguments(environment) | {"washout": wishes(driver)["washout"]} | settings
    comparison = Comparison(given, chosen, judged_on, settings.get("distance"))
    with progress_console.status("running"):
        pairs = comparison.run(driver)
    with written_last() as later:
        if plot is not None:
            from panto_env.analysis import plots

            runs = comparison.passes(driver, comparison.speeds_kmh[0], 0)
            title = f"{runs[0].pantograph} on {runs[0].catenary} at {runs[0].speed_kmh:g} km/h"
            picture = plots.plot_forces(runs, (policy, "passive"), (FIRST_SETTLED, FIRST_SETTLED + 1), title)
            later(plots.save, picture, plot)
        if json:
            run = {"policy": policy, "environment": environment, "settings": comparison.settings}
            found = dict(zip(("ratio", "qualified"), verdict(pairs), strict=True))
            print_json(run | {"passes": [pair.as_dict() for pair in pairs], "verdict": found})
            return
        console.print(f"mean of all: {in_words(pairs)}", style="bold")
        _print_pairs(pairs)
        unchanged = {(each.key, each.value) for pair in pairs for each in pair.passive_compliance}
        for speed_kmh in sorted({pair.speed_kmh for pair in pairs}):
            seeds_here = [pair.policy_compliance for pair in pairs if pair.speed_kmh == speed_kmh]
            if all(seeds_here):
                title = f"Requirements that {policy} moves at {speed_kmh:g} km/h; of several seeds the worst"
                moved = [each for each in worst(seeds_here) if (each.key, each.value) not in unchanged]
                print_criteria(moved, title)
        console.print(f"mean of all: {in_words(pairs)}", style="bold")


def _print_pairs(pairs: list[Pair]) -> None:
    """Print a table with a section for each speed: means over the seeds."""
    spans = " or ".join(sorted({pair.spans for pair in pairs} - {""})) or "none"
    table = rich_table.Table(title=f"spans {spans}")
    for heading in ("km/h", "figure", "policy", "passive", "change"):
        table.add_column(heading, justify="left" if heading == "figure" else "right")
    for speed in sorted({pair.speed_kmh for pair in pairs}):
        pairs_here = [pair for pair in pairs if pair.speed_kmh == speed]
        table.add_section()
        for key in ROWS:
            label = LABELS[key]
            policy, passive = (
                label.scale * sum(getattr(getattr(pair, of), key) for pair in pairs_here) / len(pairs_here)
                for of in ("policy", "passive")
            )
            change = f"{100 * (policy / passive - 1):+.1f} %" if passive > 0 and math.isfinite(policy) else ""
            first = f"{speed:g}" if key == ROWS[0] else ""
            table.add_row(first, label.heading, number(policy), number(passive), change)
        whole = [pair for pair in pairs_here if not (pair.terminated or pair.passive_ending)]
        counts = {
            "ended early": sum(pair.terminated for pair in pairs_here),
            "without a policy did": sum(pair.passive_ending != "" for pair in pairs_here),
            "with F_m out of range": sum(not pair.qualified for pair in whole),
        }
        if notes := [f"{count} {words}" for words, count in counts.items() if count]:
            table.add_row("", f"of {len(pairs_here)} passes, " + ", ".join(notes), "", "", "")
    console.print(table)


def trainings(
    configs: Annotated[
        list[Path], typer.Argument(help="Trainings: TOML files, or names such as ppo and sac.")
    ],
    seed: Annotated[
        list[int] | None, typer.Option(help="Seed, instead of the files'; repeatable.", min=0)
    ] = None,
    steps: Annotated[int | None, typer.Option(help="Environment steps, instead of the files'.")] = None,
    output: Annotated[
        Path, typer.Option(help="Folder in which each run has one, NAME-ALGORITHM-seedK.")
    ] = Path("runs"),
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue runs that have begun, and begin the others.")
    ] = False,
    workers: Workers = None,
    ray: RayAddress = None,
    json: Json = False,
) -> None:
    """Train several configurations under several seeds in parallel, each run as by `panto train`.

    On a Ray cluster all machines must see the folder of the runs, and a run whose worker dies continues from
    its newest checkpoint. On one machine, repeat the command with --resume.
    """
    check_packages()
    from .trainings import plan, train_all

    planned = plan(configs, seed or None, steps, output)
    make_folder(output)  # now, and not in each worker
    try:
        with counting("trainings") as progress:
            given: Any = {"resume": resume, "workers": workers, "ray": ray, "command": this_command()}
            outcomes = train_all(planned, progress=progress, **given)
    except KeyboardInterrupt as error:
        progress_console.print(f"Stopped. To continue, repeat the command with --resume ({output}).")
        raise typer.Exit(130) from error
    if json:
        print_json(outcomes)
        return
    rows = []
    for each in outcomes:
        change = "ended early" if each["ratio"] is None else f"{100 * (each['ratio'] - 1):+.1f} %"
        told = "" if each["qualified"] else "F_m out of range"
        rows.append((each["best"], str(each["best_steps"]), change, told))
    headings = ("model file", "step", "σ to passive", "disqualified")
    print_table(Table("best models", headings, tuple(rows)))


def ablation(
    config: Annotated[Path, typer.Argument(help="Ablation: a TOML file, or a name such as ablation.")],
    output: Annotated[
        Path | None,
        typer.Option(help="Folder of the runs; runs/NAME by default. What is there is kept."),
    ] = None,
    workers: Workers = None,
    ray: RayAddress = None,
    json: Json = False,
) -> None:
    """Train an agent with and without each of its parts, under several seeds, and compare the models."""
    check_packages()
    from .ablation import load_ablation, run, table, variants

    settings = load_ablation(config)
    folder, command = output or Path("runs") / config.stem, this_command()
    make_folder(folder)  # now, and not in each worker
    with counting("trainings") as progress:
        models, outcome = run(settings, folder, workers, ray, progress, command)
    found = variants(models, outcome)
    if json:
        rows = [asdict(each) for each in found]
        print_json({"settings": settings.model_dump(mode="json"), "variants": rows})
        return
    print_table(table(found, f"{settings.training}, {settings.total_steps:,} steps, {settings.judged_by}"))
