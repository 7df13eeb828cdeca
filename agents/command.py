"""``panto train`` and ``panto evaluate``. Torch, and all that needs it, is imported only when they run."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from panto_env.analysis.options import with_settings
from panto_env.base.errors import InputError
from panto_env.metrics.labels import LABELS
from panto_env.terminal import Json, Plot, console, number, print_json, progress_console

if TYPE_CHECKING:
    from .evaluation import Pair

REQUIRED_PACKAGES = ("torch", "stable_baselines3", "tensorboard")
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
    json: Json = False,
) -> None:
    """Train a model; the benchmark takes its file as a policy."""
    missing = [name for name in REQUIRED_PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(
            f"Training needs {', '.join(missing)}, which is not installed; install panto-env with its "
            "extra: pip install 'panto-env[agents]'."
        )
    from .settings import load_training

    training = load_training(config, seed=seed, total_steps=steps)
    folder = output or Path("runs") / f"{config.stem}-{training.algorithm}-seed{training.seed}"
    with progress_console.status("loading torch"):
        from .model_file import read_model
        from .train import train as run
    try:
        paths = run(training, folder, resume=resume)
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
    from panto_env.policies import find_policy

    from .evaluation import Comparison, evaluated_spans, in_words
    from .policy import TrainedPolicy
    from .settings import arguments, speeds

    driver = find_policy(policy)
    environment = driver.facts.environment if isinstance(driver, TrainedPolicy) else {"id": "Pantograph-v0"}
    environment = environment | settings
    comparison = Comparison(arguments(environment), speed or speeds(environment), seeds)
    with progress_console.status("running"):
        pairs = comparison.run(driver)
    if plot is not None:
        from panto_env.analysis import plots

        runs = comparison.passes(driver, comparison.speeds_kmh[0], 0)
        first_span, _ = evaluated_spans(runs[1]) or (1, 2)
        title = f"{runs[0].pantograph} on {runs[0].catenary} at {runs[0].speed_kmh:g} km/h"
        picture = plots.plot_forces(runs, (policy, "passive"), (first_span, first_span + 1), title)
        plots.save(picture, plot)
    if json:
        print_json({"policy": policy, "environment": environment, "passes": [p.as_dict() for p in pairs]})
        return
    _print_pairs(pairs)
    console.print(f"mean of all: {in_words(pairs)}")


def _print_pairs(pairs: list[Pair]) -> None:
    """Print a table with a section for each speed: means over the seeds."""
    table = Table()
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
            change = f"{100 * (policy / passive - 1):+.1f} %" if passive > 0 else ""
            first = f"{speed:g}" if key == ROWS[0] else ""
            table.add_row(first, label.heading, number(policy), number(passive), change)
        ended_early = sum(pair.terminated for pair in pairs_here)
        out_of_range = sum(not pair.qualified and not pair.terminated for pair in pairs_here)
        notes = [f"{ended_early} ended early"] * (ended_early > 0)
        notes += [f"{out_of_range} with F_m out of range"] * (out_of_range > 0)
        if notes:
            table.add_row("", f"of {len(pairs_here)} passes, " + ", ".join(notes), "", "", "")
    console.print(table)
