"""Settings of a training, from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, SerializeAsAny

from panto_baselines.policies.repetitive import WashoutSettings
from panto_configs import find
from panto_env.base.arrays import to_kmh
from panto_env.base.errors import InputError, shown, suggest
from panto_env.base.files import read_toml
from panto_env.base.settings import Positive, Settings, parse
from panto_env.control import Context, Task
from panto_env.control.lines import on_example
from panto_env.control.settings import default, fields, run_settings
from panto_env.envs import IDS
from panto_env.policies import check_named, find_fitting_policy

from .algorithm import APG, PPO, SAC, Algorithm, Cloning, Count, DAgger, Share

ALGORITHMS: dict[str, type[Algorithm]] = {"ppo": PPO, "sac": SAC, "apg": APG, "dagger": DAgger}


MOST_LANES = 65_536
"""Maximum number of lanes; each has its own line in memory."""
LARGEST_SEED = 1_000_000_000
"""Maximum seed that the libraries' random generators accept, rounded down."""
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED, strict=True)]


class Evaluation(Settings):
    """Regular comparison of the policy, without exploration, with the passive pantograph."""

    interval_steps: Count = Field(description="training steps between evaluations")
    speeds_kmh: tuple[Positive, ...] | None = Field(
        None, description="speeds (km/h); the ends and the middle of each environment's by default"
    )
    seeds: Count = Field(1, description="runs at each speed, with seeds for selection: 1000, 1001, ...")


class Training(Settings):
    """Everything that defines a training."""

    algorithm: str = Field(description="one of ALGORITHMS")
    seed: Seed = Field(0, description="seed of all random numbers")
    total_steps: Count = Field(description="environment steps, summed over all lanes")
    lanes: Annotated[int, Field(gt=0, le=MOST_LANES, strict=True)] = Field(
        8, description="number of environments stepped together"
    )
    device: str | None = Field(
        None,
        description='"cuda" for environments and network on a GPU, with algorithm "ppo"; by default the '
        "processor",
    )
    lines: Count | None = Field(
        None,
        description="lines side by side where the environment's catenary is a list, a family or a section; "
        "by default one per lane",
    )
    episodes_per_line: Count = Field(
        1, description="episodes in each lane, on average, before the next line is drawn"
    )
    checkpoint_steps: Count = Field(description="training steps between checkpoints")
    environment: dict[str, Any] = Field(description="id and arguments of PantographEnv")
    variants: tuple[dict[str, Any], ...] = Field(
        (),
        description="changes of the environment's arguments, such as one pantograph of several; each has an "
        "equal share of the lanes and is evaluated",
    )
    evaluation: Evaluation
    start_from: str | None = Field(
        None,
        description="policy whose actions the agent learns before it learns from rewards; with algorithm apg "
        "an agent whose network it takes over and trains further",
    )
    cloning: Cloning = Field(Cloning(), description="how it learns them")
    residual_of: str | None = Field(None, description="policy that the agent's action is added to")
    residual_share: Share = Field(
        0.3, description="share of the actuator's force limit that the agent may add to that policy's action"
    )
    washout: WashoutSettings | None = Field(
        None, description="the slow average that is subtracted from the agent's action, if any"
    )
    hyperparameters: SerializeAsAny[Algorithm] = Field(description="of the algorithm")

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the environment, including those that its id sets."""
        return arguments(self.environment)

    @property
    def environments(self) -> tuple[dict[str, Any], ...]:
        """Arguments of each variant's environment, or of the only one."""
        return tuple(arguments(self.environment | changes) for changes in self.variants or ({},))

    def speeds_in(self, own: Mapping[str, Any]) -> tuple[float, ...]:
        """Speeds of the evaluation in one of the environments (km/h)."""
        return self.evaluation.speeds_kmh or speeds(own)


def arguments(environment: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of an environment, from a table that also holds its id.

    Raises InputError if the id or the name of an argument is unknown.
    """
    name = environment.get("id")
    if not isinstance(name, str) or name not in IDS:
        raise InputError(f"unknown id {shown(name)}: {suggest(shown(name), list(IDS))}.")
    own = {key: value for key, value in environment.items() if key != "id"}
    for key in own:
        if key not in fields():
            raise InputError(f"unknown key '{key}': {suggest(key, tuple(fields()))}")
    return {**IDS[name], **own}


def context_of(arguments: Mapping[str, Any]) -> Context:
    """What an episode offers in an environment, by its arguments. Raises InputError if these do not fit."""
    return Task(on_example(run_settings(arguments))).context(0)


def speeds(own: Mapping[str, Any]) -> tuple[float, ...]:
    """Minimum, middle and maximum speed of an environment, by its arguments, or its single speed (km/h)."""
    low, high = run_settings(own).speeds
    return tuple(sorted({round(to_kmh(v), 6) for v in (low, (low + high) / 2, high)}))


def load_training(path: str | Path, **changes: Any) -> Training:
    """Read a training from a TOML file, given by its path or by a name of ``configs/``.

    ``changes`` (seed, total_steps, device) replace the file's values unless None.

    Raises InputError, naming the file and the key, if it cannot be read or is not valid.
    """
    replacements = {key: value for key, value in changes.items() if value is not None}
    return parse_training(read_toml(find(path, "training")) | replacements, str(path))


def parse_training(table: Mapping[str, Any], name: str) -> Training:
    """Training from a table. Raises InputError, beginning with ``name``, if it is not valid."""
    try:
        algorithm = table.get("algorithm")
        if not isinstance(algorithm, str) or algorithm not in ALGORITHMS:
            raise InputError(
                f"unknown algorithm {shown(algorithm)}: {suggest(shown(algorithm), list(ALGORITHMS))}"
            )
        given = table.get("hyperparameters", {})
        hyperparameters = parse(ALGORITHMS[algorithm], given, f"[hyperparameters] of {algorithm}")
        training = parse(Training, {**table, "hyperparameters": hyperparameters}, "the training")
        hyperparameters.check(training)
        _check(training)
        return training
    except InputError as error:
        raise InputError(f"{name}: {str(error).removesuffix('.')}.") from error


def _check(training: Training) -> None:
    """Raise InputError for settings that do not fit each other, or the environment."""
    if training.device is not None:
        if training.algorithm != "ppo":
            raise InputError(f"on a device only ppo learns, not {training.algorithm}; leave out device")
        unused = "start_from", "residual_of", "washout", "variants", "lines"
        if given := [name for name in unused if getattr(training, name)]:
            raise InputError(
                f"on a device an agent acts alone, on one line; leave out {', '.join(given)}, or device. The "
                "environment has a washout of its own"
            )
    if any("id" in changes for changes in training.variants):
        raise InputError("variants change arguments of one environment; its id stands in [environment]")
    if training.lanes % max(1, len(training.variants)):
        raise InputError(
            f"{training.lanes} lanes cannot be shared equally by {len(training.variants)} variants"
        )
    try:
        for arguments in training.environments:
            own = arguments.get("speed_kmh", default("speed_kmh"))
            for speed in (own, *(training.evaluation.speeds_kmh or ())):
                Task(on_example(run_settings(arguments | {"speed_kmh": speed})))
    except InputError as error:
        raise InputError(f"[environment]: {error}") from error
    start = training.start_from
    if start is not None and training.residual_of is not None:
        raise InputError("start_from and residual_of exclude each other: an agent that adds starts from zero")
    if start is not None and training.variants and not isinstance(training.hyperparameters, APG):
        raise InputError("start_from and variants exclude each other: take residual_of, or one environment")
    settings = run_settings(training.arguments)
    for name in (start, training.residual_of):
        if name is not None:
            check_named(name, "it")
            find_fitting_policy(name, settings)
