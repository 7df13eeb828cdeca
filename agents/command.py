"""``panto train`` and ``panto evaluate``. Torch and what needs it are imported when they run."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from panto_env.base.errors import InputError
from panto_env.metrics.labels import LABELS
from panto_env.terminal import Json, Plot, console, number, print_json, progress_console

if TYPE_CHECKING:
    from .evaluation import Pair

NEEDED = ("torch", "stable_baselines3", "tensorboard")
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
REPORTED = ("steps", "ratio", "qualified")  # facts of a model file that `panto train` prints


def train(
    config: Annotated[Path, typer.Argument(help="Training, a TOML file such as configs/ppo.toml.")],
    output: Annotated[
        Path | None, typer.Option(help="Folder of the run; runs/NAME-ALGORITHM-seedK if not given.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the run's newest checkpoint.")] = False,
    seed: Annotated[int | None, typer.Option(help="Instead of the file's.")] = None,
    steps: Annotated[int | None, typer.Option(help="Environment steps, instead of the file's.")] = None,
    json: Json = False,
) -> None:
    """Train a model; it is a policy that the benchmark takes by its path."""
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise InputError(
            f"Training needs {', '.join(missing)}, not installed here; install panto-env with its "
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
        progress_console.print(f"Stopped. Go on: the same command with --resume ({folder}).")
        raise typer.Exit(130) from error
    told: dict[str, Any] = {"output": str(paths.path), "tensorboard": str(paths.tensorboard)}
    for name, path in (("model", paths.model), ("best", paths.best)):
        facts, _ = read_model(path)
        told |= {name: str(path)} | {f"{name}_{key}": getattr(facts, key) for key in REPORTED}
    if json:
        print_json(told)
        return
    for name, what in (("model", "final model"), ("best", "best at an evaluation")):
        ratio = told[f"{name}_ratio"]
        change = "a run ended early" if ratio is None else f"σ {100 * (ratio - 1):+.1f} % of passive"
        note = "" if told[f"{name}_qualified"] else ", F_m out of range: disqualified"
        console.print(f"{what} (step {told[f'{name}_steps']}): {told[name]}: {change}{note}", soft_wrap=True)
    console.print(f"panto evaluate {told['best']}", soft_wrap=True)


def evaluate(
    policy: Annotated[str, typer.Argument(help="Model file, or a policy's name (with parameters).")],
    speed: Annotated[
        list[float] | None, typer.Option(help="km/h, repeatable; those of the training if not given.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Runs at each speed, seeds 0, 1, ...")] = 1,
    catenary: Annotated[str | None, typer.Option(help="Line: a name or TOML file.")] = None,
    pantograph: Annotated[str | None, typer.Option(help="Pantograph, likewise.")] = None,
    actuator: Annotated[str | None, typer.Option(help="Actuator: ideal or realistic.")] = None,
    sensors: Annotated[str | None, typer.Option(help="Sensors: ideal or realistic.")] = None,
    line_condition: Annotated[str | None, typer.Option(help="Line: new, fair or worn.")] = None,
    distance: Annotated[float | None, typer.Option(help="How far to run (m).")] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Compare a policy with the passive pantograph, paired by line, speed and seed.

    What is not given is as it was in the model's training.
    """
    from panto_env.policies import find_policy

    from .evaluation import Comparison, evaluated_spans, in_words
    from .policy import TrainedPolicy
    from .settings import arguments, speeds

    found = find_policy(policy)
    environment = found.facts.environment if isinstance(found, TrainedPolicy) else {"id": "Pantograph-v0"}
    options = {
        "catenary": catenary,
        "pantograph": pantograph,
        "actuator": actuator,
        "sensors": sensors,
        "line_condition": line_condition,
        "distance": distance,
    }
    environment = environment | {key: value for key, value in options.items() if value is not None}
    comparison = Comparison(arguments(environment), speed or speeds(environment), seeds)
    with progress_console.status("running"):
        pairs = comparison.run(found)
    if plot is not None:
        from panto_env.analysis import plots as figures

        runs = comparison.passes(found, comparison.speeds_kmh[0], 0)
        first = (evaluated_spans(runs[1]) or (1, 2))[0]
        title = f"{runs[0].pantograph} on {runs[0].catenary} at {runs[0].speed_kmh:g} km/h"
        shown = figures.plot_forces(runs, (policy, "passive"), (first, first + 1), title)
        figures.save(shown, plot)
    if json:
        print_json({"policy": policy, "environment": environment, "passes": [p.as_dict() for p in pairs]})
        return
    _print_pairs(pairs)
    console.print(f"mean of all: {in_words(pairs)}")


def _print_pairs(pairs: list[Pair]) -> None:
    """A section for each speed: means over the seeds."""
    table = Table()
    for heading in ("km/h", "figure", "policy", "passive", "change"):
        table.add_column(heading, justify="left" if heading == "figure" else "right")
    for speed in sorted({pair.speed_kmh for pair in pairs}):
        here = [pair for pair in pairs if pair.speed_kmh == speed]
        table.add_section()
        for key in ROWS:
            label = LABELS[key]
            policy, passive = (
                label.scale * sum(getattr(figures, key) for figures in column) / len(here)
                for column in ([pair.policy for pair in here], [pair.passive for pair in here])
            )
            change = f"{100 * (policy / passive - 1):+.1f} %" if passive > 0 else ""
            first = f"{speed:g}" if key == ROWS[0] else ""
            table.add_row(first, label.heading, number(policy), number(passive), change)
        faults = [f"{sum(pair.terminated for pair in here)} ended early"] * any(p.terminated for p in here)
        out = sum(not pair.qualified and not pair.terminated for pair in here)
        faults += [f"{out} with F_m out of range"] * (out > 0)
        if faults:
            table.add_row("", f"of {len(here)} passes, " + ", ".join(faults), "", "", "")
    console.print(table)
