"""``panto train``, ``panto export`` and ``panto evaluate``. Torch is imported only when they run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from panto_env.analysis.options import with_settings
from panto_env.analysis.requirements import print_criteria
from panto_env.base.files import make_folder
from panto_env.metrics.criterion import worst
from panto_env.metrics.labels import LABELS
from panto_env.metrics.spans import FIRST_SETTLED
from panto_env.terminal import (
    Json,
    Plot,
    console,
    number,
    print_json,
    progress_console,
    this_command,
    writable,
    written_last,
)

from .packages import check_packages

if TYPE_CHECKING:
    from .evaluation import Pair

ROWS = (
    "mean",
    "std",
    "max",
    "min",
    "cost_function",
    "contact_loss",
    "max_uplift",
    "effort",
    "effort_rate",
)
"""Figures that `panto evaluate` prints."""
SHOWN = (FIRST_SETTLED, FIRST_SETTLED + 1)
"""Spans in the plot of `panto evaluate`."""
REPORTED_FACTS = ("steps", "ratio", "qualified")
"""Facts of a model file that `panto train` prints."""


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
    from .run_folder import RunFolder
    from .settings import load_training
    from .trainings import run_name

    training = load_training(config, seed=seed, total_steps=steps, device=device)
    folder = output or Path("runs") / run_name(config, training)
    if resume:
        RunFolder(folder).check_resumable(training)
    else:
        RunFolder(folder).check_new()
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
    for name, path in (("model", paths.model), ("best", paths.best)):
        facts, _ = read_model(path)
        report |= {name: str(path)} | {f"{name}_{key}": getattr(facts, key) for key in REPORTED_FACTS}
    if json:
        print_json(report)
        return
    for name, label in (("model", "final model"), ("best", "best at an evaluation")):
        ratio, steps_learnt = report[f"{name}_ratio"], report[f"{name}_steps"]
        change = "a run ended early" if ratio is None else f"σ {100 * (ratio - 1):+.1f} % of passive"
        note = "" if report[f"{name}_qualified"] else ", F_m out of range: disqualified"
        console.print(f"{label} (step {steps_learnt}): {report[name]}: {change}{note}", soft_wrap=True)
    console.print(f"panto evaluate {report['best']}", soft_wrap=True)


def export(
    model: Annotated[Path, typer.Argument(help="Model file that `panto train` wrote.")],
    output: Annotated[
        str, typer.Argument(help="Model file to write (.safetensors).", callback=writable((".safetensors",)))
    ],
) -> None:
    """Write a model file to publish: only what the policy needs, as arrays and JSON, with nothing pickled.

    The policy is the same, but it cannot be trained further.
    """
    from .model_file import export_model

    export_model(model, Path(output))


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
    from panto_baselines.benchmark.seeds import TEST, check_seeds
    from panto_env.analysis.pool import check_passes
    from panto_env.policies import find_policy, wishes

    from .ensemble import Ensemble
    from .evaluation import Comparison, in_words, verdict
    from .policy import TrainedPolicy
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
            picture = plots.plot_forces(runs, (policy, "passive"), SHOWN, title)
            later(plots.save, picture, plot)
        if json:
            ratio, qualified = verdict(pairs)
            run = {"policy": policy, "environment": environment, "settings": comparison.settings}
            found = {"ratio": ratio, "qualified": qualified}
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
    table = Table(title=f"spans {spans}")
    for heading in ("km/h", "figure", "policy", "passive", "change"):
        table.add_column(heading, justify="left" if heading == "figure" else "right")
    for speed in sorted({pair.speed_kmh for pair in pairs}):
        pairs_here = [pair for pair in pairs if pair.speed_kmh == speed]
        table.add_section()
        for key in ROWS:
            label = LABELS[key]
            policy, passive = (
                label.scale * sum(getattr(figures, key) for figures in column) / len(pairs_here)
                for column in ([pair.policy for pair in pairs_here], [pair.passive for pair in pairs_here])
            )
            change = f"{100 * (policy / passive - 1):+.1f} %" if passive > 0 and math.isfinite(policy) else ""
            first = f"{speed:g}" if key == ROWS[0] else ""
            table.add_row(first, label.heading, number(policy), number(passive), change)
        ended_early = sum(pair.terminated for pair in pairs_here)
        passive_too = sum(pair.passive_ending != "" for pair in pairs_here)
        out_of_range = len(pairs_here) - sum(
            pair.qualified or pair.terminated or pair.passive_ending != "" for pair in pairs_here
        )
        notes = [f"{ended_early} ended early"] * (ended_early > 0)
        notes += [f"{passive_too} without a policy did"] * (passive_too > 0)
        notes += [f"{out_of_range} with F_m out of range"] * (out_of_range > 0)
        if notes:
            table.add_row("", f"of {len(pairs_here)} passes, " + ", ".join(notes), "", "", "")
    console.print(table)
