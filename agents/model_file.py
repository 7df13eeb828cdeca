"""The model file: arrays and a table of facts, as safetensors, so that no code runs from it.

The table holds the facts below. The arrays under ``actor/`` are the deterministic policy, which runs without
torch. The arrays under ``learner/`` and ``replay/`` let a training resume (``learner.py``).
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError, field_validator

from panto_baselines.policies.repetitive import WashoutSettings
from panto_env.base.checksums import __version__, read_arrays, write_arrays
from panto_env.base.errors import InputError
from panto_env.base.settings import Positive, Settings
from panto_env.control.entries import READING_ENTRIES, present
from panto_env.control.observation import Context

from .actor import Actor, Cell, RecurrentActor
from .learner import Arrays, learn_again, learnt

CELL = "actor/cell_"
"""How the names of a recurrent cell's arrays begin."""
DRIVEN = ((0,), (1,), (0, 1))
"""Actuators that the actions of a policy can drive: frame, head, or both."""


class Needs(Settings):
    """Observation and actuator that a policy was trained with, which every task that it runs in must have."""

    observation: str  # kind of the layout
    harmonics: int = 1  # of the position within the span
    history: int = 0  # earlier control steps that are observed
    front: tuple[float, ...] = ()  # places ahead whose contact force the pantograph in front measured (m)
    memory: tuple[float, ...] = ()  # times until places of which earlier spans are remembered (s)
    memory_spans: int = 1  # number of these spans
    line_values: bool = False  # whether the line's are observed
    normalise: tuple[float, float] | None = None  # speeds (km/h) of the passive runs that normalise readings
    entries: tuple[tuple[str, float, float], ...]  # name, centre and scale of each observation
    channels: tuple[int, ...]  # actuator that each action drives: 0 frame, 1 head
    force_limit: float  # N
    control_interval: float  # s
    washout: float = (
        0.0  # time constant (s) of what the environment subtracts from the actions, 0 for nothing
    )

    @field_validator("channels")
    @classmethod
    def _driven(cls, channels: tuple[int, ...]) -> tuple[int, ...]:
        if channels not in DRIVEN:
            raise ValueError("no actuator drives that")
        return channels

    @classmethod
    def of(cls, context: Context) -> Needs:
        """Observation and actuator of an episode."""
        layout = context.layout
        # Normalised readings use each line's own centre and slope, which the policy is meant to see.
        names = (
            (*(name for name, _, _ in READING_ENTRIES), "remembered force", "speed")
            if layout.normalise
            else ()
        )
        return cls(
            observation=layout.kind,
            harmonics=layout.harmonics,
            history=layout.history,
            front=layout.front,
            memory=layout.memory,
            memory_spans=layout.memory_spans,
            line_values=layout.line_values,
            normalise=layout.normalise,
            entries=tuple(
                (entry.name, 0.0, 1.0) if present(entry) in names else (entry.name, entry.centre, entry.scale)
                for entry in layout.entries
            ),
            channels=context.channels,
            force_limit=context.force_limit,
            control_interval=context.control_interval,
            washout=context.washout,
        )


class Step(Settings):
    """A step from an observation to the network: scaled, or stacked with earlier ones, oldest first."""

    centre: tuple[float, ...] = ()  # is subtracted; (): it is stacked
    scale: tuple[Positive, ...] = ()  # divides the difference
    bound: Positive | None = None  # maximum magnitude, to which that is clipped
    frames: Annotated[int, Field(ge=1)] = 1  # that are stacked
    padding: tuple[float, ...] | None = None  # frame before the first one; None: that one, repeated

    def width(self, entries: int) -> int:
        """Number of values after it. Raises ValueError where it takes another number."""
        own = (self.centre, self.scale) if self.centre else (self.padding,)
        if any(each is not None and len(each) != entries for each in own):
            raise ValueError("the steps from its observation to its network do not fit each other")
        return entries * self.frames


class Facts(Settings):
    """Facts that a model file holds about its policy."""

    format: Literal[2] = 2
    version: str = __version__  # of panto_env
    commit: str | None = None  # of the checkout that it was trained with
    command: str | None = None  # command that trained it
    algorithm: str
    seed: int
    steps: int  # environment steps that it has learnt from
    updates: int  # of the networks, as Stable-Baselines3 counts them
    environment: dict[str, Any]  # environment that it was trained in: id and arguments
    variants: tuple[dict[str, Any], ...] = ()  # changes of its arguments, each with a share of the training
    needs: Needs
    steps_before: tuple[Step, ...] = ()  # from the observation to the network
    residual_of: str | None = None  # policy that its action is added to
    residual_share: float = 1.0  # factor on its action when added
    washout: WashoutSettings | None = None  # the slow average that is subtracted from its action
    ratio: float | None = None  # from the last evaluation: mean of sigma over the passive pantograph's
    qualified: bool = False  # from the last evaluation: whether the mean force stayed within its range
    activation: Literal["tanh", "relu"]
    squashed: bool

    @property
    def inputs(self) -> int:
        """Number of the network's inputs. Raises ValueError where the steps do not fit each other."""
        width = len(self.needs.entries)
        for step in self.steps_before:
            width = step.width(width)
        return width


def write_model(path: Path, model: Any, actor: Actor, facts: Facts, replay: bool = False) -> None:
    """Write a model file, whole or not at all. replay: include the replay buffer.

    Raises InputError if it can't be written.
    """
    _write(path, facts, layers(actor) | learnt(model, replay))


def export_model(source: Path, target: Path) -> None:
    """Copy only the policy of a model file, facts and layers, without the state for further training.

    Raises InputError, naming the file, if ``source`` is damaged or ``target`` cannot be written.
    """
    write_policy(target, *read_model(source))


def write_policy(path: Path, facts: Facts, actor: Actor) -> None:
    """Write a model file without the state for further training. Raises InputError if it can't be written."""
    _write(path, facts, layers(actor))


def read_model(path: Path) -> tuple[Facts, Actor]:
    """Facts and policy of a model file.

    Raises InputError, naming the file, if it is damaged or not a model file of `panto train`.
    """
    facts, actor, _ = _read(path)
    return facts, actor


def restore(path: Path, model: Any) -> Facts:
    """Put a checkpoint's networks, optimisers, counts and replay buffer into a new learner.

    Raises InputError if the file is damaged or belongs to another algorithm or shape.
    """
    facts, _, arrays = _read(path)
    try:
        learn_again(model, arrays)
    except (LookupError, RuntimeError, TypeError, ValueError) as error:
        reason = str(error).partition("\n")[0].rstrip(".")
        raise InputError(f"{path} does not fit the training's settings: {reason}.") from error
    model.num_timesteps, model._n_updates = facts.steps, facts.updates
    return facts


def _write(path: Path, facts: Facts, arrays: Arrays) -> None:
    write_arrays(path, facts.model_dump(mode="json"), arrays)


def _read(path: Path) -> tuple[Facts, Actor, Arrays]:
    try:
        table, arrays = read_arrays(path)
        facts = Facts.model_validate(table)
        return facts, actor_of(arrays, facts), arrays
    except FileNotFoundError as error:
        raise InputError(f"The model file {path} does not exist; check the path.") from error
    except (OSError, ValueError) as error:
        reason = "its facts are not valid" if isinstance(error, ValidationError) else str(error)
        raise InputError(
            f"{path} is not a whole model file ({reason.rstrip('.')}); take another one, such as an earlier "
            "checkpoint, or train a model with `panto train`."
        ) from error


def layers(actor: Actor) -> Arrays:
    """Weights and biases of a policy's network, with their names in a model file."""
    weights = {f"actor/weight_{k}": weight for k, weight in enumerate(actor.weights)}
    own = weights | {f"actor/bias_{k}": bias for k, bias in enumerate(actor.biases)}
    if isinstance(actor, RecurrentActor):
        own |= {f"{CELL}{name}": array for name, array in actor.cell._asdict().items()}
    return own


def actor_of(arrays: Arrays, facts: Facts) -> Actor:
    """The policy's network. Raises ValueError unless its layers fit each other and what the facts say."""
    own = {name: array for name, array in arrays.items() if name.startswith("actor/")}
    parts = {name.removeprefix(CELL): own.pop(name) for name in list(own) if name.startswith(CELL)}
    if parts and set(parts) != set(Cell._fields):
        raise ValueError("its network has only a part of a cell")
    cell = Cell(**parts) if parts else None
    count, width = len(own) // 2, facts.inputs
    if not count or set(own) != {f"actor/{kind}_{k}" for k in range(count) for kind in ("weight", "bias")}:
        raise ValueError("its network has no layers, or not a weight and a bias in each")
    weights, biases = (tuple(own[f"actor/{kind}_{k}"] for k in range(count)) for kind in ("weight", "bias"))
    for k, (weight, bias) in enumerate(zip(weights, biases, strict=True), start=1):
        if not all(each.dtype.kind == "f" and np.isfinite(each).all() for each in (weight, bias)):
            raise ValueError(f"layer {k} of its network holds values that are not finite numbers")
        if weight.ndim != 2 or weight.shape[1] != width or bias.shape != weight.shape[:1]:
            raise ValueError(f"layer {k} of its network does not fit the one before, or what it observes")
        width = len(bias)
        if k == 1 and cell is not None:
            cell.check(width)
            width += cell.units
    if width != len(facts.needs.channels):
        raise ValueError("its network differs in shape from its facts")
    if cell is not None:
        return RecurrentActor(weights, biases, facts.activation, facts.squashed, cell=cell)
    return Actor(weights, biases, facts.activation, facts.squashed)
